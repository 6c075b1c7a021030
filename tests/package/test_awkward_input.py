"""Malformed input that the fuzz campaign found, each with its clear refusal."""

import re
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from quick_campaigns import CONDITIONS
from virtual_rig_cases import BELIEVED, RIG

from experiments.studies.virtual_rig.rig import draw_rig, run_campaign
from pymoo_hdte.checks import InvalidInput, finite_array, whole_number
from pymoo_hdte.discrepancy import read_campaign, write_campaign
from pymoo_hdte.drive import load_datasheet
from pymoo_hdte.identification import error_statistics, read_no_load_runs
from pymoo_hdte.problems.operating_conditions import OperatingCondition, load_conditions, shares


@pytest.mark.parametrize(
    "text",
    ["a = " + "9" * 5000, "a = " + "[" * 5000 + "]" * 5000, "a = " + "{a = " * 2000],
    ids=["digits", "brackets", "braces"],
)
def test_a_table_that_python_cannot_parse_is_no_valid_toml(tmp_path, text):
    path = tmp_path / "sheet.toml"
    path.write_text(text)
    with pytest.raises(InvalidInput, match=r"sheet\.toml.*valid TOML"):
        load_datasheet(path)


def nested(depth):
    """A list within a list, and so on."""
    value = 1
    for _ in range(depth):
        value = [value]
    return value


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("x" * 10**6, 1),
        ("field", "x" * 10**6),
        ("field", np.arange(1000.0)),
        ("field", nested(100_000)),
        ("field", 10**5000),
    ],
    ids=["field", "text", "array", "depth", "digits"],
)
def test_a_message_is_one_line_that_can_be_read(field, value):
    error = InvalidInput(field, value, "nothing of the kind")
    assert len(str(error)) < 600
    assert "\n" not in str(error)
    assert str(error).startswith(field[:50])
    assert error.value is value


def test_huge_values_are_refused_like_others():
    with pytest.raises(InvalidInput, match="too large to print"):
        whole_number("n", -(10**5000), 1)
    with pytest.raises(InvalidInput, match="real numbers of shape"):
        finite_array("x", nested(100), (None,))


@pytest.mark.parametrize("value", [["1", "2"], [True, False], [b"1"], ["1", 2.0], [1j]])
def test_words_and_truth_values_are_no_numbers(value):
    with pytest.raises(InvalidInput, match=r"x is .*, allowed: real numbers of shape \(n\)"):
        finite_array("x", value, (None,))


@pytest.mark.parametrize(
    "value", [[1, 2], [1.5], [Fraction(1, 2)], np.arange(2, dtype=np.uint8), []]
)
def test_every_kind_of_number_is_one(value):
    assert finite_array("x", value, (None,)).tolist() == [float(one) for one in value]


def write(path, *lines):
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_cell_without_end_is_refused_with_its_line(tmp_path):
    path = write(tmp_path / "cycle.csv", "speed_rpm,load_Nm,weight", "x" * 200_000)
    with pytest.raises(InvalidInput, match=r"cycle\.csv, line 2: number of cells is 1"):
        load_conditions(path)


def test_weights_whose_sum_is_not_finite_are_refused(tmp_path):
    rows = ["200,40,1e308", "500,40,1e308"]
    path = write(tmp_path / "cycle.csv", "speed_rpm,load_Nm,weight", *rows)
    with pytest.raises(InvalidInput, match=r"line 2: weight is 1e\+308"):
        load_conditions(path)
    largest = OperatingCondition(1.0, 0.0, 1e15)
    np.testing.assert_array_equal(shares([largest] * 4), 0.25)


@pytest.mark.parametrize("torque", ["1e300", "-1e16"])
def test_torques_whose_fit_would_overflow_are_refused(tmp_path, torque):
    rows = [f"1,1,{speed},0.1" for speed in (200, 400, 600)]
    header = "prototype,repeat,speed_r_min,torque_Nm"
    path = write(tmp_path / "runs.csv", header, *rows, f"1,1,800,{torque}")
    with pytest.raises(InvalidInput, match=r"runs\.csv, line 5: torque_Nm is .* at most 1e\+15"):
        read_no_load_runs(path)


def test_a_single_error_is_not_asked_for_its_independence(rng):
    statistics = error_statistics(rng.normal(7.0, 0.5, (8, 1, 3)), ["e13"])
    assert statistics.advice() == ()
    assert "independence" in error_statistics(rng.normal(7.0, 0.5, (8, 2, 3)), "ab").advice()[-1]


@cache
def small_campaign():
    """A campaign of three running records and a sweep."""
    rng = np.random.default_rng(1)
    return run_campaign(draw_rig(BELIEVED, (), rng), BELIEVED, RIG, rng, CONDITIONS[4:7])


@pytest.mark.parametrize("value", ["[[0.7]]", "[0.7]", "[]", "[true]", "[" * 200 + "]" * 200])
@pytest.mark.parametrize("key", ["angle_noise_arcsec", "static_error_orders", "sample_rate_Hz"])
def test_lists_in_the_place_of_numbers_are_refused(tmp_path, key, value):
    write_campaign(small_campaign(), tmp_path / "rig")
    path = tmp_path / "rig" / "campaign.toml"
    written = rf"\n{key} = (\[[^]]*]|.*)"
    path.write_text(re.sub(written, f"\n{key} = {value}", path.read_text(), count=1))
    with pytest.raises(InvalidInput, match=r"campaign\.toml, line \d+: "):
        read_campaign(tmp_path / "rig")
