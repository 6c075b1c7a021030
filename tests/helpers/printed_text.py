"""Texts of a page beside what a command prints: words alike, numbers to their last digit."""

import re
from decimal import Decimal

CUT = "..."
"""End of a line of a page that leaves out the rest of what is printed."""


def numbers_and_words(line):
    """Return the numbers of a line as texts, and the line without them and without its spacing."""
    number = r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.]*\w)"
    return re.findall(number, line), " ".join(re.sub(number, " # ", line).split())


def last_digit(number):
    """Return what one more in its last digit adds to a number."""
    return float(Decimal(1).scaleb(Decimal(number).as_tuple().exponent))


def is_shown(here, there):
    """Tell whether a line of a page is a printed one, but for the last digits of numbers."""
    if here.endswith(CUT):
        return there.startswith(here.removesuffix(CUT))
    (values, words), (truths, said) = numbers_and_words(here), numbers_and_words(there)
    # Another machine may round the last digit otherwise.
    return words == said and all(
        abs(float(value) - float(true)) <= 1.01 * last_digit(true)
        for value, true in zip(values, truths, strict=True)
    )


def assert_shows(block, output):
    """A block of a page is what was printed, but for the last digits of numbers."""
    shown, printed = (text.strip().split("\n") for text in (block, output))
    assert len(shown) == len(printed), output
    for here, there in zip(shown, printed, strict=True):
        assert is_shown(here, there), there
