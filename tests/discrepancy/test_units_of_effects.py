"""Every unknown of every effect has its unit, in drives and in other machines."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pymoo_hdte.discrepancy._selection.candidate import candidate_of
from pymoo_hdte.drive._effects import DriveSizes, LawAtPort
from pymoo_hdte.effects import known_effects
from pymoo_hdte.effects.law import PortState
from pymoo_hdte.effects.quantities import si_unit

SIZES = DriveSizes(
    force=0.3,
    residual=0.2,
    largest=2.0,
    speed=150.0,
    travel=0.02,
    stiffness=2e3,
    damping=0.4,
    loaded=True,
    load=5.0,
    driven=True,
    swept=True,
    temperature=300.0,
    turns=True,
    seen=(3.0, 5.0, 101.0),
    expected=(1.0, 2.0),
    shown=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 9.0, 101.0),
    error=1e-5,
    largest_error=1e-4,
    believed_orders=(1.0,),
    inertia=0.4,
    duration=600.0,
    changes=(100.0,),
)
FORMS = (
    SIZES,
    replace(SIZES, stiffness=0.0, damping=0.0, inertia=0.0, together=True),
    replace(SIZES, read=True, together=True),
    replace(SIZES, between=True),
)
EFFECTS = [one for one in known_effects() if one.guess is not None]
"""Others are found as forms of these."""
SMALLER = {"N.m": 3.0, "rad": 1.7, "s": 0.6, "K": 1.0}
"""Numbers by which units of torque, angle, time and temperature shrink."""


def in_smaller(unit, shrunk):
    """Return by how much a number in such a unit grows where the units shrink."""
    found = 1.0
    for side, sign in zip(unit.replace("kg.m2", "N.m.s2/rad").split("/"), (1, -1), strict=False):
        for word, power in re.findall(r"(N\.m|rad|s|K)(\d?)", side):
            found *= shrunk[word] ** (sign * int(power or 1))
    return found


def in_smaller_units(sizes, shrunk):
    units = {
        "N.m": ("force", "residual", "largest", "load"),
        "rad": ("travel",),
        "rad/s": ("speed",),
        "N.m/rad": ("stiffness",),
        "N.m.s/rad": ("damping",),
    }
    return replace(
        sizes,
        **{
            name: getattr(sizes, name) * in_smaller(unit, shrunk)
            for unit, names in units.items()
            for name in names
        },
    )


def torques(law, sizes):
    """Return the torque of a law over a motion through a whole range of position and speed."""
    way = np.array([[-0.9, -0.4, 0.1, 0.3, 0.7, 1.0]])
    state = PortState(
        sizes.travel * way,
        sizes.speed * way[:, ::-1],
        lambda order: 2.0 * order * way,
        np.array([[sizes.stiffness]]),
        load=sizes.load * way,
        temperature=310.0,
    )
    return np.asarray(law.respond(state).torque)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda one: one.name)
def test_every_unknown_is_a_number_with_a_stated_unit(effect):
    """A ripple of several orders was told without N.m, its unit in verdict.json was 1."""
    for sizes in FORMS:
        for guess in effect.guesses(sizes):
            stated = {**effect.of_fit, **effect.quantities, **guess.quantities}
            candidate = candidate_of(effect, guess, "bearing", "torque", LawAtPort)
            for one in guess.unknowns:
                name = one.line or one.name
                number = re.sub(r"^(second|third|fourth|fifth|order_[\d.]+)_", "", name)
                assert number in stated, name
                assert candidate.unit(name) == si_unit(stated[number])
                assert not one.line or candidate.unit("phase") == "rad"


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda one: one.name)
def test_a_torque_is_the_same_in_smaller_units(effect):
    """A law that takes all its numbers in smaller units returns its torque in them."""
    # The position of a weight is the argument of a sine, which only radians are.
    shrunk = SMALLER | {"rad": 1.0} if effect.name == "gravity" else SMALLER
    for sizes in FORMS:
        smaller = in_smaller_units(sizes, shrunk)
        for guess, again in zip(effect.guesses(sizes), effect.guesses(smaller), strict=True):
            unit = candidate_of(effect, guess, "bearing", "torque", LawAtPort).unit
            for begin in guess.begins:
                grown = [
                    value * in_smaller(unit(one.line or one.name), shrunk)
                    for value, one in zip(begin, guess.unknowns, strict=True)
                ]
                laws, others = effect.parts(guess, begin), effect.parts(again, grown)
                for (_, law), (_, other) in zip(laws, others, strict=True):
                    if hasattr(law, "respond"):
                        expected = shrunk["N.m"] * torques(law, sizes)
                        assert torques(other, smaller) == pytest.approx(expected, rel=2e-3)
