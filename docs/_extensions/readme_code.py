"""The examples of the README on other pages: ``{readme-code} word`` shows the block with that word.

They stand in the README alone, whose tests run them. What a block prints follows it.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx.application import Sphinx

README = Path(__file__).parents[2] / "README.md"
_BLOCK = re.compile(
    r"^```(python|sh)\n(.*?)^```\n(?:This prints `(.*?)`|```text\n(.*?)^```)?",
    re.DOTALL | re.MULTILINE,
)


def block_with(word: str, text: str) -> tuple[str, str, str]:
    """Return language, code and output of the only block with a word; the output may be empty."""
    (found,) = (one for one in _BLOCK.findall(text) if word in one[1])
    language, code, *printed = found
    # Sphinx colours code only if its source is the very text.
    return language, code.rstrip("\n"), "".join(printed).rstrip("\n")


class ReadmeCode(Directive):
    """A block of the README."""

    required_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        """Return the block, and what it prints."""
        self.state.document.settings.env.note_dependency(str(README))
        language, code, printed = block_with(self.arguments[0], README.read_text(encoding="utf-8"))
        shown: list[nodes.Node] = [nodes.literal_block(code, code, language=language)]
        if printed:
            shown.append(nodes.literal_block(printed, printed, language="text"))
        return shown


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("readme-code", ReadmeCode)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
