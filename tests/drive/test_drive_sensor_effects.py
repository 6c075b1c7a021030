"""Sensor effects: what they add to a reading, and that they leave the motion alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import Eccentricity, NewZero, ThermalDrift, harmonic_balance, preset
from pymoo_hdte.drive._effects import Session, drive_effects, effect_from_fields
from pymoo_hdte.units import ARCSEC

EFFECTS = [
    Eccentricity(5.0 * ARCSEC, 0.7),
    Eccentricity(1e-5, 0.2, 46.0),
    ThermalDrift(2e-9),
    ThermalDrift(2e-9, 600.0),
    NewZero(1e-5, 600.0),
]
phases = st.floats(-np.pi, np.pi)


@given(phases, st.floats(0.0, 1e-4), st.integers(1, 30))
def test_a_disc_adds_one_line_of_its_order(phase, amplitude, order):
    session = Session(np.arange(1, 31) / 101.0, 101.0, np.zeros(1), np.zeros((1, 3, 31)))
    mean, lines = Eccentricity(amplitude, phase, order).reading_lines(session)
    assert mean == 0.0
    assert lines[0, order - 1] == pytest.approx(amplitude * np.exp(1j * phase))
    assert np.count_nonzero(np.delete(lines, order - 1)) == 0


def test_a_new_zero_holds_from_its_time_on():
    read = NewZero(1e-5, 600.0).added(np.array([0.0, 599.0, 600.0, 1e4]))
    np.testing.assert_array_equal(read, [0.0, 0.0, 1e-5, 1e-5])


@given(st.floats(100.0, 1e4), st.floats(0.0, 1e4))
def test_a_drift_that_settles_starts_at_its_rate_and_bends(time, elapsed):
    drift, steady = ThermalDrift(3e-9, time), ThermalDrift(3e-9)
    assert drift.added(1e-6 * time) == pytest.approx(steady.added(1e-6 * time), rel=2e-6)
    assert drift.added(50.0 * time) == pytest.approx(3e-9 * time)
    step = 1e-2 * time
    near = drift.added(elapsed + step * np.arange(-2, 3))
    second, third, fourth = drift.bends(np.array([elapsed]))[:, 0]
    scale = abs(second)
    assert np.diff(near[1:4], 2)[0] / step**2 == pytest.approx(
        second, abs=1e-3 * scale + 1e-9 * abs(near[0]) / step**2
    )
    assert third * time == pytest.approx(-second)
    assert fourth * time == pytest.approx(-third)
    assert np.all(steady.bends(np.array([elapsed])) == 0.0)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_the_motion_stays_as_it_is(effect):
    model = preset("published")
    coefficients = model.coefficients(model.nominal[None])
    plain, with_effect = (harmonic_balance(c) for c in (coefficients, effect.apply(coefficients)))
    np.testing.assert_array_equal(with_effect.transmission_error, plain.transmission_error)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_tables_are_read_back(effect):
    assert effect.name in [one.name for one in drive_effects()]
    assert effect.port == "sensor"
    assert effect_from_fields(Fields(effect.to_dict(), "effect")) == effect


@pytest.mark.parametrize(
    ("build", "field"),
    [
        (lambda: Eccentricity(np.inf, 0.0), "eccentricity.amplitude"),
        (lambda: Eccentricity(1e-5, "north"), "eccentricity.phase"),
        (lambda: ThermalDrift(np.nan), "thermal_drift.rate"),
        (
            lambda: effect_from_fields(
                Fields({"name": "thermal_drift", "rate": {"value": 1.0, "unit": "K"}}, "effect")
            ),
            "effect.rate.unit",
        ),
    ],
)
def test_bad_fields_are_named(build, field):
    with pytest.raises(InvalidInput) as caught:
        build()
    assert caught.value.field == field
