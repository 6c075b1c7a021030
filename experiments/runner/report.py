"""The report: a first page, a page for each experiment, and what the pages have in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from experiments.runner.catalogue import EXPERIMENTS
from experiments.runner.provenance import report_fingerprint
from experiments.runner.result import FIRST_PAGE, MISSED, NOT_SHOWN, SHOWN, Finding
from experiments.runner.store import TIMES, StoredPicture, StoredResult, load, write_atomically
from pymoo_hdte.checks import InvalidInput

PAGE = "index.html"
COMPARISONS = "comparisons.html"
MODELS = "models.html"
_TITLE = "Robust design of a harmonic drive: results"
_LEADING = ("robust", "table6", "table2", "table3")
"""Experiments that come first in a section of the first page, where they have a part in it."""
_VERDICTS = {
    "Contradicts": ("Contradictions within the paper", "no"),
    "Consistent": ("Consistent within the paper", "yes"),
    "Differs": ("Our models or runs differ from the paper", "no"),
    "Agrees": ("Our models or runs agree with the paper", "yes"),
    "Missed by the fit": ("Not given back, though the model was fitted to it", "no"),
    "Fitted": ("Given back, because the model was fitted to it", "fitted"),
    "Fails": ("Checks of our own that fail", "no"),
    "Holds": ("Checks of our own that hold", "yes"),
    MISSED: ("Scores that miss what was demanded", "no"),
    NOT_SHOWN: ("Scores that meet it, but with too few cases to show it", "open"),
    SHOWN: ("Scores shown to meet what was demanded", "yes"),
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
    """Write the pages of every stored result in the folder ``out``; return that of the first.

    Each experiment has ``out/NAME/index.html`` beside its tables and figures. The first page comes
    last, so that it never points at a page that is missing. Results that another version of the
    source made are marked as such. ``notice`` is shown at the top, e.g. what an interrupt left
    undone.
    """
    stored = [load(out, experiment.name) for experiment in EXPERIMENTS]
    results = [result for result in stored if result is not None]
    present = report_fingerprint()
    common = {
        "site": _TITLE,
        "results": results,
        "questions": {experiment.name: experiment.question for experiment in EXPERIMENTS},
        "moods": {verdict: mood for verdict, (_, mood) in _VERDICTS.items()},
        "outdated": [result.title for result in results if result.made_by != present],
    }
    for result in results:
        page = _page("experiment.html", common, up="../", result=result, times=f"../{TIMES}")
        write_atomically(out / result.name / PAGE, page)
    models = {name: text for result in results for name, text in result.models.items()}
    write_atomically(out / MODELS, _page(MODELS, common, up="", models=models))
    verdicts = [
        (heading, mood, _findings(results, verdict))
        for verdict, (heading, mood) in _VERDICTS.items()
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
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parents[1] / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals["zip"] = zip
    return environment


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
