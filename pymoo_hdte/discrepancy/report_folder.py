"""Which files a report on a discrepancy consists of."""

from __future__ import annotations

from pathlib import Path

from pymoo_hdte.discrepancy.revise import MODEL_FILE, SHEET_FILE
from pymoo_hdte.reports.folder import PAGE_FILE, check_folder

VERDICT_FILE = "verdict.json"
FILES = (VERDICT_FILE, PAGE_FILE, MODEL_FILE, SHEET_FILE)


def check_report_folder(out: Path) -> None:
    """Refuse a folder that could not take a report; errors as `check_folder`."""
    check_folder(out, (VERDICT_FILE, PAGE_FILE), (MODEL_FILE, SHEET_FILE))
