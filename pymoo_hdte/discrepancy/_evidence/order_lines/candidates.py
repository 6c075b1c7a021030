"""The library: every registered effect that a drive may have, as candidates for a campaign."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import ACTING_AT, words_of
from pymoo_hdte.discrepancy._records.believed import MECHANICAL
from pymoo_hdte.discrepancy._records.known_values import known_values, with_known_values
from pymoo_hdte.discrepancy._selection.candidate import Candidate, candidate_of
from pymoo_hdte.discrepancy._selection.candidate import out_of_tolerance as released_parameter
from pymoo_hdte.discrepancy._selection.fitting import Unknowns
from pymoo_hdte.drive._effects import DriveEffect, DriveSizes, LawAtPort, drive_effects
from pymoo_hdte.effects.effect import Place, effect_named, place_of
from pymoo_hdte.effects.unknowns import Parameter


def drive_candidates(
    sizes: Mapping[str, DriveSizes],
    believed: Sequence[DriveEffect] = (),
    bench: Sequence[Candidate] = (),
) -> list[Candidate]:
    """Return all candidates for a drive, for the sizes of each of its ports.

    None of them stands where the drive is believed to have the same effect, in whatever form: dry
    friction acts there once, bending or not, and hysteresis once, of springs or of Bouc and Wen.
    Nor does a nuisance of the ``bench`` in any form.
    """
    known = {_place_of_main_form(place_of(effect)) for effect in believed}
    known |= {_place_of_main_form(place) for nuisance in bench for place in nuisance.places}
    candidates = [
        candidate_of(effect, guess, port, "torque", _at_port, sizes[port].slower)
        for effect in drive_effects()
        for port in effect.sought_at
        for guess in effect.guesses(sizes[port])
    ]
    return [
        candidate
        for candidate in candidates
        if not {_place_of_main_form(place) for place in candidate.places} & known
    ]


def _place_of_main_form(place: Place) -> Place:
    """Return the place of an effect under the name of the effect of which it is a form."""
    name, port, order = place
    return effect_named(name).form_of or name, port, order


def _at_port(name: str, port: str, part: Any) -> Any:
    """Return a law as an effect at its port; other parts already are effects of a drive."""
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
    One that an effect covers under another name is a candidate only ``together`` with others. A
    number of the believed ``effects`` is one if its law takes all values that it may then have.
    """
    believed, known = {parameter.name: parameter.start for parameter in base}, known_values(effects)
    covering = {effect.covers: effect for effect in drive_effects() if effect.covers}
    candidates = [
        released_parameter(
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
    return [
        candidate
        for candidate in candidates
        if candidate.port not in known or _allowed_by_law(base, candidate, effects)
    ]


def _allowed_by_law(
    base: Sequence[Parameter], released: Candidate, effects: Sequence[DriveEffect]
) -> bool:
    """Tell whether a law takes the least and the largest value of a released number."""
    unknowns = Unknowns(base, (released,))
    place = [parameter.name for parameter in unknowns.parameters].index(released.port)
    try:
        for bound in (unknowns.lower[place], unknowns.upper[place]):
            with_known_values(effects, {released.port: bound})
    except InvalidInput:
        return False
    return True
