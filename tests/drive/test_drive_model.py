"""Presets and model files: what they hold, and every way to get a file wrong."""

import json
from importlib.resources import files

import numpy as np
import pytest
from night import others_at_night
from scipy.stats import truncnorm

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import hs_20_100, load_model, preset
from pymoo_hdte.units import ARCSEC

TEXT = (files("pymoo_hdte.drive") / "data" / "calibrated.toml").read_text(encoding="utf-8")

PUBLISHED_OPTIMA = {
    "accuracy_first": (3.229e4, 1.496e-4, 1.891e-4, 4.968e-4),
    "balanced": (2.998e4, 2.282e-4, 1.887e-4, 3.405e-4),
    "robustness_first": (2.941e4, 2.305e-4, 1.739e-4, 3.416e-4),
}
PUBLISHED_MEANS = {"accuracy_first": 85.506, "balanced": 85.990, "robustness_first": 86.458}
PUBLISHED_STDS = {"accuracy_first": 16.233, "balanced": 15.773, "robustness_first": 15.637}


@pytest.mark.parametrize("preference", others_at_night(PUBLISHED_OPTIMA, "balanced"))
def test_calibrated_keeps_its_stated_residuals_on_table_8(preference, rng):
    """Within 2 % of the published means and stds, which went through a surrogate."""
    model = preset("calibrated")
    n = 5_000
    theta_s = model.nominal[0] + model.kinematic_error.std * truncnorm.rvs(
        -3, 3, size=n, random_state=rng
    )
    bands = PUBLISHED_OPTIMA[preference] * rng.uniform(0.95, 1.05, (n, 4))
    dte = model.dte_arcsec(np.column_stack([theta_s, bands]))
    sampling = 4 * dte.std() / np.sqrt(n)
    assert abs(dte.mean() - PUBLISHED_MEANS[preference]) < 0.02 * dte.mean() + sampling
    assert abs(dte.std() - PUBLISHED_STDS[preference]) < 0.02 * dte.std() + sampling


def test_theta_s_is_what_its_reading_says():
    for name, factor in (("published", 1.0), ("calibrated", 2.0)):
        model = preset(name)
        phasors = model.coefficients(model.nominal[None]).error_phasors
        angle = np.linspace(0.0, 2 * np.pi * 101, 400_001)
        lines = np.exp(1j * np.outer(np.array(model.kinematic_error.orders), angle))
        signal = (phasors @ lines).real[0]
        peak_to_peak = signal.max() - signal.min()
        assert peak_to_peak == pytest.approx(factor * 36.251 * ARCSEC, rel=1e-5)


def test_record_of_a_model_is_json_and_tells_models_apart():
    records = [json.dumps(preset(name).to_dict()) for name in ("calibrated", "resonant")]
    assert records[0] != records[1]
    assert json.loads(records[0])["effects"][1] == {"name": "damping_reference", "factor": 4.011}


def test_at_changes_the_operating_condition_only():
    model = preset("calibrated")
    other = model.at(100.0, 10.0)
    assert (other.sheet.input_speed, other.sheet.load_torque) == (100.0, 10.0)
    assert other.sheet.nominal == model.sheet.nominal
    assert other.effects == model.effects


@pytest.mark.parametrize(
    ("old", "new", "field", "allowed"),
    [
        ('name = "damping_reference"', 'name = "damping"', "effect[1].name", "'load_inertia'"),
        ("factor = 4.011", "", "effect[1].factor", "missing"),
        ("factor = 4.011", "factor = 0", "damping_reference.factor", "above 0"),
        ("factor = 4.011", "factor = 4\nsize = 1", "effect[1].size", "no such field"),
        ("depth = 0.03006", "depth = 1.5", "mesh_stiffness_variation.depth", "below 1"),
        ('{ value = 3.852, unit = "rad" }', "3.852", "effect[2].phase", "unit"),
        ("orders = [1.0, 2.0, 2.02]", "orders = [1.0, 2.0]", "amplitudes", "(2)"),
        ("orders = [1.0, 2.0, 2.02]", "orders = [0.0, 2.0, 2.02]", "orders", "above 0"),
        ("orders = [1.0, 2.0, 2.02]", 'orders = "1, 2"', "orders", "list of numbers"),
        ("amplitudes = [0.8405, 1.0, 0.4736]", "amplitudes = [0, 0, 0]", "amplitudes", "not all 0"),
        ("phases = [0.0, 4.233, 1.764]", "phases = [0.0, nan, 1.764]", "phases[1]", "finite"),
        ('reading = "semi_amplitude"', 'reading = "rms"', "reading", "'peak_to_peak'"),
        ("value = 7.126", "value = 0", "kinematic_error.std", "above 0"),
        ('name = "mesh_stiffness_variation"\ndepth = 0.03006\n'
         'phase = { value = 3.852, unit = "rad" }',
         'name = "damping_reference"\nfactor = 2', "effects", "each effect once"),
    ],
)  # fmt: skip
def test_bad_model_files_are_explained(tmp_path, old, new, field, allowed):
    assert old in TEXT
    path = tmp_path / "model.toml"
    path.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        load_model(path, hs_20_100())
    assert field in str(caught.value)
    assert allowed in str(caught.value)


def test_a_static_error_in_arcsec_is_not_taken_for_radians():
    model = preset("calibrated")
    design = model.nominal / np.array([ARCSEC, 1, 1, 1, 1])
    with pytest.raises(InvalidInput, match=r"theta_s is 36\.251.*not given in arcsec"):
        model.dte_arcsec(design[None])


def test_unknown_presets_are_refused():
    with pytest.raises(InvalidInput, match="model is 'measured', allowed: one of 'published'"):
        preset("measured")
