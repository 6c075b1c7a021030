"""Words of a verdict coded as numbers, as the store of a campaign keeps numbers only."""

from __future__ import annotations

from collections.abc import Iterable

from experiments.studies.blind.cases import BELIEVED
from experiments.studies.blind.rig.forms import LISTED, UNLISTED
from pymoo_hdte.discrepancy._records.believed import MECHANICAL
from pymoo_hdte.discrepancy._selection.verdict import STATUSES as VERDICTS
from pymoo_hdte.drive._effects import ENCODER_LINE, drive_effects

ERROR = "error"
"""Status of a case in which the workflow raised an exception."""
STATUSES = (*VERDICTS, ERROR)
_NEVER_HIDDEN = tuple(sorted({one.name for one in drive_effects()} - set(LISTED)))
"""Effects of the library that no case hides under their names."""
NAMES = (
    *LISTED,
    *_NEVER_HIDDEN,
    *UNLISTED,
    ENCODER_LINE,
    "parameter",
    *(status for status in STATUSES if status != "parameter"),
)
"""What a tool may answer: an effect, or a status where it names none."""
_LINES = tuple(f"error_amplitude_{line}" for line in range(len(BELIEVED.error_orders)))
PORTS = ("input", "output", "mesh", "sensor", *MECHANICAL, *_LINES)
"""Where an effect is; of a parameter out of tolerance, its name."""


def code(word: str, words: tuple[str, ...]) -> float:
    """Return the place of a word."""
    return float(words.index(word))


def word(number: float, words: tuple[str, ...]) -> str:
    """Return the word of a `code`."""
    return words[int(number)]


def code_of_set(names: Iterable[str]) -> float:
    """Return a set of `NAMES` as the number whose bits they are; exact, as they are below 53."""
    return float(sum(1 << NAMES.index(name) for name in set(names)))


def words_of_set(number: float) -> tuple[str, ...]:
    """Return the set of a `code_of_set`, in the order of `NAMES`."""
    return tuple(name for place, name in enumerate(NAMES) if int(number) >> place & 1)
