"""A static error that changes between series of measurements: what solvers make of the time."""

from dataclasses import replace

import numpy as np
import pytest

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import (
    ChangedStaticError,
    KinematicErrorLine,
    LoadDependentError,
    harmonic_balance,
    preset,
)
from pymoo_hdte.drive._effects import effect_from_fields
from pymoo_hdte.drive.dte_map import critical_speeds
from pymoo_hdte.units import ARCSEC

LINE = ChangedStaticError(3.0, 2.0 * ARCSEC, 0.7, after=900.0)
SAME = KinematicErrorLine(3.0, 2.0 * ARCSEC, 0.7)
GROWING = LoadDependentError(2.0, 1.0 * ARCSEC, 0.2, reference=40.0)


def with_effects(model, *effects):
    return replace(model, effects=(*model.effects, *effects))


def test_records_of_the_first_series_lack_the_line_and_later_ones_have_it():
    model = with_effects(preset("resonant"), GROWING)
    elapsed = np.array([0.0, 1800.0, 899.0, 900.0])
    rows = np.repeat(model.nominal[None], 4, axis=0)
    changing = replace(with_effects(model, LINE).coefficients(rows), elapsed=elapsed)
    loads = np.array([40.0, 10.0, 0.0, -20.0])
    found = harmonic_balance(changing, load_torque=loads)
    without, having = (
        harmonic_balance(form.coefficients(rows), load_torque=loads, torus=found.torus)
        for form in (model, with_effects(model, SAME))
    )
    late = np.array([[False], [True], [False], [True]])
    for name in ("transmission_error", "motor_torque", "coupling_torque"):
        expected = np.where(late, getattr(having, name), getattr(without, name))
        size = np.abs(expected).max()
        assert getattr(found, name) == pytest.approx(expected, abs=1e-9 * size)


def test_a_model_without_a_session_is_the_drive_of_the_last_series():
    models = [with_effects(preset("calibrated"), line) for line in (LINE, SAME)]
    spectra = [model.steady_state(model.nominal[None]) for model in models]
    assert spectra[0].phasors == pytest.approx(spectra[1].phasors, rel=1e-12)
    assert critical_speeds(models[0]) == critical_speeds(models[1])


def test_a_model_file_keeps_it():
    assert effect_from_fields(Fields(LINE.to_dict(), "effect")) == LINE


@pytest.mark.parametrize("wrong", [{"order": 0.0}, {"after": np.nan}, {"amplitude": np.inf}])
def test_numbers_that_mean_nothing_are_refused(wrong):
    with pytest.raises(InvalidInput, match=r"changed_static_error\."):
        replace(LINE, **wrong)
