"""Ripple beyond the band of the motion: its orders, sizes, and how it changes with the speed.

A verdict compares forces up to the frequency at which a motion can be measured. Beyond it, up to
half the sampling rate, forces that vary with the position still show, because positions are known.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.high_band import (
    HighBand,
    high_bands,
    known_orders,
    ports_apart,
)
from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.order_search import (
    SeenOrder,
    SeenOrders,
    seen_orders,
)
from pymoo_hdte.discrepancy._evidence.force_balances.beyond_band.ripple_size import (
    Part,
    force_before_and_after,
    over_speed,
    size_of,
    trend_of,
)
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.effects.sentence_blanks import listed, orders_in_words, sentence_at
from pymoo_hdte.mechanism import LawAt, Mechanism, Port, Record

Values = NDArray[np.float64]
Pair = tuple[float, float]

_CENTRAL = float(norm.ppf(0.975))


@dataclass(frozen=True)
class Terms:
    """Words for a quantity that varies with the position of a port, and for its lines."""

    at_port: str = "force at"
    of_records: str = "forces"
    lines_at: str = "Ripple at"
    lines: str = "ripple"
    cause: str = "a torque"


OF_FORCES = Terms()
OF_TORSION = Terms("torsion of", "torsion", "An error of", "error", "an error")


@dataclass(frozen=True, eq=False)
class Ripple:
    """A force or an error that varies with the position of a port beyond the band of the motion.

    Attributes
    ----------
    port : str
    order, resolution : float
        Cycles per turn of an angle in rad; of a length, radians per m. The resolution is the change
        of the order by which the longest travel has one cycle more.
    variance : float
        Variance of the order.
    ratio : float
        Turns of the gear's input per turn of the port; 0 where no gear is stated.
    meaning : str
        Meaning of the order for the gear, in words; empty for none.
    frequencies : (float, float)
        Lowest and highest frequency at which it was seen, Hz.
    parts : tuple of Part
    ways : int
        Directions, 1 or 2, in which it was seen.
    speeds : ndarray, shape (n, 3)
        Speed, amplitude, and its standard deviation, SI.
    trend : str
        How the amplitude changes with the speed, in words.
    fitted : (float, float)
        Root mean square beyond the band before and after the ripple is removed, N or N.m, in the
        rows in which its frequency is between ``frequencies``.
    held_out : (float, float) or None
        The same as ``fitted`` in records that were not fitted.
    """

    port: str
    order: float
    resolution: float
    variance: float
    ratio: float
    meaning: str
    frequencies: Pair
    parts: tuple[Part, ...]
    ways: int
    speeds: Values
    trend: str
    fitted: Pair
    held_out: Pair | None

    @property
    def words(self) -> str:
        """Its order, cycles per input turn, and meaning for the gear, in words."""
        turns = _per_input_turn(self.order, self.ratio)
        if turns and turns in self.meaning:
            turns = ""
        remarks = "; ".join(filter(None, (turns, self.meaning)))
        return f"{self.order:.5g} ({remarks})" if remarks else f"{self.order:.5g}"

    @property
    def sentence(self) -> str:
        """Sentences that describe the ripple."""
        names = [part.law.name for part in self.parts]
        words = effect_named(names[0]).sentence
        sentences = [sentence_at(words, self.port, f"{self.order:.5g}", "force")]
        if len(names) > 1:
            same = "is the same in both directions"
            turns = "turns with the direction, as friction"
            sentences.append(f"A part of it {same if effect_named(names[1]).drives else turns}.")
        if self.ways == 1:
            sentences.append(_one_way(self.port))
        if self.ratio:
            sentences.append(f"That is {_per_input_turn(self.order, self.ratio)}.")
        if self.meaning:
            sentences.append(f"Within the resolution of the travel, {self.meaning}.")
        low, high = self.frequencies
        sentences.append(f"It was seen from {low:.3g} to {high:.3g} Hz. {self.trend}")
        return " ".join(sentences)

    def as_dicts(self) -> list[dict[str, Any]]:
        """Return its effects as a verdict has them, with plain values."""
        return [
            {
                "name": part.law.name,
                "port": self.port,
                "sentence": self.sentence,
                "parameters": {
                    "order": _value_with_interval(self.order, self.variance),
                    **{
                        name: _value_with_interval(value, variance)
                        for name, (value, variance) in part.values.items()
                    },
                },
                "at_bound": [],
                "beyond_band": {
                    "frequencies_Hz": list(self.frequencies),
                    "resolution": self.resolution,
                    **({"per_input_turn": self.order / self.ratio} if self.ratio else {}),
                    "amplitude_over_speed": self.speeds.tolist(),
                    "fitted": list(self.fitted),
                    "held_out": None if self.held_out is None else list(self.held_out),
                },
            }
            for part in self.parts
        ]


@dataclass(frozen=True)
class Ripples:
    """The ripples of all ports beyond the band of the motion.

    Attributes
    ----------
    lines : tuple of Ripple
        The strongest first, port by port.
    limits : tuple of str
        Sentences about lines that are no ripple, or that the records cannot tell from one.
    """

    lines: tuple[Ripple, ...] = ()
    limits: tuple[str, ...] = ()

    @property
    def laws(self) -> tuple[LawAt, ...]:
        """Laws of all ripples."""
        return tuple(part.law for ripple in self.lines for part in ripple.parts)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects of all ripples."""
        return tuple(dict.fromkeys(law.name for law in self.laws))

    @property
    def sentence(self) -> str:
        """Sentences that name the ripples; empty for none."""
        ports = dict.fromkeys(ripple.port for ripple in self.lines)
        orders = {p: [ripple.words for ripple in self.lines if ripple.port == p] for p in ports}
        return " ".join(
            f"Beyond the band of the motion the force at the {port} varies with its position, "
            f"order{'s'[: len(words) - 1]} {listed(words)}."
            for port, words in orders.items()
        )


