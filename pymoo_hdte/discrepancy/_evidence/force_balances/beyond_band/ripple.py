"""Ripple beyond the band of the motion: its orders, sizes, and how it changes with the speed.

A verdict compares forces up to the frequency at which a motion can be measured. Beyond, forces that
vary with the position are still seen, because positions are known, up to half the sampling rate.
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
    gap_of,
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
    """Words for what varies with the position of a port, and for its lines."""

    at_port: str = "force at"
    of_records: str = "forces"
    lines_at: str = "Ripple at"
    lines: str = "ripple"
    cause: str = "a torque"


OF_FORCES = Terms()
OF_TORSION = Terms("torsion of", "torsion", "An error of", "error", "an error")


@dataclass(frozen=True, eq=False)
class Ripple:
    """What varies with the position of a port beyond the band of the motion.

    Attributes
    ----------
    port : str
    order, resolution : float
        Cycles per turn of an angle in rad; of a length, radians per m. The resolution is the change
        of the order by which the longest travel has one cycle more.
    variance : float
        Of the order.
    ratio : float
        Turns of the gear's input per turn of the port; 0 where no gear is stated.
    meaning : str
        What the gear says of the order; empty if nothing.
    frequencies : (float, float)
        Hz, between which it was seen.
    parts : tuple of Part
    ways : int
        Directions, 1 or 2, in which it was seen.
    speeds : ndarray, shape (n, 3)
        Speed, amplitude, and its standard deviation, SI.
    trend : str
        How the amplitude changes with the speed, in words.
    fitted : (float, float)
        Root mean square beyond the band before and after the ripple is taken away, N or N.m, while
        its frequency is between those.
    held_out : (float, float) or None
        The same in records that were not fitted.
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
        """Its order, how often that is in a turn of the input, and what the gear says of it."""
        told = "; ".join(filter(None, (_per_input_turn(self.order, self.ratio), self.meaning)))
        return f"{self.order:.5g} ({told})" if told else f"{self.order:.5g}"

    @property
    def sentence(self) -> str:
        """What it is."""
        names = [one.law.name for one in self.parts]
        words = effect_named(names[0]).sentence
        told = [sentence_at(words, self.port, f"{self.order:.5g}", "force")]
        if len(names) > 1:
            same = "is the same in both directions"
            turns = "turns with the direction, as friction"
            told.append(f"A part of it {same if effect_named(names[1]).drives else turns}.")
        if self.ways == 1:
            told.append(_one_way(self.port))
        if self.ratio:
            told.append(f"That is {_per_input_turn(self.order, self.ratio)}.")
        if self.meaning:
            told.append(f"Within the resolution of the travel, {self.meaning}.")
        low, high = self.frequencies
        told.append(f"It was seen from {low:.3g} to {high:.3g} Hz. {self.trend}")
        return " ".join(told)

    def as_dicts(self) -> list[dict[str, Any]]:
        """Return its effects as a verdict has them, with plain values."""
        return [
            {
                "name": part.law.name,
                "port": self.port,
                "sentence": self.sentence,
                "parameters": {
                    "order": _value(self.order, self.variance),
                    **{
                        name: _value(value, variance)
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
    """What a search beyond the band found.

    Attributes
    ----------
    found : tuple of Ripple
        The strongest first, port by port.
    limits : tuple of str
        What was seen and is none, or cannot be told, in sentences.
    """

    found: tuple[Ripple, ...] = ()
    limits: tuple[str, ...] = ()

    @property
    def laws(self) -> tuple[LawAt, ...]:
        """All laws."""
        return tuple(part.law for one in self.found for part in one.parts)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of their effects."""
        return tuple(dict.fromkeys(one.name for one in self.laws))

    @property
    def sentence(self) -> str:
        """What was found, in words; empty for nothing."""
        ports = dict.fromkeys(one.port for one in self.found)
        orders = {p: [one.words for one in self.found if one.port == p] for p in ports}
        return " ".join(
            f"Beyond the band of the motion the force at the {port} varies with its position, "
            f"order{'s'[: len(here) - 1]} {listed(here)}."
            for port, here in orders.items()
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
    """Return what varies with the position of ports beyond the band of the motion.

    Parameters
    ----------
    mechanism : Mechanism
    records : sequence of Record
        As they were sampled; those held out judge what the others show.
    cutoff : float
        Hz, up to which the motion is known.
    effects : collection of LawAt
        That are known already; their orders are not looked for.
    rules : Rules
    terms : Terms
        Words for what the records of the mechanism hold.

    Returns
    -------
    Ripples
    """
    found: list[Ripple] = []
    limits: list[str] = []
    of_role = {role: [one for one in records if one.role == role] for role in ("train", "held_out")}
    for port in ports_apart(mechanism):
        train, held_out = (
            high_bands(mechanism, port, of_role[role], cutoff, rules) for role in of_role
        )
        known = known_orders(mechanism, port, effects)
        expected = port.gear.expected if port.gear else ()
        search = seen_orders(train, tuple(expected), known, rules)
        here: list[Ripple] = []
        lost: list[Ripple] = []
        for one in search.kept:
            ripple = _ripple(port, one, train, held_out, rules)
            if _share(ripple.fitted) < rules.ripple_share:
                continue
            shown = ripple.held_out is None or _share(ripple.held_out) >= rules.ripple_share
            (here if shown else lost).append(ripple)
        found += here
        limits += _limits(port, search, here, lost, terms)
    return Ripples(tuple(found), tuple(limits))


def _limits(
    port: Port,
    search: SeenOrders,
    found: Sequence[Ripple],
    lost: Sequence[Ripple],
    terms: Terms,
) -> list[str]:
    """Return what was seen at a port and is not named, or cannot be told, in sentences."""

    def ripple(orders: Sequence[float]) -> str:
        turns = listed([_per_input_turn(one, ratio) for one in orders])
        words = f"{orders_in_words(orders)}{f' ({turns})' if ratio else ''}"
        return f"{terms.lines_at} the {name}, {words},"

    limits = []
    name, ratio = port.name, port.gear.ratio if port.gear else 0.0
    if search.cut:
        highest = np.format_float_positional(search.highest, 4, fractional=False, trim="-")
        limits.append(f"Orders at the {name} were searched up to {highest} only.")
    if any(one.ways == 1 for one in found):
        limits.append(_one_way(name, terms))
    if lost:
        limits.append(
            f"{ripple([one.order for one in lost])} is seen, but to take it away makes the "
            f"{terms.of_records} of the held-out records no smaller: it is not named."
        )
    if search.undecided:
        limits.append(
            f"{ripple(search.undecided)} is seen at one speed or is weak, so that "
            "these records do not tell it from a frequency: it is not named."
        )
    if search.fixed:
        lines = ", ".join(f"{one:.3g}" for one in search.fixed)
        limits.append(
            f"The {terms.at_port} the {name} has lines at {lines} Hz, which these records show as "
            "frequencies and not as orders of its position."
        )
    return limits


def _per_input_turn(order: float, ratio: float) -> str:
    """Return how often an order is in a turn of the gear's input; empty without a gear."""
    return f"{order / ratio:.4g} per input turn" if ratio else ""


def _one_way(port: str, terms: Terms = OF_FORCES) -> str:
    return (
        f"The {port} shows its {terms.lines} in one direction only: {terms.cause} cannot be told "
        "from friction that varies with the position."
    )


def _ripple(
    port: Port,
    seen: SeenOrder,
    train: Sequence[HighBand],
    held_out: Sequence[HighBand],
    rules: Rules,
) -> Ripple:
    size = size_of(port.name, seen, train, rules)
    rows = [one.inside(seen.order) for one in train]
    speed = np.concatenate([np.abs(one.speed)[here] for one, here in zip(train, rows, strict=True)])
    per_speed = seen.order / (2.0 * np.pi)
    speeds = over_speed(seen, train, speed)
    laws = [one.law for one in size.parts]
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
        gap_of(seen.order, laws, train) or (0.0, 0.0),
        gap_of(seen.order, laws, held_out),
    )


def _share(gap: Pair) -> float:
    """Return the share of the power that is taken away between two root mean squares."""
    before, after = gap
    return 1.0 - (after / before) ** 2 if before > 0.0 else 0.0


def _value(value: float, variance: float) -> dict[str, Any]:
    half = _CENTRAL * variance**0.5
    return {"value": value, "interval95": [value - half, value + half], "at_bound": False}
