"""The long texts of the pages, which stand as templates in ``experiments/templates/texts``."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined


def paragraphs(name: str, **values: object) -> tuple[str, ...]:
    """Return the paragraphs of a text in their order, each on one line, with its blanks filled.

    Raises
    ------
    jinja2.UndefinedError
        A blank has no value.
    """
    text = _environment().get_template(f"{name}.txt").render(values)
    return tuple(" ".join(paragraph.split()) for paragraph in text.strip().split("\n\n"))


@cache
def _environment() -> Environment:
    folder = Path(__file__).parents[1] / "templates" / "texts"
    return Environment(loader=FileSystemLoader(folder), undefined=StrictUndefined, autoescape=False)
