"""What kind of misfit it is: of a torque, a compliance or the kinematics.

At low speed, where inertia is small, the torsion is the torque over the stiffness. A misfit of the
transmission error that follows the measured torques is therefore caused by them, and one that does
not arises in the mesh or in an encoder.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._answers.where.map import Flags, Location
from pymoo_hdte.discrepancy._answers.where.trend import strongest, trends
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._evidence.order_lines.features import shown_order
from pymoo_hdte.discrepancy._records.believed import BelievedDrive
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS
from pymoo_hdte.discrepancy._records.residual_spectrum import residual_spectrum
from pymoo_hdte.discrepancy._selection.rules import Rules

Values = NDArray[np.float64]


def sizes(location: Location) -> Values:
    """Return the flagged cells in standard deviations, zero elsewhere.

    Not as chi-square, which a single cell of a sensor with little noise would dominate.
    """
    size = np.maximum(np.nan_to_num(location.chi_square), np.nan_to_num(location.moved))
    return np.where(location.flagged, np.sqrt(size), 0.0)


@dataclass(frozen=True)
class Nature:
    """What kind of misfit it is.

    Attributes
    ----------
    code : str
        A key of `SENTENCES`.
    slow : bool
        Whether the lower speeds show it, and the higher ones were not asked.
    """

    code: str
    slow: bool = False

    @property
    def sentence(self) -> str:
        """In words, without a full stop."""
        words = SENTENCES[self.code]
        return f"At the lower speeds {words[0].lower()}{words[1:]}" if self.slow else words


IN_SWEEP = "in_sweep"
"""What the torsion sweep shows, too."""
SENTENCES = {
    "at_speed": "It shows at speed only, as a torque of inertia or damping does",
    "input_torque": "It is torque-like and acts on the input: the torsion behind it hardly shows "
    "it",
    "output_torque_alone": "It is in the output torque alone: neither the torsion nor the input "
    "follows it",
    "both_torques": "It is in both torques, but the torsion hardly follows them",
    "load_torque": "It is torque-like and comes from the load: the torsion merely follows it",
    "drive_output": "It is torque-like and acts on the output of the drive: the input has to "
    "supply it",
    IN_SWEEP: "It is in the torsion: the sweep with the input locked shows it, too",
    "compliance": "It is a compliance: the torsion under load is not what the stiffness says",
    "mesh": "It is in the mesh: no torque goes with it, and the load makes it smaller",
    "kinematic": "It is kinematic: no torque goes with it, as for an error of teeth or encoders",
    "no_torque": "No torque goes with it: it is kinematic, as an error of teeth or encoders, or a "
    "compliance, if it should grow with load, which these records do not tell",
}
_WITHOUT_TORQUE = {
    "grows": "compliance",
    "turns": "compliance",
    "falls": "mesh",
    "steady": "kinematic",
    "unknown": "no_torque",
}
"""By the change of the transmission error with the load."""


def nature_of_misfit(location: Location, believed: BelievedDrive) -> Nature:
    """Return what kind of misfit it is, at the lower speeds where these show it."""
    rules, speed = location.rules, np.abs(location.speed_rpm)
    slow = speed <= np.median(speed)
    size = sizes(location)[:, :3].sum(axis=(1, 2))
    if size[slow].sum() <= rules.slow_share * size.sum():
        if _kind(location, range(3), "speed") == "grows":
            return Nature("at_speed")
        # No more than some records have it, which happen to be fast ones.
        slow = np.ones_like(slow)
    return Nature(_of_records(location, believed, slow), slow=not slow.all())


def _of_records(location: Location, believed: BelievedDrive, slow: Flags) -> str:
    """Return the code of the misfit of some records, in which inertia is small."""
    rules = location.rules
    flagged = np.where(location.flagged, np.nan_to_num(location.misfit), 0.0)
    misfit = np.asarray(flagged[slow], dtype=np.complex128)
    # Torques divided by the stiffness, to compare them with the torsion.
    error = misfit[:, 0]
    from_input = misfit[:, 1] * believed.ratio / believed.stiffness
    from_output = misfit[:, 2] / believed.stiffness
    if _power(error) <= rules.caused_share * max(_power(from_input), _power(from_output)):
        return _torque_alone(from_input, from_output, rules)
    seen = location.flagged[slow, 0]
    if _power((error - from_output)[seen]) <= rules.caused_share * _power(error):
        return _torque_with_torsion(from_input, from_output, rules)
    if _power((error - from_input)[seen]) <= rules.caused_share * _power(error):
        return "drive_output"
    if location.sweep_flagged:
        return IN_SWEEP
    kind = _kind(location, [0], "load", slow)
    # Fast records are near resonances, but more records may say what the slow ones leave open.
    return _WITHOUT_TORQUE[_kind(location, [0], "load") if kind == "unknown" else kind]


def _kind(
    location: Location, channels: Sequence[int], name: str, records: Flags | None = None
) -> str:
    """Return how the strongest misfit of some channels changes with ``speed`` or ``load``."""
    channel, order = strongest(sizes(location).sum(axis=0), channels)
    records = np.ones(len(location.records), dtype=bool) if records is None else records
    misfit, noise = (
        location.misfit[records, channel, order],
        location.noise[records, channel, order],
    )
    conditions = location.speed_rpm[records], location.load_torque[records]
    trend = trends(misfit, noise, *conditions, location.rules).get(name)
    return "unknown" if trend is None else trend.kind


def _torque_alone(
    from_input: NDArray[np.complex128], from_output: NDArray[np.complex128], rules: Rules
) -> str:
    """Return the code of a misfit of torques that the torsion hardly shows."""
    if _power(from_output) < rules.caused_share * _power(from_input):
        return "input_torque"
    if _power(from_input) < rules.caused_share * _power(from_output):
        return "output_torque_alone"
    return "both_torques"


def _torque_with_torsion(
    from_input: NDArray[np.complex128], from_output: NDArray[np.complex128], rules: Rules
) -> str:
    """Return the code of a misfit of the output torque that the torsion follows.

    A torque on the output is transmitted through the drive and shows on both sides.
    """
    if _power(from_output) < rules.caused_share * _power(from_input):
        return "input_torque"
    return "load_torque"


def _power(lines: NDArray[np.complex128]) -> float:
    return float(np.sum(np.abs(lines) ** 2))


@dataclass(frozen=True)
class StrayLines:
    """Lines that do not belong to an order.

    Attributes
    ----------
    frequency : float or None
        Hz, of a line that is common to records at several speeds.
    broad : tuple of str
        Channels in which the power is spread over many neighbouring lines.
    """

    frequency: float | None = None
    broad: tuple[str, ...] = ()


def stray_lines(data: Data, unexpected: Sequence[float]) -> StrayLines:
    """Return the lines of a campaign that do not belong to an order.

    Parameters
    ----------
    data : Data
    unexpected : sequence of float
        Orders of the features that were added because records have significant lines at them.
    """
    if not unexpected:
        return StrayLines()
    ratio, rig, features = data.campaign.believed.ratio, data.campaign.rig, data.features
    rules = data.rules
    known = [order for order in features.orders if np.abs(order - unexpected).min() > 1e-6]
    speeds = np.abs(features.conditions.input_speed)
    peaks, widths = [], []
    for record, speed in zip(features.records, speeds, strict=True):
        shown = [order for order in known if order <= shown_order(record, rules)]
        orders, amplitudes = residual_spectrum(record, rig, ratio, shown, rules.highest_order)
        power = amplitudes[: len(CHANNELS)] ** 2
        power[power < np.log(power.size * len(speeds) / rules.unexpected_line_chance)] = 0.0
        widths.append(_lines_in_effect(power))
        if power.any():
            strongest = int(np.argmax(power.max(axis=0)))
            peaks.append((orders[strongest] * speed / (2.0 * np.pi), speed))
    broad = np.median(widths, axis=0) > rules.broad_band_lines
    names = tuple(name for name, wide in zip(CHANNELS, broad, strict=True) if wide)
    return StrayLines(None if names else _shared(np.array(peaks).reshape(-1, 2), rules), names)


def _lines_in_effect(power: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the effective number of lines of each channel's power (4, k): (sum p)^2 / sum p^2."""
    square = np.maximum(np.sum(power**2, axis=1), np.finfo(float).tiny)
    return np.asarray(np.sum(power, axis=1) ** 2 / square)


def _shared(peaks: NDArray[np.float64], rules: Rules) -> float | None:
    """Return the frequency common to peaks (k, 2) of (Hz, speed) at many speeds, or None."""
    frequencies, speeds = peaks.T
    for frequency in frequencies:
        same = np.abs(frequencies / frequency - 1.0) < rules.fixed_frequency_width
        enough = same.sum() >= rules.fixed_frequency_records
        if enough and np.ptp(speeds[same]) > rules.fixed_frequency_range * speeds[same].max():
            return float(np.median(frequencies[same]))
    return None
