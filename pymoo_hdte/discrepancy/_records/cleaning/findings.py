"""What the rows of a campaign showed: faulty rows, and noise other than stated."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

UNITS = {
    "time": "s",
    "input_angle": "rad",
    "output_angle": "rad",
    "input_torque": "N.m",
    "output_torque": "N.m",
    "rows": "s",
}
"""Unit of the size of a fault by its channel."""

FAILED = ("stuck", "saturated")
"""Kinds of faults in which a channel does not read what it measures; their size is a reading."""


@dataclass(frozen=True)
class RowFault:
    """A fault in the rows of one record.

    Attributes
    ----------
    record : str
        Name of the record.
    kind : str
        ``"spike"``, ``"jump"``, ``"gap"``, ``"repeated"``, ``"stuck"``, ``"saturated"``,
        ``"drift"``, ``"new zero"`` or ``"settling"``. In this order: one to a few rows that depart
        from both sides; a constant offset from a row on; rows that are missing; rows that repeat
        the previous one; rows in which one channel does not change, though it does elsewhere; rows
        at the end of a channel's range; a torque that rises on a straight line while the other one
        does not; a constant offset of this record, or from it on; a decay at the first rows.
    channel : str
        ``"input_angle"``, ``"output_angle"``, ``"input_torque"``, ``"output_torque"``; ``"time"``
        where both encoders agree that the time of the rows is wrong; ``"rows"`` for all of them,
        and for a decay that other records show and the noise of this one hides.
    row : int
        First row concerned, counted from 0 in the file.
    rows : int
        Number of rows: for a gap, those missing; for a jump, all to the end of the record; for a
        new zero, to the end of the session; for a decay, three time constants.
    size : float
        Largest departure, the offset, the reading that does not change, or the length of a gap or
        of a hidden decay, in `UNITS` of the channel.
    treatment : {"left out", "modelled", "none needed"}
        What became of the rows; all faults of a record that is left out are ``"left out"``.
    """

    record: str
    kind: str
    channel: str
    row: int
    rows: int
    size: float
    treatment: str

    def as_dict(self) -> dict[str, Any]:
        """Return plain values, with the row counted from 1 below any header and the size's unit."""
        return asdict(self) | {"row": self.row + 1, "unit": UNITS[self.channel]}


@dataclass(frozen=True)
class NoiseFinding:
    """A stated noise beside what the records show.

    Attributes
    ----------
    name : str
        Field of `Rig`.
    stated : float
        rad or N.m, of one raw sample.
    found : float or None
        Its value in the records, in the same unit; None where they do not show it.
    used : float
        Value that enters the covariance: ``found`` where it differs significantly and by more than
        `Rules.noise_mismatch`, otherwise ``stated``.
    reason : str
        How it was found, or why it was not.
    step : float
        Step in which a channel is read, rad or N.m, where it hides the stated noise; else 0.
    """

    name: str
    stated: float
    found: float | None
    used: float
    reason: str
    step: float = 0.0

    @property
    def replaced(self) -> bool:
        """Whether the stated value was replaced."""
        return self.used != self.stated

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return "N.m" if "torque" in self.name else "rad"

    def as_dict(self) -> dict[str, Any]:
        """Return plain values with their unit."""
        return asdict(self) | {"unit": self.unit, "replaced": self.replaced}


@dataclass(frozen=True)
class RowFindings:
    """What the rows of a campaign showed.

    Attributes
    ----------
    n_rows : int
        Rows of all records.
    faults : tuple of RowFault
    left_out : tuple of str
        Records that cannot be repaired.
    noise : tuple of NoiseFinding
    """

    n_rows: int = 0
    faults: tuple[RowFault, ...] = ()
    left_out: tuple[str, ...] = ()
    noise: tuple[NoiseFinding, ...] = ()

    @property
    def rows_left_out(self) -> int:
        """Number of rows that were left out of records that were kept."""
        return sum(
            fault.rows
            for fault in self.faults
            if fault.treatment == "left out" and fault.record not in self.left_out
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the entries ``rows`` and ``noise`` of the verdict as plain values."""
        rows = {
            "examined": self.n_rows,
            "left_out": self.rows_left_out,
            "records_left_out": list(self.left_out),
            "faults": [fault.as_dict() for fault in self.faults],
        }
        return {"rows": rows, "noise": [finding.as_dict() for finding in self.noise]}
