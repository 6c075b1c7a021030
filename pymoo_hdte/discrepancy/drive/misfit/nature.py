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

from pymoo_hdte.discrepancy.campaign.believed import BelievedDrive
from pymoo_hdte.discrepancy.campaign.line_fit import CHANNELS
from pymoo_hdte.discrepancy.campaign.residual_spectrum import residual_spectrum
from pymoo_hdte.discrepancy.drive.evidence import Data
from pymoo_hdte.discrepancy.drive.misfit.map import Location
from pymoo_hdte.discrepancy.engine.rules import Rules

Values = NDArray[np.float64]


def sizes(location: Location) -> Values:
    """Return the flagged cells in standard deviations, zero elsewhere.

    Not as chi-square, which a single cell of a sensor with little noise would dominate.
    """
    size = np.maximum(np.nan_to_num(location.chi_square), np.nan_to_num(location.moved))
    return np.where(location.flagged, np.sqrt(size), 0.0)


def growth(power: Values, condition: Values) -> float | None:
    """Return the ratio of amplitudes in the upper half of a condition to the lower, or None.

    None stands for a condition that was not varied.
    """
    condition = np.abs(condition)
    upper = condition > (condition.min() + condition.max()) / 2.0
    if upper.all() or not upper.any() or np.ptp(condition) < 0.05 * condition.max():
        return None
    return float(np.sqrt(power[upper].mean() / max(power[~upper].mean(), 1e-300)))


def changes(ratio: float | None, name: str, rules: Rules) -> str:
    """Return in words how a misfit changes with a condition."""
    if ratio is None:
        return f"was seen at one {name} only"
    if ratio > rules.growth_ratio:
        return f"grows with {name}" + (f" ({ratio:.2g}-fold)" if ratio < 100.0 else "")
    if ratio < 1.0 / rules.growth_ratio:
        return f"falls with {name}" + (f" ({1.0 / ratio:.2g}-fold)" if ratio > 0.01 else "")
    return f"hardly changes with {name}"


def nature_of_misfit(location: Location, believed: BelievedDrive) -> str:
    """Return in words what kind of misfit it is."""
    rules, speed = location.rules, np.abs(location.speed_rpm)
    slow = speed <= np.median(speed)
    size = sizes(location)[:, :3].sum(axis=(1, 2))
    if size[slow].sum() <= rules.slow_share * size.sum():
        return "It shows at speed only, as a torque of inertia or damping does"
    misfit = np.where(location.flagged, np.nan_to_num(location.misfit), 0.0)[slow]
    # Torques divided by the stiffness, to compare them with the torsion.
    error = misfit[:, 0]
    from_input = misfit[:, 1] * believed.ratio / believed.stiffness
    from_output = misfit[:, 2] / believed.stiffness
    if _power(error) <= rules.caused_share * max(_power(from_input), _power(from_output)):
        return _torque(from_input, from_output, rules)
    seen = location.flagged[slow, 0]
    if _power((error - from_output)[seen]) <= rules.caused_share * _power(error):
        return _torque(from_input, from_output, rules)
    if _power((error - from_input)[seen]) <= rules.caused_share * _power(error):
        return "It is torque-like and acts on the output of the drive: the input has to supply it"
    if location.sweep_flagged:
        return "It is in the torsion: the sweep with the input locked shows it, too"
    ratio = growth(np.sum(np.abs(error) ** 2, axis=1), location.load_torque[slow])
    if ratio is not None and ratio > rules.growth_ratio:
        return "It is a compliance: the torsion under load is not what the stiffness says"
    return "It is kinematic: no torque goes with it, as for an error of teeth or encoders"


def _torque(
    from_input: NDArray[np.complex128], from_output: NDArray[np.complex128], rules: Rules
) -> str:
    """Return the words for a torque, with the side on which it acts.

    A torque on the output is transmitted through the drive and shows on both sides.
    """
    if _power(from_output) < rules.caused_share * _power(from_input):
        return "It is torque-like and acts on the input: the output torque hardly shows it"
    return "It is torque-like and comes from the load: the torsion merely follows it"


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
        orders, amplitudes = residual_spectrum(record, rig, ratio, known, rules.highest_order)
        power = amplitudes**2
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
        if enough and np.ptp(speeds[same]) > 0.1 * speeds[same].max():
            return float(np.median(frequencies[same]))
    return None
