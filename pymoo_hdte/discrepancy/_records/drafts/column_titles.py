"""What the title of a column says: which quantity, in which unit, measured or wanted, and where."""

from __future__ import annotations

import re
from dataclasses import dataclass

from pymoo_hdte._io.layout import CHANNEL_UNITS, COUNTS, MEASURED
from pymoo_hdte.units import UNITS, usual_spelling

QUANTITIES = {
    "time": ("time", "timestamp", "stamp", "zeit", "sec", "seconds"),
    "acceleration": ("acceleration", "acc", "accel", "qdd", "ddq", "qddot", "beschleunigung"),
    "speed": (
        *("speed", "velocity", "vel", "rate", "omega", "rpm", "qd", "dq", "qdot"),
        *("drehzahl", "geschwindigkeit"),
    ),
    "temperature": ("temperature", "temp", "temperatur"),
    "torque": ("torque", "tau", "trq", "tq", "moment", "drehmoment", "effort"),
    "force": ("force", "kraft"),
    "voltage": ("voltage", "volt", "spannung"),
    "current": ("current", "cur", "curr", "iq", "amp", "strom"),
    "position": (
        *("position", "pos", "angle", "angles", "ang", "travel", "displacement", "encoder", "enc"),
        *("theta", "phi", "winkel", "weg", "lage", "stellung"),
    ),
}
"""Words for each quantity; where a title has words of two, the first in this order holds."""
_LETTERS = {
    **dict.fromkeys("qxys", "position"),
    **dict.fromkeys("vw", "speed"),
    **dict.fromkeys("Ii", "current"),
    **dict.fromkeys("UV", "voltage"),
    **{"t": "time", "F": "force"},
}
"""What a letter stands for most often; the data may say otherwise."""
_COMMANDS = (
    *("target", "desired", "des", "cmd", "command", "commanded", "ref", "reference", "set"),
    *("setpoint", "soll", "goal", "demand", "desire"),
)
_SIDES = {
    "input": ("motor", "mot", "input", "in", "rotor"),
    "output": ("load", "output", "out", "link", "brake", "abtrieb"),
}
_LONG = 4
"""Letters from which a word may also be a part of another one: motorinc, torquesensor."""
_GLUED = {
    "Nm": "N.m",
    "mNm": "mN.m",
    "Nmm": "N.mm",
    "radps": "rad/s",
    "rads": "rad/s",
    "rad_s": "rad/s",
    "degps": "deg/s",
    "deg_s": "deg/s",
    "mps": "m/s",
    "m_s": "m/s",
    "mm_s": "mm/s",
    "rad_s2": "rad/s2",
    "m_s2": "m/s2",
    "inc": COUNTS,
    "loadinc": COUNTS,
    "motorinc": COUNTS,
}
"""Units as they stand at the end of a title, where strokes and points are not allowed."""
_OF_UNITS = {
    "angle": "position",
    "length": "position",
    "linear speed": "speed",
    "linear acceleration": "acceleration",
}


@dataclass(frozen=True)
class TitleHint:
    """What a title says; nothing where it is empty.

    Attributes
    ----------
    quantity : str
        One of `QUANTITIES`, or empty.
    unit : str
        One of `CHANNEL_UNITS` or `COUNTS`, or empty.
    command : bool
        Whether it is what was wanted, not what was measured.
    side : {"input", "output", ""}
        Of a drive.
    number : str
        Of a joint: the last number in the title.
    weak : bool
        Whether the quantity is told by nothing but a letter.
    """

    quantity: str = ""
    unit: str = ""
    command: bool = False
    side: str = ""
    number: str = ""
    weak: bool = False


def read_title(title: str, unit: str = "") -> TitleHint:
    """Return what a title says.

    Parameters
    ----------
    title : str
    unit : str
        From a row of units, which counts for more than the title.

    Examples
    --------
    >>> read_title("target_pos_2 [deg]")
    TitleHint(quantity='position', unit='deg', command=True, side='', number='2', weak=False)
    """
    unit = _known(unit) or _unit_in(title)
    plain = re.sub(r"[\[(].*?[\])]", " ", title)
    split = re.sub(r"(?<=[a-z])(?=[A-Z0-9])", " ", plain)
    letters = re.findall(r"[^\W\d_]+", split)
    if unit and len(letters) > 1 and _unit_in(title) and not re.search(r"[\[(]", title):
        # The unit itself is no word for a quantity: the m of pos_m, the A of i_A.
        letters = letters[:-1]
    words = [word.lower() for word in letters]
    numbers = re.findall(r"\d+", plain)
    quantity = next((name for name, known in QUANTITIES.items() if _any(words, known)), "")
    quantity = quantity or quantity_of(unit)
    letter = next((_LETTERS[letter] for letter in letters if letter in _LETTERS), "")
    return TitleHint(
        quantity or letter,
        unit,
        _any(words, _COMMANDS),
        next((side for side, known in _SIDES.items() if _any(words, known)), ""),
        numbers[-1] if numbers else "",
        bool(letter) and not quantity,
    )


def quantity_of(unit: str) -> str:
    """Return which of `QUANTITIES` has a unit, empty where none or several have."""
    if unit == COUNTS:
        return "position"
    measured = next((kind for kind in MEASURED if unit in UNITS[kind]), "")
    quantity = _OF_UNITS.get(measured, measured)
    return quantity if quantity in QUANTITIES else ""


def _any(words: list[str], known: tuple[str, ...]) -> bool:
    return any(
        word == wanted or (len(wanted) >= _LONG and wanted in word)
        for word in words
        for wanted in known
    )


def _known(unit: str) -> str:
    spelt = usual_spelling(unit.strip().strip("[]() "))
    if spelt in (COUNTS, *CHANNEL_UNITS):
        # No number of a signal is a unit.
        return "" if spelt == "1" else spelt
    return _GLUED.get(unit.strip(), "")


def _unit_in(title: str) -> str:
    """Return the unit in brackets, or at the end of a title of several words."""
    for inside in re.findall(r"[\[(]([^\])]*)[\])]", title):
        if unit := _known(inside):
            return unit
    for parts in (2, 1):
        pieces = re.split(r"[_ ]", title.strip())
        # A title of one word is no unit: s, m, A and V are names of signals as well.
        if len(pieces) > parts and (unit := _known("_".join(pieces[-parts:]))):
            return unit
    glued = re.split(r"[_ ]", re.sub(r"_?\d+$", "", title.strip()))[-1]
    return _GLUED.get(glued, "") if "_" in title else ""
