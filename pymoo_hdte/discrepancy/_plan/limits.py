"""What a rig allows, and which effects a campaign on it is to find: the file of limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.toml import toml_with_lines
from pymoo_hdte.checks import InvalidInput, one_of, real_number, whole_number
from pymoo_hdte.discrepancy._records.believed import BelievedDrive, Rig
from pymoo_hdte.discrepancy._records.believed_model import believed_of_model, tolerances_of_fields
from pymoo_hdte.discrepancy._records.campaign_files import rig_from_fields
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS
from pymoo_hdte.drive import DriveEffect, DriveModel
from pymoo_hdte.drive._effects import effect_from_fields
from pymoo_hdte.units import REVOLUTION_PER_MINUTE

DIRECTIONS = ("forward", "reverse")


@dataclass(frozen=True)
class PlanLimits:
    """What can be tested, and which effects are to be found.

    Attributes
    ----------
    rig : Rig
        Speed loop and noise of the sensors.
    speeds : tuple of float, any length n
        Input speeds, rad/s, above zero.
    loads : tuple of float, any length n
        Load torques at the output, N.m. Positive ones brake the motion, negative ones drive it, in
        either direction.
    sample_rate : float
        Sample rate of the raw samples, Hz.
    most_records : int
        Largest number of tests of the plan: those to be fitted, with sweeps, and those held out.
    directions : tuple of str
        Directions of motion, of `DIRECTIONS`.
    sweeps : tuple of float, any length n
        Largest torques of possible torsion sweeps, N.m.
    output_turns : int
        Length of a running record.
    session : float
        Time from the first record to the last, s; at zero no drift can be found.
    channels : tuple of str
        Measured channels, of `CHANNELS`.
    held_out : int
        Number of running records that are kept out of the fit to validate its result.
    power : float
        Wanted probability to detect an effect, and to separate it from each other one.
    share : float
        Size of the effects that are not in ``effects``: the share of the largest wind-up and
        torques that a fit without them leaves unexplained.
    effects : tuple of DriveEffect
        Effects to be found, at the size that matters; by default all that the package knows.
    tolerance, error_tolerance, tolerances
        Relative half-widths of the nominal values, as in `BelievedDrive`.

    Raises
    ------
    InvalidInput
        For a value out of range, an empty list, or a number given twice.

    Examples
    --------
    >>> limits = read_limits("bench.toml")
    >>> limits.loads, limits.most_records
    ((0.0, 20.0, 40.0), 16)
    """

    rig: Rig
    speeds: tuple[float, ...]
    loads: tuple[float, ...]
    sample_rate: float
    most_records: int
    directions: tuple[str, ...] = DIRECTIONS[:1]
    sweeps: tuple[float, ...] = ()
    output_turns: int = 1
    session: float = 0.0
    channels: tuple[str, ...] = CHANNELS
    held_out: int = 2
    power: float = 0.9
    share: float = 0.01
    effects: tuple[DriveEffect, ...] = ()
    tolerance: float = 0.1
    error_tolerance: float = 0.3
    tolerances: Mapping[str, float] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        for name in ("speeds", "loads", "directions", "sweeps", "channels"):
            listed = getattr(self, name)
            if len(set(listed)) != len(listed) or not (listed or name == "sweeps"):
                raise InvalidInput(name, listed, "at least one, each once")
        for name, words in (("directions", DIRECTIONS), ("channels", CHANNELS)):
            for word in getattr(self, name):
                one_of(name, word, words)
        for name in ("speeds", "sweeps"):
            for number in getattr(self, name):
                real_number(name, number, above=0.0)
        for load in self.loads:
            real_number("loads", load)
        real_number("sample_rate", self.sample_rate, above=0.0)
        whole_number("output_turns", self.output_turns, 1)
        real_number("session", self.session, at_least=0.0)
        whole_number("held_out", self.held_out, 0)
        whole_number("most_records", self.most_records, self.held_out + 1)
        real_number("power", self.power, at_least=0.5, below=1.0)
        real_number("share", self.share, above=0.0, below=1.0)

    def believed(self, model: DriveModel) -> BelievedDrive:
        """Return a drive model with these tolerances; errors are those of `believed_of_model`."""
        return believed_of_model(model, self.tolerance, self.error_tolerance, self.tolerances)


def read_limits(path: str | Path) -> PlanLimits:
    """Read a file of limits.

    Parameters
    ----------
    path : str or Path
        TOML, as ``docs/command_line.md`` describes it.

    Returns
    -------
    PlanLimits
        Limits in SI units.

    Raises
    ------
    InvalidInput
        If a field is missing, unknown or impossible; the message names file and line.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> read_limits("bench.toml").power
    0.9
    """
    path = Path(path)
    with toml_with_lines(path) as top:
        rig = rig_from_fields(top.table("rig"), f"{path.name}.rig")
        rows = top.tables("effect") if top.has("effect") else []
        effects = tuple(effect_from_fields(row) for row in rows)
        tolerance, error_tolerance, tolerances = tolerances_of_fields(top)
        given = _given(top)
        top.finish()
        try:
            return PlanLimits(
                rig=rig,
                effects=effects,
                tolerance=tolerance,
                error_tolerance=error_tolerance,
                tolerances=tolerances,
                **given,
            )
        except InvalidInput as error:
            key, factor = _KEYS.get(error.field, (error.field, 1.0))
            value = error.value / factor if isinstance(error.value, float) else error.value
            raise InvalidInput(f"{path.name}.{key}", value, error.allowed) from None


_KEYS = {
    "speeds": ("input_speeds_rpm", REVOLUTION_PER_MINUTE),
    "loads": ("load_torques_Nm", 1.0),
    "sweeps": ("torsion_sweeps_Nm", 1.0),
    "sample_rate": ("sample_rate_Hz", 1.0),
    "session": ("session_s", 1.0),
    "power": ("power", 1.0),
    "share": ("unexplained_share", 1.0),
    "most_records": ("most_records", 1.0),
    "held_out": ("held_out_records", 1.0),
    "output_turns": ("output_turns", 1.0),
    "directions": ("directions", 1.0),
    "channels": ("channels", 1.0),
}
"""Key in the file, and factor to SI, of each attribute."""
_REQUIRED = ("speeds", "loads", "sample_rate", "most_records")


def _given(top: Fields) -> dict[str, Any]:
    """Return the attributes that the file gives, in SI."""
    attributes: dict[str, Any] = {}
    for name, (key, factor) in _KEYS.items():
        if name not in _REQUIRED and not top.has(key):
            continue
        if name in ("speeds", "loads", "sweeps"):
            attributes[name] = tuple(factor * number for number in top.numbers(key))
        elif name in ("directions", "channels"):
            attributes[name] = top.texts(key)
        elif name in ("most_records", "held_out", "output_turns"):
            attributes[name] = top.whole(key, at_least=0)
        else:
            attributes[name] = top.number(key)
    return attributes
