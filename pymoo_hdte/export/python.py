"""A model as a Python file with its force balance and its acceleration, which needs numpy only."""

from __future__ import annotations

import textwrap

from pymoo_hdte.discrepancy import MechanismModel
from pymoo_hdte.export.equations import Equations, Symbol, equations
from pymoo_hdte.export.exported import Exported, head_lines
from pymoo_hdte.export.expressions import PYTHON

_OWN = (
    *("np", "position", "speed", "inputs", "states", "accelerations", "COORDINATES", "INPUTS"),
    *("STATES", "force", "acceleration", "residual", "rates"),
)
_FUNCTIONS = '''

def force(position, speed, inputs, states=None):
    """Return the force on each coordinate, without inertia.

    Position, speed, inputs and states (None: at rest) have one row for each name above.
    """
{unpacked}
{lines}
    return np.array(np.broadcast_arrays({forces}))


def acceleration(position, speed, inputs, states=None):
    """Return the acceleration of each coordinate."""
    return (force(position, speed, inputs, states).T / [{inertias}]).T


def residual(position, speed, accelerations, inputs, states=None):
    """Return the force balance of each coordinate, which is zero where the motion fits."""
    total = force(position, speed, inputs, states)
    return total - (np.asarray(accelerations, float).T * [{inertias}]).T


def rates(position, speed, states=None):
    """Return the derivative of each inner state."""
    inputs = np.zeros(len(INPUTS))
{unpacked}
{lines}
    return np.array([{rates}])
'''


def to_python(model: MechanismModel) -> Exported:
    """Return a mechanism as a Python file, which needs numpy only.

    Its functions ``force``, ``acceleration``, ``residual`` and ``rates`` (of inner states, for laws
    with memory) take positions, speeds and inputs, one row for each of its ``COORDINATES`` and
    ``INPUTS``, in SI.

    Parameters
    ----------
    model : MechanismModel
        For instance ``analysis.revised_model()``.

    Raises
    ------
    InvalidInput
        For a port that follows a measured angle, or a law whose formula cannot be written.

    Examples
    --------
    >>> from pymoo_hdte.discrepancy import MechanismModel
    >>> from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism
    >>> arm = Mechanism({"q": BelievedValue(0.5)}, [], [Input("torque", {"q": 1.0})])
    >>> space = {}
    >>> exec(to_python(MechanismModel("An arm", arm)).text, space)
    >>> print(space["acceleration"]([0.0], [0.0], [2.0]))
    [4.]
    """
    found = equations(model, PYTHON, _OWN)
    head = "\n".join(head_lines(model, found.notes)).replace("\\", "/").replace('"', "'")
    parts = [f'"""{head}\n"""\n\nimport numpy as np\n']
    for title, symbols in (
        ("COORDINATES", [one.words for one in found.coordinates]),
        ("INPUTS", [one.words for one in found.inputs]),
        ("STATES", [one.name for one, _ in found.rates]),
    ):
        parts.append(f"{title} = {tuple(symbols)!r}")
    parts.append("")
    parts += [f"{one.name} = {float(value)!r}{_comment(one)}" for one, value in found.parameters]
    parts.append("")
    return Exported("\n".join(parts) + _functions(found), found.notes)


def _functions(found: Equations) -> str:
    rows = [
        ("position", found.coordinates),
        ("speed", found.speeds),
        ("inputs", found.inputs),
        ("states", [one for one, _ in found.rates]),
    ]
    unpacked = ["states = np.zeros(len(STATES)) if states is None else states"]
    for title, symbols in rows:
        if symbols:
            names = ", ".join(one.name for one in symbols)
            unpacked.append(f"({names},) = np.asarray({title}, float)")
    lines = [f"{one.name} = {text}{_comment(one)}" for one, text in found.lines]
    return _FUNCTIONS.format(
        unpacked=textwrap.indent("\n".join(unpacked), "    "),
        lines=textwrap.indent("\n".join(lines), "    "),
        forces=", ".join(found.forces),
        inertias=", ".join(found.inertias),
        rates=", ".join(text for _, text in found.rates),
    )


def _comment(symbol: Symbol) -> str:
    return "" if symbol.unit == "SI" else f"  # {symbol.unit}"
