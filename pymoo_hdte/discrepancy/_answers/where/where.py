"""Sentences on a map of misfit: orders and channels, growth with speed and load, and its nature."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pymoo_hdte.discrepancy._answers.where.map import Flags, Location, Values
from pymoo_hdte.discrepancy._answers.where.nature import (
    IN_SWEEP,
    Nature,
    StrayLines,
    nature_of_misfit,
    sizes,
    stray_lines,
)
from pymoo_hdte.discrepancy._answers.where.trend import broad_band, in_words, strongest, trends
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS
from pymoo_hdte.effects.sentence_blanks import listed

_WORDS = [name.replace("_", " ") for name in CHANNELS]
# Length of the lists in sentences; thresholds of flagging and of statements are in `Rules`.
_SHOWN = 3
"""Largest number of orders that a sentence lists."""
_MINOR = 0.05
"""Share of the misfit below which an order or a channel is not mentioned."""
_HALF_WIDTH = 0.05
"""Relative distance within which a line belongs to a fixed frequency or leaks from it."""


def sentences(location: Location, data: Data, unexpected: Sequence[float]) -> tuple[str, str]:
    """Return where the misfit is, and where the model may be trusted as it is.

    Parameters
    ----------
    location : Location
    data : Data
        For lines that do not belong to an order, and for stiffness and ratio.
    unexpected : sequence of float
        Orders beyond the expected ones with significant lines.
    """
    believed, stray = data.campaign.believed, stray_lines(data, unexpected)
    parts: list[str] = []
    nature: Nature | None = None
    if location.flagged.any():
        parts.append(_where(location, stray, believed.ratio))
        if stray.frequency is None:
            parts.append(f"{_growth(location, bool(stray.broad))}.")
        nature = nature_of_misfit(location, believed)
        parts.append(f"{nature.sentence}.")
    elif not location.within_noise.everywhere:
        parts.append(
            "No single mean or order line exceeds the noise, but together they do: in "
            f"{_beyond(location, believed.ratio)}."
        )
    elif location.named:
        parts.append("The named effect changes no mean or order line by more than its noise.")
    else:
        parts.append("Nowhere: all means and order lines agree within the noise.")
    if location.sweep_flagged and (nature is None or nature.code != IN_SWEEP):
        parts.append("The torsion sweep disagrees with the model.")
    beyond = [order for order in unexpected if np.abs(location.orders - order).min() > 1e-6]
    if beyond and stray == StrayLines():
        orders = ", ".join(f"{order:.4g}" for order in beyond[:_SHOWN])
        parts.append(f"Lines beyond those compared stand at order {orders}.")
    return " ".join(parts), _trusted(location, believed.ratio)


def _where(location: Location, stray: StrayLines, ratio: float) -> str:
    """Return the orders, or else a broad band or fixed frequency, with the channels."""
    size = sizes(location)
    if stray.broad:
        names = listed([_WORDS[CHANNELS.index(name)] for name in stray.broad])
        return f"In a broad band of the {names}: it comes and goes with time, not with the angle."
    if stray.frequency is None:
        return _orders(location, size, ratio)
    frequencies = np.abs(location.orders * location.speed_rpm[:, None]) / 60.0
    at_frequency = np.abs(frequencies / stray.frequency - 1.0) < _HALF_WIDTH
    vibration = np.where(at_frequency[:, None], size, 0.0)
    words = f"At a fixed frequency of {stray.frequency:.3g} Hz, whatever the speed"
    if vibration.any():
        words += f", in {_channels(vibration.sum(axis=(0, 2)))}"
    beyond = size - vibration
    return f"{words}." + (f" {_orders(location, beyond, ratio)}" if _matters(beyond, size) else "")


def _matters(remaining: Values, size: Values) -> bool:
    return bool(remaining.sum() > _MINOR * size.sum())


def _orders(location: Location, size: Values, ratio: float) -> str:
    by_order = _weight(size.sum(axis=0))
    ranked = [place for place in np.argsort(-by_order) if by_order[place] > 0.0]
    shown = [place for place in ranked[:_SHOWN] if by_order[place] >= _MINOR * by_order.max()]
    by_channels: dict[str, list[str]] = {}
    for place in shown:
        channels = _channels(size[:, :, place].sum(axis=0))
        by_channels.setdefault(channels, []).append(_order(location, place, ratio))
    parts = [f"at {listed(orders)} in {channels}" for channels, orders in by_channels.items()]
    remaining = np.count_nonzero(size.any(axis=(0, 1))) - len(shown)
    if remaining:
        parts.append(f"less at {remaining} further order{'s' if remaining > 1 else ''}")
    words = "; ".join(parts)
    return f"{words[0].upper()}{words[1:]}."


def _weight(size: Values) -> Values:
    """Return the weight of orders from their sizes (4, 1 + m).

    The input angle counts only where no other channel does: the speed loop moves it strongly.
    """
    return size[:3].sum(axis=0) if size[:3].any() else size[3]


def _order(location: Location, place: int, ratio: float) -> str:
    if place == 0:
        return "the mean"
    order = location.orders[place]
    turns = round(order * ratio)
    slow = order < 1.0 and abs(order * ratio - turns) < 1e-3
    return f"order {order:.4g}" + (f" ({turns} per output turn)" if slow else "")


def _channels(size: Values) -> str:
    """Return the channels whose misfit (4,) matters."""
    least = _MINOR * _weight(size[:, None])[0] / max(np.count_nonzero(size[:3]), 1)
    names = [
        name
        for name, channel_size in zip(_WORDS, size, strict=True)
        if channel_size > 0.0 and channel_size >= least
    ]
    return "all channels" if len(names) == len(_WORDS) else f"the {listed(names)}"


def _growth(location: Location, broad: bool) -> str:
    """Return how the strongest line, or a whole broad band, changes with speed and load."""
    size = sizes(location).sum(axis=0)
    channel, order = strongest(size, range(3) if size[:3].any() else range(4))
    conditions = location.speed_rpm, location.load_torque
    if broad:
        lines = location.misfit[:, channel, 1:], location.noise[:, channel, 1:]
        by_condition = trends(*broad_band(*lines), *conditions, location.rules)
        return f"The {_WORDS[channel]} there {in_words(by_condition)}"
    cell = location.misfit[:, channel, order], location.noise[:, channel, order]
    what = "mean" if order == 0 else f"line of order {location.orders[order]:.4g}"
    by_condition = trends(*cell, *conditions, location.rules)
    return f"The misfit of the {_WORDS[channel]} ({what}) {in_words(by_condition)}"


def _beyond(location: Location, ratio: float) -> str:
    """Return the channels, orders and records whose cells together exceed the noise."""
    within = location.within_noise
    parts = [f"the {_WORDS[k]}" for k in np.flatnonzero(~within.channels)]
    places = np.flatnonzero(~within.orders).tolist()
    parts += [_order(location, place, ratio) for place in places[:_SHOWN]]
    if not parts:
        parts = [f"{np.sum(~within.records)} of {len(within.records)} records"]
    return listed(parts)


def _trusted(location: Location, ratio: float) -> str:
    """Return channels, orders and records that the believed model meets within the noise.

    Nothing is flagged in them, and the errors of their cells together are those of noise.
    """
    flagged, within = location.flagged, location.within_noise
    if not flagged.any() and within.everywhere:
        if location.sweep_flagged:
            return (
                "The model may be trusted as it is in the running records, but not in the torsion "
                "sweep."
            )
        return "The model may be trusted as it is wherever it was measured."
    met = within.channels & ~flagged.any(axis=(0, 2))
    channels = [_WORDS[k] for k in np.flatnonzero(met)]
    wrong = np.asarray(flagged.any(axis=(0, 1)) | ~within.orders)
    parts = []
    if channels:
        parts.append(f"in the {listed(channels)}")
    if wrong.any() and not wrong.all():
        places = np.flatnonzero(wrong).tolist()
        names = listed([_order(location, place, ratio) for place in places])
        few = len(places) <= _SHOWN
        parts.append(
            f"at all orders but {names}" if few else f"at {np.sum(~wrong)} of {len(wrong)} orders"
        )
    clean = np.asarray(within.records & ~flagged.any(axis=(1, 2)))
    if clean.any() and not clean.all():
        parts.append(_conditions(location, clean))
    if not parts:
        return "No channel, order or record as a whole may be trusted as it is."
    return f"The model may be trusted as it is {'; '.join(parts)}."


def _conditions(location: Location, clean: Flags) -> str:
    """Return the records without misfit, as a limit of speed or load where one describes them."""
    for condition, unit in ((location.load_torque, "N.m"), (location.speed_rpm, "r/min")):
        size = np.abs(condition)
        limit = size[clean].max()
        if np.array_equal(clean, size <= limit):
            # Rounded to two digits of the largest load; the zero error of a sensor lies below that.
            step = min(10.0 ** np.floor(np.log10(size.max()) - 1.0), 1.0)
            limit = round(limit / step) * step
            return f"in all records {f'up to {limit:g} {unit}' if limit else 'without load'}"
    return f"in {int(clean.sum())} of {len(clean)} records"