NO_RIPPLES = Ripples()


def find_ripples(
    mechanism: Mechanism,
    records: Sequence[Record],
    cutoff: float,
    effects: Collection[LawAt] = (),
    rules: Rules = RULES,
    terms: Terms = OF_FORCES,
) -> Ripples:
    """Return the ripples of a mechanism's ports beyond the band of the motion.

    Parameters
    ----------
    mechanism : Mechanism
    records : sequence of Record
        Records as they were sampled; the held-out ones validate the ripples of the others.
    cutoff : float
        Frequency up to which the motion is known, Hz.
    effects : collection of LawAt
        Effects that are known already; their orders are not searched for.
    rules : Rules
    terms : Terms
        Words for the quantity that the records of the mechanism hold.

    Returns
    -------
    Ripples
    """
    ripples: list[Ripple] = []
    limits: list[str] = []
    of_role = {
        role: [record for record in records if record.role == role]
        for role in ("train", "held_out")
    }
    for port in ports_apart(mechanism):
        train, held_out = (
            high_bands(mechanism, port, of_role[role], cutoff, rules) for role in of_role
        )
        known = known_orders(mechanism, port, effects)
        expected = port.gear.expected if port.gear else ()
        search = seen_orders(train, tuple(expected), known, rules)
        shown: list[Ripple] = []
        lost: list[Ripple] = []
        for line in search.orders:
            ripple = _ripple(port, line, train, held_out, rules)
            if _share(ripple.fitted) < rules.ripple_share:
                continue
            remains = ripple.held_out is None or _share(ripple.held_out) >= rules.ripple_share
            (shown if remains else lost).append(ripple)
        ripples += shown
        limits += _limits(port, search, shown, lost, terms)
    return Ripples(tuple(ripples), tuple(limits))


def _limits(
    port: Port,
    search: SeenOrders,
    ripples: Sequence[Ripple],
    lost: Sequence[Ripple],
    terms: Terms,
) -> list[str]:
    """Return sentences about the lines at a port that are not named, or not told apart."""

    def named(orders: Sequence[float]) -> str:
        turns = listed([_per_input_turn(order, ratio) for order in orders])
        words = f"{orders_in_words(orders)}{f' ({turns})' if ratio else ''}"
        return f"{terms.lines_at} the {name}, {words},"

    limits = []
    name, ratio = port.name, port.gear.ratio if port.gear else 0.0
    if search.cut:
        highest = np.format_float_positional(search.highest, 4, fractional=False, trim="-")
        limits.append(f"Orders at the {name} were searched up to {highest} only.")
    if any(ripple.ways == 1 for ripple in ripples):
        limits.append(_one_way(name, terms))
    if lost:
        limits.append(
            f"{named([ripple.order for ripple in lost])} is seen, but removing it does not "
            f"reduce the {terms.of_records} of the held-out records: it is not named."
        )
    if search.undecided:
        limits.append(
            f"{named(search.undecided)} is seen at one speed only or is weak, so "
            "it may be a fixed frequency: it is not named."
        )
    if search.fixed:
        lines = ", ".join(f"{frequency:.3g}" for frequency in search.fixed)
        limits.append(
            f"The {terms.at_port} the {name} has lines at {lines} Hz, which these records show as "
            "frequencies and not as orders of its position."
        )
    return limits


def _per_input_turn(order: float, ratio: float) -> str:
    """Return the cycles of an order per input turn in words, or nothing without a gear."""
    return f"{order / ratio:.4g} per input turn" if ratio else ""


def _one_way(port: str, terms: Terms = OF_FORCES) -> str:
    return (
        f"The {port} shows its {terms.lines} in one direction only, where {terms.cause} looks "
        "like friction that varies with the position."
    )


def _ripple(
    port: Port,
    seen: SeenOrder,
    train: Sequence[HighBand],
    held_out: Sequence[HighBand],
    rules: Rules,
) -> Ripple:
    size = size_of(port.name, seen, train, rules)
    rows = [band.inside(seen.order) for band in train]
    speed = np.concatenate(
        [np.abs(band.speed)[moving] for band, moving in zip(train, rows, strict=True)]
    )
    per_speed = seen.order / (2.0 * np.pi)
    speeds = over_speed(seen, train, speed)
    laws = [part.law for part in size.parts]
    half = _CENTRAL * size.variance**0.5
    return Ripple(
        port.name,
        seen.order,
        seen.resolution,
        size.variance,
        port.gear.ratio if port.gear else 0.0,
        port.gear.meaning(seen.order, seen.resolution + half) if port.gear else "",
        (per_speed * float(speed.min()), per_speed * float(speed.max())),
        size.parts,
        size.ways,
        speeds,
        trend_of(speeds, rules),
        force_before_and_after(seen.order, laws, train) or (0.0, 0.0),
        force_before_and_after(seen.order, laws, held_out),
    )


def _share(gap: Pair) -> float:
    """Return the share of the power that is removed between two root mean squares."""
    before, after = gap
    return 1.0 - (after / before) ** 2 if before > 0.0 else 0.0


def _value_with_interval(value: float, variance: float) -> dict[str, Any]:
    half = _CENTRAL * variance**0.5
    return {"value": value, "interval95": [value - half, value + half], "at_bound": False}
