"""The glossary: the words of the reports, written to ``docs/glossary.md`` before pages are read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

from pymoo_hdte._reports.glossary import GLOSSARY

_HEAD = """# Glossary

Each report ends with the terms that it uses.
"""


def setup(app: Sphinx) -> dict[str, Any]:
    """Have the page written when a build begins."""
    app.connect("builder-inited", _write)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def page() -> str:
    """Return the page in Markdown."""
    parts = [_HEAD]
    for chapter, terms in GLOSSARY.items():
        parts.append(f"## {chapter}\n\n```{{glossary}}")
        parts += [f"{term}\n  {meaning}\n" for term, meaning in terms.items()]
        parts.append("```\n")
    return "\n".join(parts)


def _write(app: Sphinx) -> None:
    target, text = Path(app.srcdir) / "glossary.md", page()
    # An unchanged page keeps its date, so that it is not built again.
    if not target.exists() or target.read_text(encoding="utf-8") != text:
        target.write_text(text, encoding="utf-8")
