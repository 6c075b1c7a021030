"""A form that is tried only in the place of a listed one: a loop that forgets, for springs."""

from dataclasses import replace

import numpy as np
import pytest
from planted_features import FEW, judged, library, measured, with_sweep

from pymoo_hdte.drive import KinematicReaction, LawAtPort
from pymoo_hdte.effects.bouc_wen import BoucWen
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.units import ARCSEC

LOOP, REACTION = "hysteresis/bouc_wen:mesh", "kinematic_reaction:input"
FORCE = 1.5


def at_the_mesh(law):
    name = "hysteresis" if isinstance(law, MaxwellSlip) else "bouc_wen_hysteresis"
    return LawAtPort(name, "mesh", law)


HIDDEN = (at_the_mesh(BoucWen(FORCE, 8e-5, 1.5, 0.6)), KinematicReaction(1.0))


@pytest.fixture(scope="module")
def data():
    rng = np.random.default_rng(3)
    return with_sweep(measured(HIDDEN, rng, FEW)[0], HIDDEN[:1], rng)


def laws_of(data):
    return [one for one in library(data) if one.name in ("hysteresis", "kinematic_reaction")]


@pytest.mark.nightly
def test_a_loop_that_forgets_is_named_with_what_stands_beside_it(data):
    found = judged(data, laws_of(data))
    labels = [one.label for one in found.chosen.candidates]
    assert (found.status, sorted(labels)) == ("named", [LOOP, REACTION])
    place = next(place for one, place in found.chosen.fit.places if one.label == LOOP)
    deviation = np.sqrt(np.diag(found.chosen.fit.covariance)[place][0])
    assert found.chosen.fit.values[place][0] == pytest.approx(FORCE, abs=3.0 * deviation)


def test_what_creeps_in_a_record_is_noise_beside_such_a_loop():
    """Of any size up to that of the force, at any rate; the rest tells as much as before."""
    records, lines = FEW.features.values.shape[0], len(FEW.features.orders)
    rng = np.random.default_rng(1)
    fading = 0.3 * rng.standard_normal((records, 2, 1 + lines, 2)) @ [1.0, 1j]
    when = replace(FEW.features.conditions, fading=fading)
    plain = replace(FEW, features=replace(FEW.features, conditions=when))
    creeping = replace(plain, reference_effects=HIDDEN[:1])
    stiff = replace(plain, reference_effects=(at_the_mesh(MaxwellSlip(FORCE, 8e-5)),))

    def chi_square(data, change):
        return float(np.sum(data.whiten(change) ** 2))

    size = FORCE / FEW.campaign.believed.stiffness
    places = FEW.features.places(0)
    left = np.zeros(FEW.features.values.shape)
    for share, way in ((0.7, fading[:, 0]), (-0.4, fading[:, 1])):
        left[:, 0] += share * size * way[:, 0].real
        left[:, places[:, 0]] += share * size * way[:, 1:].real
        left[:, places[:, 1]] += share * size * way[:, 1:].imag
    left[:, 0] += 0.5 * size
    # Its shares of the whole force, squared, for each record; and a thousand deviations without.
    assert chi_square(creeping, left) < 1.01 * records * (0.7**2 + 0.4**2 + 0.5**2)
    assert min(chi_square(plain, left), chi_square(stiff, left)) > 1e4
    # The torques do not creep.
    ripple = np.zeros_like(left)
    ripple[:, FEW.features.places(1)] = 1e-4
    assert chi_square(creeping, ripple) == pytest.approx(chi_square(plain, ripple), rel=0.2)
    assert size > 10.0 * ARCSEC
