"""What counts as right: which names say what a case hides.

Two names of one physical effect are one: a damping, or an inertia of the load, out of tolerance is
what the effects ``damping_reference`` and ``load_inertia`` say, and dry friction whose contacts
bend before they slip is a form of dry friction. Some effects contain another one:
friction that falls with speed, or varies with position, or fades as grease warms up, is a dry
friction too; naming that beside the effect is no wrong name, naming it alone is not the effect.
"""

from __future__ import annotations

from collections.abc import Iterable

from experiments.studies.blind.cases import BELIEVED, OUT_OF_TOLERANCE, Case
from experiments.studies.blind.rig.forms import LISTED, UNLISTED
from pymoo_hdte.discrepancy._records.believed import MECHANICAL
from pymoo_hdte.discrepancy._selection.verdict import STATUSES as VERDICTS
from pymoo_hdte.drive._effects import ENCODER_LINE, drive_effects

ERROR = "error"
"""Status of a case in which the workflow raised an exception."""
STATUSES = (*VERDICTS, ERROR)
_NEVER_HIDDEN = tuple(
    sorted({effect.name for effect in drive_effects() if not effect.is_of_bench} - set(LISTED))
)
"""Effects of the library that no case hides under their names; nuisances are no answers."""
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


SAME = {"damping": "damping_reference", "load_inertia": "load_inertia"}
"""Base parameters that an effect covers under its own name."""
FORM_OF = {
    "presliding_friction": "coulomb_friction",
    "coupled_inertia": "load_inertia",
    "shear_thinning_drag": "nonlinear_drag",
    "bouc_wen_hysteresis": "hysteresis",
}
"""Effects of the library that are a form of one that is hidden."""
PARAMETER = "parameter"


def one_name(name: str, port: str) -> str:
    """Return the name that stands for a candidate of a name at a port."""
    return SAME.get(port, name) if name == PARAMETER else FORM_OF.get(name, name)


def to_be_named(case: Case) -> frozenset[str]:
    """Return the names of all that a case hides and that the workflow could name."""
    if case.kind == "unlisted":
        return frozenset()
    out = {PARAMETER} if case.stress in OUT_OF_TOLERANCE else set()
    return frozenset({*case.names, *out})


def may_be_named(case: Case) -> frozenset[str]:
    """Return the names that are not wrong: what is hidden, and what that contains."""
    contained = {name for effect in case.drawn for name in effect.components}
    if case.stress == "parameters":
        # All base parameters are far off, those with names of their own among them.
        contained |= set(SAME.values())
    return to_be_named(case) | contained
