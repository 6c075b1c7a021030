"""A campaign: records of one rig in one session, with what is believed about it."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import InitVar, dataclass, replace

from pymoo_hdte.checks import Complaints, InvalidInput, real_number
from pymoo_hdte.discrepancy._records.believed import MECHANICAL, BelievedDrive, Rig
from pymoo_hdte.discrepancy._records.believed_model import believed_of_model
from pymoo_hdte.discrepancy._records.known_values import known_values
from pymoo_hdte.discrepancy._records.plausibility import (
    check_believed,
    check_noise,
    check_running,
    check_stiffness,
    check_torsion,
)
from pymoo_hdte.discrepancy._records.records import RunningRecord, TorsionRecord
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.drive import DriveModel

__all__ = ["BelievedDrive", "Campaign", "Rig", "RunningRecord", "TorsionRecord"]


@dataclass(frozen=True, eq=False)
class Campaign:
    """Running and torsion records of one rig.

    Attributes
    ----------
    title, drive : str
        One line of printable text each.
    believed : BelievedDrive
        Drive and load, as believed before the analysis.
    rig : Rig
        Speed loop and sensors.
    running : tuple of RunningRecord
        At least one.
    torsion : tuple of TorsionRecord
        May be empty.
    rules : Rules
        Thresholds for refusing records. They are used for the checks and not kept: pass them to
        ``dataclasses.replace`` again.
    good_enough_error, good_enough_torque : float or None
        Changes of the transmission error, rad, and of torques, N.m, below which an effect is
        reported as real and irrelevant.

    Raises
    ------
    InvalidInput
        For no running record, a name used twice, the same measurement under two names, a
        ``good_enough`` size that is not above zero, values that no drive can have, or a record that
        contradicts them or the stated noise (see `plausibility`).

    Examples
    --------
    >>> campaign = read_campaign("campaign")
    >>> len(campaign.train), len(campaign.held_out)
    (2, 1)
    """

    title: str
    drive: str
    believed: BelievedDrive
    rig: Rig
    running: tuple[RunningRecord, ...]
    torsion: tuple[TorsionRecord, ...]
    rules: InitVar[Rules] = RULES
    good_enough_error: float | None = None
    good_enough_torque: float | None = None

    def __post_init__(self, rules: Rules) -> None:
        for field in ("title", "drive"):
            text = getattr(self, field)
            if not isinstance(text, str) or not text.strip() or not text.isprintable():
                raise InvalidInput(field, text, "one line of printable text")
        for field in ("good_enough_error", "good_enough_torque"):
            if (size := getattr(self, field)) is not None:
                real_number(field, size, above=0.0)
        if not self.running:
            raise InvalidInput("running records", 0, "at least one")
        self._check_duplicates()
        largest_load = max(abs(record.load_torque) for record in self.running)
        complaints = Complaints()
        with complaints.noted():
            try:
                check_believed(self.believed, rules)
            except InvalidInput:
                # An inertia that seems too heavy may hang on a stiffness that is too small.
                check_stiffness(self.believed, largest_load, rules)
                raise
        for record in self.running:
            with complaints.noted(), _errors_name_record(record.name):
                check_running(record, self.believed, self.rig, largest_load, rules)
        for sweep in self.torsion:
            with complaints.noted(), _errors_name_record(sweep.name):
                check_torsion(sweep, self.believed, rules)
        # The checks below would only report the same faults in other words.
        complaints.finish()
        check_stiffness(self.believed, largest_load, rules)
        check_noise(self.running, self.torsion, self.believed, self.rig, rules)

    def believing(self, model: DriveModel) -> Campaign:
        """Return the same records with a drive model as the believed model.

        Its values keep the tolerances of this campaign; its effects keep their values.

        Parameters
        ----------
        model : DriveModel
            For instance `DriveAnalysis.revised_model`, or from `read_drive_model`.

        Raises
        ------
        InvalidInput
            If the model contradicts the records.

        Examples
        --------
        >>> again = analyse(campaign.believing(analysis.revised_model()))
        >>> again.verdict.status
        'adequate'
        """
        old = self.believed
        known = (*MECHANICAL, *known_values(model.effects))
        tolerances = {
            name: tolerance for name, tolerance in old.tolerances.items() if name in known
        }
        believed = believed_of_model(model, old.tolerance, old.error_tolerance, tolerances)
        return replace(self, believed=believed)

    @property
    def train(self) -> tuple[RunningRecord, ...]:
        """Running records to fit; may be empty."""
        return tuple(record for record in self.running if record.role == "train")

    @property
    def held_out(self) -> tuple[RunningRecord, ...]:
        """Running records that validate the result at new conditions; may be empty."""
        return tuple(record for record in self.running if record.role == "held_out")

    @property
    def torque_scale(self) -> float:
        """Torques relative to those that the library of effects is sized for, dimensionless.

        See `campaign.torque_scale`.
        """
        return torque_scale([record.load_torque for record in self.running], self.believed)

    def _check_duplicates(self) -> None:
        names: set[str] = set()
        measurements: dict[bytes, str] = {}
        records: list[RunningRecord | TorsionRecord] = [*self.running, *self.torsion]
        for record in records:
            if record.name in names:
                raise InvalidInput("name of a record", record.name, "each name once")
            names.add(record.name)
            # A copy of a training record among the held-out ones would confirm any fit to it.
            digest = hashlib.sha256(record.output_angle.tobytes()).digest()
            twin = measurements.setdefault(digest, record.name)
            if twin != record.name:
                allowed = f"each measurement once; it repeats {twin}"
                raise InvalidInput("record", record.name, allowed)


@contextmanager
def _errors_name_record(name: str) -> Iterator[None]:
    try:
        yield
    except InvalidInput as error:
        raise InvalidInput(f"{name}: {error.field}", error.value, error.allowed) from None


RATED_TORQUE = 40.0
"""Output torque of the drive that the effects are sized for, N.m."""


RATED_STIFFNESS = 2.583e4
"""Mesh stiffness of that drive, N.m/rad."""


def torque_scale(loads: Sequence[float], believed: BelievedDrive) -> float:
    """Return the size of a drive in torque: 1 for rigs near `RATED_TORQUE`, a power of two.

    The load counts, or the load expected from the stiffness where that is larger: a drive tested
    with light loads has the friction of its size all the same. A power of two is exact enough, and
    multiplying by it does not round.

    Parameters
    ----------
    loads : sequence of float
        Loads of the running records, N.m.
    believed : BelievedDrive
        Gives the stiffness.
    """
    largest = max(abs(load) for load in loads)
    size = max(largest / RATED_TORQUE, believed.stiffness / RATED_STIFFNESS)
    return 2.0 ** round(math.log2(size))
