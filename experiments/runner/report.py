"""The report: a first page, a page for each experiment, and what the pages have in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from jinja2 import Environment

import experiments
from experiments.runner.catalogue import EXPERIMENTS
from pymoo_hdte._runner.page import environment_of
from pymoo_hdte._runner.provenance import files_below, fingerprint
from pymoo_hdte._runner.result import FIRST_PAGE, MISSED, MOODS, NOT_SHOWN, SHOWN, Finding
from pymoo_hdte._runner.store import TIMES, StoredPicture, StoredResult, load, write_atomically
from pymoo_hdte.checks import InvalidInput

PAGE = "index.html"
COMPARISONS = "comparisons.html"
MODELS = "models.html"
_TITLE = "Robust design of a harmonic drive: results"
_LEADING = ("robust", "table6", "table2", "table3")
"""Experiments that come first in a section of the first page, where they have a part in it."""
_VERDICTS = {
    "Contradicts": "Contradictions within the paper",
    "Consistent": "Consistent within the paper",
    "Differs": "Our models or runs differ from the paper",
    "Agrees": "Our models or runs agree with the paper",
    "Missed by the fit": "Not given back, though the model was fitted to it",
    "Fitted": "Given back, because the model was fitted to it",
    "Fails": "Checks of our own that fail",
    "Holds": "Checks of our own that hold",
    MISSED: "Scores that miss what was demanded",
    NOT_SHOWN: "Scores that meet it, but with too few cases to show it",
    SHOWN: "Scores shown to meet what was demanded",
}
"""Headings of the findings of one verdict."""


def report_fingerprint() -> str:
    """Identify the state of everything in this repository that a finished result depends on.

    That is the source, and the stored outcomes and the template of the page beside it.
    """
    return fingerprint(*files_below(Path(experiments.__file__).parent))


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
    """Write the pages of every stored result in the folder ``out``; return that of the first.

    Each experiment has ``out/NAME/index.html`` beside its tables and figures. The first page comes
    last, so that it never points at a page that is missing. Results that another version of the
    source made are marked as such. ``notice`` is shown at the top, e.g. what an interrupt left
    undone.
    """
    stored = [load(out, experiment.name) for experiment in EXPERIMENTS]
    results = [result for result in stored if result is not None]
    present = report_fingerprint()
    questions = {experiment.name: experiment.question for experiment in EXPERIMENTS}
    common = {
        "site": _TITLE,
        "results": results,
        "questions": questions,
        "moods": MOODS,
        "outdated": [result.title for result in results if result.made_by != present],
    }
    for result in results:
        times = f"../{TIMES}/{result.name}/"
        own = {"question": questions[result.name], "folder": "", "times": times}
        page = _page("experiment.html", common, up="../", result=result, **own)
        write_atomically(out / result.name / PAGE, page)
    models = {name: text for result in results for name, text in result.models.items()}
    write_atomically(out / MODELS, _page(MODELS, common, up="", models=models))
    verdicts = [
        (heading, MOODS[verdict], _findings(results, verdict))
        for verdict, heading in _VERDICTS.items()
    ]
    write_atomically(out / COMPARISONS, _page(COMPARISONS, common, up="", verdicts=verdicts))
    values = {
        "sections": {about: _parts(results, about) for about in FIRST_PAGE},
        "shown": _shown_first(results),
        "verdicts": verdicts,
        "models": list(models),
        "notice": notice,
    }
    write_atomically(out / PAGE, _page(PAGE, common, up="", **values))
    return out / PAGE


def _page(template: str, common: Mapping[str, object], **values: object) -> bytes:
    """Return a page; ``up`` leads from it to the folder of the first one."""
    return _environment().get_template(template).render({**common, **values}).encode()


@cache
def _environment() -> Environment:
    """Return what compiles each template once."""
    return environment_of(Path(__file__).parents[1] / "templates")


def _parts(results: Sequence[StoredResult], about: str) -> list[tuple[StoredResult, str]]:
    """Return what the results have to say in one section of the first page."""
    parts = [(result, result.first_page[about]) for result in results if about in result.first_page]
    return sorted(parts, key=lambda part: _place(part[0].name))


def _place(name: str) -> int:
    return _LEADING.index(name) if name in _LEADING else len(_LEADING)


def _shown_first(results: Sequence[StoredResult]) -> list[tuple[StoredResult, StoredPicture]]:
    return [
        (result, picture)
        for result in results
        for picture in result.pictures
        if picture.name == result.shown_first
    ]


def _findings(results: Sequence[StoredResult], verdict: str) -> list[tuple[StoredResult, Finding]]:
    return [
        (result, finding)
        for result in results
        for table in result.tables
        for finding in table.findings
        if finding.verdict == verdict
    ]
