"""The library: every registered effect that a drive may have, as candidates for a campaign."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import ACTING_AT, MECHANICAL, words_of
from pymoo_hdte.discrepancy._records.known_values import known_values, with_known_values
from pymoo_hdte.discrepancy._selection import candidate
from pymoo_hdte.discrepancy._selection.candidate import Candidate, candidate_of
from pymoo_hdte.discrepancy._selection.fitting import Unknowns
from pymoo_hdte.drive._effects import DriveEffect, DriveSizes, LawAtPort, drive_effects
from pymoo_hdte.effects.effect import Place, effect_named, place_of
from pymoo_hdte.effects.unknowns import Parameter


def drive_candidates(
    sizes: Mapping[str, DriveSizes], believed: Sequence[DriveEffect] = ()
) -> list[Candidate]:
    """Return all candidates for a drive, for the sizes of each of its ports.

    None of them is at the place of a believed effect, nor of another form of it: dry friction is
    there once, bending or not, and hysteresis once, of springs or of Bouc and Wen.
    """
    known = {_in_first_form(place_of(effect)) for effect in believed}
    found = [
        candidate_of(effect, guess, port, "torque", _standing, sizes[port].slower)
        for effect in drive_effects()
        for port in effect.sought_at
        for guess in effect.guesses(sizes[port])
    ]
    return [one for one in found if not {_in_first_form(place) for place in one.places} & known]


def _in_first_form(place: Place) -> Place:
    """Return a place with the effect of which its own is another form, if it is one."""
    name, port, order = place
    return effect_named(name).form_of or name, port, order


def _standing(name: str, port: str, part: Any) -> Any:
    """Return a law at its port; anything else is already an effect of a drive."""
    return LawAtPort(name, port, part) if effect_named(name).change is None else part


def out_of_tolerance(
    base: Sequence[Parameter],
    at_bounds: Sequence[str],
    error_orders: Sequence[float],
    together: bool = False,
    effects: Sequence[DriveEffect] = (),
) -> list[Candidate]:
    """Return a candidate for each base parameter that a fit left at a bound.

    A parameter believed to be zero cannot be out of tolerance: if it is not zero, it is missing.
    What an effect covers under another name is one only ``together`` with others. A number of the
    believed ``effects`` is one if its law takes all values that it may then have.
    """
    believed, known = {one.name: one.start for one in base}, known_values(effects)
    covering = {effect.covers: effect for effect in drive_effects() if effect.covers}
    found = [
        candidate.out_of_tolerance(
            name,
            words_of(name, error_orders),
            ACTING_AT.get(name, ""),
            covering.get(name),
        )
        for name in at_bounds
        if (name in MECHANICAL or name.startswith("error_amplitude_") or name in known)
        and believed[name] > 0.0
        and (together or name not in covering)
    ]
    return [one for one in found if one.port not in known or _taken(base, one, effects)]


def _taken(base: Sequence[Parameter], freed: Candidate, effects: Sequence[DriveEffect]) -> bool:
    """Tell whether a law takes the least and the largest value of its number without tolerance."""
    unknowns = Unknowns(base, (freed,))
    place = [one.name for one in unknowns.parameters].index(freed.port)
    try:
        for bound in (unknowns.lower[place], unknowns.upper[place]):
            with_known_values(effects, {freed.port: bound})
    except InvalidInput:
        return False
    return True
