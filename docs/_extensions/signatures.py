"""Signatures without the hundred thresholds of `Rules`, which would fill a screen each time."""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

_DEFAULT = re.compile(r"=Rules\([^()]*\)")


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the change of the signatures."""
    app.setup_extension("sphinx.ext.autodoc")
    app.connect("autodoc-process-signature", _named)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _named(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, arguments: str, returned: str
) -> tuple[str, str] | None:
    if name.endswith(".Rules"):
        return "(...)", returned
    return (_DEFAULT.sub("=RULES", arguments), returned) if arguments else None
