"""A column in another unit, sign or ratio is refused with the factor that mends it."""

import math
import re

import numpy as np
import pytest
from small_campaigns import small_campaign

from pymoo_hdte.checks import InvalidInput, SeveralComplaints
from pymoo_hdte.discrepancy import read_campaign, write_campaign
from pymoo_hdte.discrepancy._records.likely_causes import likely_ratio, likely_unit
from pymoo_hdte.units import DEGREE, FOREIGN, UNITS

COLUMNS = {
    "input_angle_rad": (0, "rad"),
    "output_angle_rad": (1, "rad"),
    "input_torque_Nm": (2, "N.m"),
    "output_torque_Nm": (3, "N.m"),
}


def refused(folder, **stated):
    """Return the message for a campaign whose columns are stated in these units and scales."""
    write_campaign(small_campaign(), folder)
    rows = [
        f"{name} = {{ column = '{column}', {words} }}" for name, (column, words) in stated.items()
    ]
    toml = folder / "campaign.toml"
    text = toml.read_text() + "\n[table.channels]\n" + "\n".join(rows)
    toml.write_text(text)
    with pytest.raises(InvalidInput) as caught:
        read_campaign(folder)
    return caught.value


@pytest.mark.parametrize(
    ("channel", "words", "cause"),
    [
        ("output_torque", "unit = 'N.m', scale = 1000.0", "'mN.m'"),
        ("output_torque", "unit = 'mN.m'", "is the column in 'N.m'"),
        ("output_torque", "unit = 'N.m', scale = -1.0", "scale = -1.0 missing"),
        ("input_torque", "unit = 'N.m', scale = 1000.0", "'mN.m'"),
        ("input_angle", "unit = 'deg'", "'rad' and not in 'deg'"),
        ("input_angle", "unit = 'rad', scale = 57.29577951", "is the column in 'deg'"),
        ("input_angle", "unit = 'rad', scale = -1.0", "scale = -1.0 missing"),
        ("output_angle", "unit = 'rad', scale = -1.0", "scale = -1.0 missing"),
        ("output_angle", "unit = 'rad', scale = 57.29577951", "output_angle.*'deg'"),
        ("output_angle", "unit = 'rad', scale = 0.5", "ratio of 100: is believed.ratio 100"),
    ],
)
def test_a_factor_is_told_with_its_cause(channel, words, cause, tmp_path):
    unit = "rad" if "angle" in channel else "Nm"
    error = refused(tmp_path / "rig", **{channel: (f"{channel}_{unit}", words)})
    assert re.search(cause, str(error))


def test_every_record_that_is_wrong_is_told_at_once(tmp_path):
    error = refused(
        tmp_path / "rig", output_torque=("output_torque_Nm", "unit = 'N.m', scale = 1000.0")
    )
    assert isinstance(error, SeveralComplaints)
    named = {re.match(r"\w+", one.field)[0] for one in error.complaints}
    assert {"slow", "back"} <= named
    assert len(str(error).splitlines()) == len(error.complaints)


def test_a_foot_pound_is_told_either_way():
    foot_pound = FOREIGN["lbf.ft"][1]
    assert "the column in lbf.ft" in likely_unit("torque", 1.0 / foot_pound)
    assert "1.3558 there once too often" in likely_unit("torque", foot_pound)


@pytest.mark.parametrize("quantity", ["angle", "torque"])
def test_the_unit_that_a_column_is_in_is_among_those_told(quantity):
    for unit, size in UNITS[quantity].items():
        if size != 1.0:
            assert repr(unit) in likely_unit(quantity, 1.0 / size)
            assert f"not in {unit!r}" in likely_unit(quantity, size) or unit in ("N.mm", "mN.m")
    assert likely_unit(quantity, 1.0) == likely_unit(quantity, 3.3) == ""
    assert likely_unit(quantity, math.nan) == likely_unit(quantity, 0.0) == ""


def test_the_ratio_of_the_angles_is_told():
    rng = np.random.default_rng(2)
    for ratio in rng.uniform(30.0, 320.0, 50):
        assert likely_ratio(ratio, ratio) == ""
        assert f"{2.5 * ratio:.5g}" in likely_ratio(2.5 * ratio, ratio)
        assert "'deg'" in likely_ratio(ratio * DEGREE, ratio)
