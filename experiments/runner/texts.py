"""The long texts of the pages, which stand as templates in ``experiments/templates``."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined


def filled(template: str, **values: object) -> str:
    """Return the text of a template with its blanks filled, as it stands.

    Raises
    ------
    jinja2.UndefinedError
        A blank has no value.
    """
    return _environment().get_template(template).render(values)


def paragraphs(name: str, **values: object) -> tuple[str, ...]:
    """Return the paragraphs of a text in their order, each on one line; errors as `filled`."""
    text = filled(f"texts/{name}.txt", **values)
    return tuple(" ".join(paragraph.split()) for paragraph in text.strip().split("\n\n"))


@cache
def _environment() -> Environment:
    return Environment(
        loader=FileSystemLoader(Path(__file__).parents[1] / "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
