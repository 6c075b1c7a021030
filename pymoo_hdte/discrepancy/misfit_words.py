"""Sentences on a map of misfit: channels, orders, growth with speed and load, and its nature."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pymoo_hdte.discrepancy.fit import Data
from pymoo_hdte.discrepancy.misfit_map import Location, Values
from pymoo_hdte.discrepancy.order_lines import CHANNELS, residual_spectrum

_WORDS = {name: name.replace("_", " ") for name in CHANNELS}
_SHOWN = 4
"""Most orders that a sentence lists."""
_MINOR = 0.05
"""Share of the misfit below which a channel is not mentioned."""
_GROWTH = 2.0
"""Ratio of amplitudes between the upper and lower half of the conditions that counts as growth."""
_FALSE_LINES = 1e-3
"""Chance that noise alone shows a line beyond the map in a whole campaign."""
_SAME_FREQUENCY = 0.02
_FEWEST = 3
"""Records that must share a frequency before it is called fixed."""


def sentences(location: Location, data: Data, unexpected: Sequence[float]) -> tuple[str, str]:
    """Return where the misfit lives, and where the model may be trusted as it is.

    Parameters
    ----------
    location : Location
    data : Data
        For lines beyond those of the map.
    unexpected : sequence of float
        Orders beyond the expected ones at which records show more than noise.
    """
    count = int(location.flagged.sum())
    parts = [f"Measurement and model disagree in {count} of {location.cells} cells"]
    if count:
        parts[0] += f": {_channels(location)}; {_orders(location)}."
        parts.append(f"{_growth(location)}; {_nature(location)}.")
    elif location.named:
        parts[0] = "The named effect moves no cell by more than its noise."
    else:
        parts[0] = "No cell disagrees with the model by more than its noise."
    if location.sweep_flagged:
        parts.append("The torsion sweep disagrees with the model.")
    frequency = fixed_frequency(data) if unexpected else None
    if frequency is not None:
        parts.append(f"There is a vibration at a fixed frequency of {frequency:.3g} Hz.")
    elif unexpected:
        orders = ", ".join(f"{order:.4g}" for order in unexpected[:_SHOWN])
        parts.append(f"Lines that the model does not hold stand at order {orders}.")
    return " ".join(parts), _trusted(location)


def _sizes(location: Location) -> Values:
    """Return the flagged cells in standard deviations, zero elsewhere.

    Not as chi-square, of which a single cell of a quiet sensor would make up nearly all.
    """
    size = np.maximum(np.nan_to_num(location.chi_square), np.nan_to_num(location.moved))
    return np.where(location.flagged, np.sqrt(size), 0.0)


def _channels(location: Location) -> str:
    size = _sizes(location).sum(axis=(0, 2))
    share = size / size.sum()
    found = [
        f"{_WORDS[CHANNELS[place]]} ({share[place]:.0%} of the misfit)"
        for place in np.argsort(-share)
        if share[place] >= _MINOR
    ]
    return ", ".join(found)


def _orders(location: Location) -> str:
    size = _sizes(location).sum(axis=(0, 1))
    ranked = [place for place in np.argsort(-size)[:_SHOWN] if size[place] > 0.0]
    names = [
        "the mean" if place == 0 else f"order {location.orders[place]:.4g}" for place in ranked
    ]
    return "strongest at " + ", ".join(names)


def _growth(location: Location) -> str:
    """Return how the strongest line changes with speed and load."""
    total = _sizes(location).sum(axis=0)
    channel, order = np.unravel_index(int(np.argmax(total)), total.shape)
    chi_square = location.chi_square[:, channel, order]
    freedom = 1.0 if order == 0 else 2.0
    # What noise adds to the square of an amplitude, on average, is taken off.
    real = np.clip(1.0 - freedom / np.maximum(chi_square, 1e-12), 0.0, 1.0)
    power = np.abs(location.misfit[:, channel, order]) ** 2 * real
    words = [
        _change(power, np.abs(condition), name)
        for condition, name in ((location.speed_rpm, "speed"), (location.load_torque, "load"))
    ]
    line = "the mean" if order == 0 else f"order {location.orders[order]:.4g}"
    return f"The misfit of the {_WORDS[CHANNELS[channel]]}, {line}, " + " and ".join(words)


def _change(power: Values, condition: Values, name: str) -> str:
    middle = (condition.min() + condition.max()) / 2.0
    upper = condition > middle
    if upper.all() or not upper.any() or np.ptp(condition) < 0.05 * condition.max():
        return f"was seen at one {name} only"
    ratio = float(np.sqrt(power[upper].mean() / max(power[~upper].mean(), 1e-300)))
    if ratio > _GROWTH:
        return f"grows with {name}" + (f" ({ratio:.2g} fold)" if ratio < 100.0 else "")
    if ratio < 1.0 / _GROWTH:
        return f"falls with {name}" + (f" ({1.0 / ratio:.2g} fold)" if ratio > 0.01 else "")
    return f"hardly changes with {name}"


def _nature(location: Location) -> str:
    """Return kinematic, compliance or torque-like, from the slower half of the records.

    There inertia is small: an error of the kinematics stands in the transmission error alone, and
    a torque shows in the torques.
    """
    speed = np.abs(location.speed_rpm)
    slow = speed <= np.median(speed)
    size = _sizes(location)[slow].sum(axis=(0, 2))
    error, torque = size[0], size[1] + size[2]
    if error + torque == 0.0:
        return "it shows at speed only, as a torque of inertia or drag does"
    if torque > 3.0 * error:
        return "it is torque-like: at low speed it stands in the torques"
    if location.sweep_flagged:
        return "it is in the torsion: the sweep with the input locked shows it, too"
    te = np.abs(np.where(location.flagged[slow, 0], location.misfit[slow, 0], 0.0)) ** 2
    load = np.abs(location.load_torque[slow])
    if "grows" in _change(np.nansum(te, axis=1), load, "load"):
        return "it is a compliance: at low speed the transmission error moves with the load"
    if error > 3.0 * torque:
        return "it is kinematic: at low speed it stands in the transmission error alone"
    return "at low speed it stands in transmission error and torques alike"


def _trusted(location: Location) -> str:
    """Return channels, orders and records in which nothing is flagged."""
    flagged = location.flagged
    if not flagged.any():
        return "The model may be trusted as it is wherever it was measured."
    channels = [_WORDS[CHANNELS[k]] for k in range(len(CHANNELS)) if not flagged[:, k].any()]
    orders = [
        "the means" if place == 0 else f"{location.orders[place]:.4g}"
        for place in np.flatnonzero(~flagged.any(axis=(0, 1)))
    ]
    clean = np.flatnonzero(~flagged.any(axis=(1, 2)))
    parts = []
    if channels:
        parts.append("the channels " + ", ".join(channels))
    if orders:
        parts.append("the orders " + ", ".join(orders))
    if clean.size:
        conditions = [
            f"{location.speed_rpm[k]:.0f} r/min with {round(location.load_torque[k])} N.m"
            for k in clean
        ]
        parts.append("the records at " + ", ".join(conditions))
    if not parts:
        return "No channel, order or record as a whole may be trusted as it is."
    return "The model may be trusted as it is in " + "; in ".join(parts) + "."


def fixed_frequency(data: Data) -> float | None:
    """Return the frequency, Hz, of a line that records at several speeds share, or None."""
    ratio, rig = data.campaign.believed.ratio, data.campaign.rig
    found, at_speed = [], []
    speeds = np.abs(data.features.conditions.input_speed)
    for record, speed in zip(data.features.records, speeds, strict=True):
        orders, amplitudes = residual_spectrum(record, rig, ratio, data.features.orders)
        power = (amplitudes**2).max(axis=0)
        if not power.size:
            continue
        strongest = int(np.argmax(power))
        if power[strongest] > np.log(amplitudes.size * len(speeds) / _FALSE_LINES):
            found.append(orders[strongest] * speed / (2.0 * np.pi))
            at_speed.append(speed)
    frequencies, measured = np.array(found), np.array(at_speed)
    for frequency in frequencies:
        same = np.abs(frequencies / frequency - 1.0) < _SAME_FREQUENCY
        if same.sum() >= _FEWEST and np.ptp(measured[same]) > 0.1 * measured[same].max():
            return float(np.median(frequencies[same]))
    return None
