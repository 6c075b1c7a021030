"""Pictures of guides in a box of their own, in which they scroll where the screen is narrow."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

_PICTURE = re.compile(r'<img [^>]*class = "sphx-glr-single-img"/>')


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the change of the pages."""
    app.connect("html-page-context", _boxed)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _boxed(
    app: Sphinx, page: str, template: str, context: dict[str, Any], tree: nodes.document | None
) -> None:
    if "body" in context:
        context["body"] = _PICTURE.sub(r'<div class="picture">\g<0></div>', context["body"])
