"""The folder of a report on a verdict."""

from __future__ import annotations

from pathlib import Path

from pymoo_hdte._reports.folder import ReportFolder
from pymoo_hdte.discrepancy._answers.descriptive_model import DESCRIPTIVE_FILE
from pymoo_hdte.discrepancy._answers.revision_drive import MODEL_FILE, SHEET_FILE

PLOT_FILES = tuple(
    f"{name}.{suffix}" for name in ("friction", "torsion", "campbell") for suffix in ("csv", "svg")
)
"""Names of all files of plots that a report may have: pictures, and the plotted numbers."""
FOLDER = ReportFolder(
    "verdict.json", optional=(MODEL_FILE, SHEET_FILE, DESCRIPTIVE_FILE, *PLOT_FILES)
)


def check_report_folder(out: str | Path) -> None:
    """Refuse a folder that cannot take a report, before the analysis is run.

    Parameters
    ----------
    out : str or Path
        New, empty, or an earlier report, which `report` replaces.

    Raises
    ------
    InvalidInput
        If the folder holds anything else.
    OSError
        If it cannot be written.

    Examples
    --------
    >>> check_report_folder("a_new_folder")
    """
    FOLDER.check(Path(out))
