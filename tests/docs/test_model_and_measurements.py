"""What "Where is my model wrong?" tells one to type prints what the page shows."""

import contextlib
import io
import re
import runpy
import shlex
import sys

import pytest
from places import DOCS
from printed_text import assert_shows, last_digit, numbers_and_words

from pymoo_hdte.cli import command_line as cli

PAGE = (DOCS / "model_and_measurements.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)


def test_the_page_shows_what_its_commands_print(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made, looked = (shlex.split(line) for line in blocks("sh")[0].splitlines())
    script = DOCS.parent / made[1]
    monkeypatch.setattr(sys, "argv", [str(script), *made[2:]])
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        runpy.run_path(str(script), run_name="__main__")
        assert cli.main(looked[1:]) == 0
    assert_shows(blocks("text")[0], text.getvalue())


def test_lines_are_compared_by_their_numbers():
    values, words = numbers_and_words("order_2, 95 %: 1.66e-05 to  -3.5, K1 is 2.")
    assert values == ["95", "1.66e-05", "-3.5", "2"]
    assert words == "order_2, # %: # to # , K1 is # ."
    assert [last_digit(value) for value in values] == pytest.approx([1.0, 1e-7, 0.1, 1.0])
