"""Relative errors of laws: processes of the stated size, and tangents of scaled laws."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from planted_features import measured

from pymoo_hdte.discrepancy._evidence.order_lines.law_errors import LawErrors, ScaledLaw
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.process import TERMS, sine_of, sines_of
from pymoo_hdte.drive import LawAtPort
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.law import PortState, periodic_phase
from pymoo_hdte.effects.stiffness import HardeningStiffness, SoftWindup

PLACES = np.linspace(-1.0, 1.0, 41)


def test_an_error_has_the_stated_deviation_wherever_it_is():
    assert np.sum(sines_of(PLACES) ** 2, axis=1) == pytest.approx(np.ones(41), abs=0.02)


def test_further_sines_have_hardly_any_size():
    further = sum(sine_of(number, PLACES)[0] ** 2 for number in range(TERMS + 1, 2 * TERMS + 1))
    assert np.max(further) < 0.02


@given(st.floats(-0.9, 0.9), st.integers(1, TERMS))
def test_tangents_are_those_of_the_torque(place, number):
    state_of = lambda x: PortState(  # noqa: E731
        np.array([x]), np.array([0.3]), periodic_phase(np.array([x])), np.array([2.6e4])
    )
    for law in (HardeningStiffness(2e9), SoftWindup(0.3, 3e-4, 3.0)):
        scaled, travel = ScaledLaw(law, 1e-3, number, 0.01), 1e-3
        at, step = place * travel, 1e-6 * travel
        ahead, behind = (scaled.respond(state_of(at + sign * step)).torque for sign in (1, -1))
        slope = np.asarray(scaled.respond(state_of(at)).slope)
        size = max(abs(float(slope[0])), 1.0)
        assert (ahead - behind) / (2.0 * step) == pytest.approx(slope, abs=1e-4 * size)


def test_only_the_static_error_may_repeat_worse_than_stated():
    """Noise of the model had the same unknown scale: a thousand unknowns where seven are."""
    friction = LawAtPort("coulomb_friction", "input", CoulombFriction(0.02))
    data = replace(measured()[0], reference_effects=(friction,))
    sized = LawErrors(data, fit(data))._of_error
    lines, (n_records, _) = len(data.campaign.believed.error_orders), data.features.values.shape
    assert sized.columns.shape[1] == n_records * (2 * lines + 1)
    # Each part of the error moves what the covariance says it does.
    record = slice(0, 2 * lines + 1)
    moved = np.einsum(
        "ij,jv->iv", data.whiteners[0], sized.columns[: data.features.values.shape[1], record]
    )
    of_error = (
        data.covariance[0] - data._of_sensors(data._start)[0] - data._of_model(data._start)[0]
    )
    assert moved @ moved.T == pytest.approx(of_error, rel=1e-5, abs=1e-20)
