"""Commands of every page are commands: programs, options and scripts that exist."""

import re
import shlex

import pytest
from places import DOCS, README, ROOT

from pymoo_hdte.cli import command_line as cli

TEXTS = {"README.md": README} | {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in sorted(DOCS.glob("*.md"))
}
LINES = [
    (page, line)
    for page, text in TEXTS.items()
    for block in re.findall(r"^```sh\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)
    for line in block.splitlines()
]


@pytest.mark.parametrize(
    ("page", "line"), [entry for entry in LINES if entry[1].startswith("pymoo-hdte ")]
)
def test_options_of_a_command_are_known(page, line):
    cli._parser().parse_args(shlex.split(line)[1:])


@pytest.mark.parametrize(
    ("page", "line"), [entry for entry in LINES if re.match(r"python \w", entry[1])]
)
def test_a_script_is_where_a_page_says(page, line):
    assert (ROOT / shlex.split(line)[1]).is_file()


def test_pages_have_commands_of_both_kinds():
    programs = {line.split()[0] for _, line in LINES}
    assert {"pymoo-hdte", "python"} <= programs
