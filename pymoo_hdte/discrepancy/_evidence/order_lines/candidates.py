"""The library: every registered effect that a drive may have, as candidates for a campaign."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import MECHANICAL, words_of
from pymoo_hdte.discrepancy._records.known_values import known_values, with_known_values
from pymoo_hdte.discrepancy._selection import candidate
from pymoo_hdte.discrepancy._selection.candidate import Candidate, candidate_of
from pymoo_hdte.discrepancy._selection.fitting import Unknowns
from pymoo_hdte.drive._effects import DriveEffect, DriveSizes, LawAtPort, drive_effects
from pymoo_hdte.effects.effect import effect_named, place_of
from pymoo_hdte.effects.unknowns import Parameter

_ACTING_AT = {"input_damping": "input", "output_damping": "output"}
"""Ports at which base parameters are friction, as a law there is."""
_COVERED = {"load_inertia": ("load_inertia", "output"), "damping": ("damping_reference", "mesh")}
"""Base parameters that an effect in the library covers, and name and port of the effect."""
_ONCE = (
    {"coulomb_friction", "presliding_friction"},
    {"nonlinear_drag", "shear_thinning_drag"},
    {"hysteresis", "bouc_wen_hysteresis"},
)
"""Names of one thing in several forms, which a port has once: dry friction, drag, hysteresis."""


def drive_candidates(
    sizes: Mapping[str, DriveSizes], believed: Sequence[DriveEffect] = ()
) -> list[Candidate]:
    """Return all candidates for a drive, for the sizes of each of its ports.

    None of them is at the place of a believed effect; dry friction is there once, bending or not,
    drag once, of a fluid that thins or not, and hysteresis once, of springs or of Bouc and Wen.
    """
    known = {place_of(effect) for effect in believed}
    known |= {
        (name, port, order)
        for one, port, order in known
        for names in _ONCE
        if one in names
        for name in names
    }
    found = [
        candidate_of(effect, guess, port, "torque", _standing, sizes[port].slower)
        for effect in drive_effects()
        for port in effect.sought_at
        for guess in effect.guesses(sizes[port])
    ]
    return [one for one in found if not one.places & known]


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
    found = [
        candidate.out_of_tolerance(
            name,
            words_of(name, error_orders),
            _ACTING_AT.get(name, ""),
            _COVERED.get(name, ("", "")),
        )
        for name in at_bounds
        if (name in MECHANICAL or name.startswith("error_amplitude_") or name in known)
        and believed[name] > 0.0
        and (together or name not in _COVERED)
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
