"""The page of one result, with its tables and figures beside it."""

from __future__ import annotations

from pathlib import Path

from jinja2 import ChoiceLoader, Environment, FileSystemLoader, StrictUndefined

from pymoo_hdte._runner.result import MOODS
from pymoo_hdte._runner.store import StoredResult

_TEMPLATES = Path(__file__).parent / "templates"


def environment_of(*folders: Path) -> Environment:
    """Return what fills templates of these folders, which may build on those of this package."""
    environment = Environment(
        loader=ChoiceLoader([FileSystemLoader(folder) for folder in (*folders, _TEMPLATES)]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals["zip"] = zip
    return environment


def result_page(result: StoredResult, question: str, folder: str, times: str) -> str:
    """Return a page that stands alone.

    Parameters
    ----------
    result : StoredResult
        What it shows.
    question : str
        What the result answers, if it does not say so itself.
    folder, times : str
        Where its tables and figures lie, and its tables of wall times; empty, or ending in /.
    """
    template = environment_of().get_template("result.html")
    values = {"question": question, "folder": folder, "times": times, "moods": MOODS}
    return template.render(result=result, **values)
