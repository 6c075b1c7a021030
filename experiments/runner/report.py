"""The report: one self-contained HTML page of every result found in a folder."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from experiments.runner.provenance import report_fingerprint
from experiments.runner.registry import EXPERIMENTS
from experiments.runner.result import Finding, Table
from experiments.runner.store import StoredResult, load, write_atomically
from pymoo_hdte.checks import InvalidInput

PAGE = "index.html"
_TITLE = "Robust design of a harmonic drive: results"
_VERDICTS = {
    "Agrees": ("Agrees with the paper", "yes"),
    "Differs": ("Does not agree with the paper", "no"),
    "Fitted": ("Given back, because the model was fitted to it", "fitted"),
    "Missed by the fit": ("Not given back, though the model was fitted to it", "no"),
    "Fails": ("Checks of our own that fail", "no"),
    "Holds": ("Checks of our own that hold", "yes"),
}
"""Heading of the findings of one verdict, and the style that they are shown in."""


def check_page(out: Path) -> None:
    """Refuse a folder whose page is not a report of ours, before anything is written there.

    Raises
    ------
    InvalidInput
        If it would be overwritten.
    OSError
        If it cannot be read.
    """
    path = out / PAGE
    if not (path.exists() or path.is_symlink()):
        return
    ours = path.is_file() and not path.is_symlink()
    if not ours or f"<title>{_TITLE}</title>" not in path.read_text("utf-8", "replace"):
        raise InvalidInput("--out", str(out), f"a new folder, or one whose {PAGE} is such a report")


def write_report(out: Path, notice: str = "") -> Path:
    """Write ``out/index.html`` from every stored result in the folder ``out``; return its path.

    Results that another version of the source made are marked as such. ``notice`` is shown at the
    top, e.g. what an interrupt left undone.
    """
    stored = [load(out, experiment.name) for experiment in EXPERIMENTS]
    results = [result for result in stored if result is not None]
    present = report_fingerprint()
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parents[1] / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template(PAGE).render(
        results=results,
        headlines=_headlines(results),
        verdicts=[
            (heading, mood, _findings(results, verdict))
            for verdict, (heading, mood) in _VERDICTS.items()
        ],
        moods={verdict: mood for verdict, (_, mood) in _VERDICTS.items()},
        outdated=[result.name for result in results if result.made_by != present],
        notice=notice,
        title=_TITLE,
        base64=lambda png: base64.b64encode(png).decode(),
        zip=zip,
    )
    path = out / PAGE
    write_atomically(path, page.encode())
    return path


def _headlines(results: Sequence[StoredResult]) -> list[tuple[StoredResult, Table]]:
    return [
        (result, table)
        for result in results
        for table in result.tables
        if table.name == result.headline
    ]


def _findings(results: Sequence[StoredResult], verdict: str) -> list[tuple[str, Finding]]:
    return [
        (result.name, finding)
        for result in results
        for table in result.tables
        for finding in table.findings
        if finding.verdict == verdict
    ]
