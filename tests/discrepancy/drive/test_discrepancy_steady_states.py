"""Steady states of records: those without one, and what nearby values begin from."""

from dataclasses import replace

import numpy as np
import pytest
from planted_features import known_data

from pymoo_hdte.discrepancy.drive.steady_states import merged
from pymoo_hdte.discrepancy.engine.candidate import Layout
from pymoo_hdte.drive.effects import LawAtPort
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.stiffness import SoftWindup


@pytest.fixture(scope="module")
def data():
    return known_data()


@pytest.fixture(scope="module")
def softening():
    return (LawAtPort("soft_windup", "mesh", SoftWindup(0.3, 5e-4, 4.0)),)


def test_a_record_without_a_steady_state_makes_no_slope_of_the_jump(data, softening):
    """A quotient of a prediction with the law and one without would tell of the law's size."""
    records = len(data.features.records)
    values = Layout(data.base).array("start")[None]
    here = data.prediction(values, softening)
    lost = np.arange(records) == 2
    start = replace(here.balance.rows(slice(records)), converged=~lost)
    there = data.prediction(values, softening, start, for_slopes=True)
    assert np.array_equal(there.balance.converged, ~lost)
    plain = data.features.of_prediction(data.prediction(values, ()))[0]
    with_law = data.features.of_prediction(here)[0]
    found = data.features.of_prediction(there)[0]
    assert np.allclose(found[lost], plain[lost], rtol=1e-5, atol=1e-9)
    assert np.allclose(found[~lost], with_law[~lost], rtol=1e-5, atol=1e-9)
    assert not np.allclose(plain[lost], with_law[lost], rtol=1e-2, atol=1e-7)
    # What is not for slopes is tried anew.
    assert data.prediction(values, softening, start).balance.converged.all()


def test_merged_rows_keep_their_own_tangents(data):
    values = Layout(data.base).array("start")[None]
    # Memory needs a matrix for every row.
    springs = (LawAtPort("hysteresis", "mesh", MaxwellSlip(5.0, 1e-4)),)
    whole = data.prediction(values, springs).balance
    places = [np.array([0, 3]), np.array([1, 2])]
    found = merged([whole.rows(rows) for rows in places], places)
    for mine, own in zip(found.tangents.factors(), whole.tangents.factors()[:4], strict=True):
        assert all(np.array_equal(one, other) for one, other in zip(mine, own, strict=True))
