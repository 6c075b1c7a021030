"""What "Where is my model wrong?" tells one to type prints what the page shows."""

import re

import pytest
from places import DOCS, README
from printed_text import assert_shows, last_digit, numbers_and_words
from readme_examples import example

PAGE = (DOCS / "model_and_measurements.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)


def test_the_page_shows_what_the_commands_of_the_readme_print():
    commands, *_ = blocks("sh")
    assert commands in README
    printed, _ = example("verdict.png")
    assert_shows(blocks("text")[0], printed)


def test_lines_are_compared_by_their_numbers():
    values, words = numbers_and_words("order_2, 95 %: 1.66e-05 to  -3.5, K1 is 2.")
    assert values == ["95", "1.66e-05", "-3.5", "2"]
    assert words == "order_2, # %: # to # , K1 is # ."
    assert [last_digit(value) for value in values] == pytest.approx([1.0, 1e-7, 0.1, 1.0])
