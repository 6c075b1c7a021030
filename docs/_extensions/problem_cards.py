"""Cards of the robust problems: written to ``docs/cards`` before the pages are read."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

_ROOT = Path(__file__).parents[2]


def setup(app: Sphinx) -> dict[str, Any]:
    """Have the cards written when a build begins."""
    app.connect("builder-inited", _write)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _write(app: Sphinx) -> None:
    # The experiments are no part of the installed package.
    sys.path.insert(0, str(_ROOT))
    from experiments.studies.cards.pages import write_pages

    write_pages(Path(app.srcdir) / "cards")
