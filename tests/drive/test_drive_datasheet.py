"""The data sheet: Table 4 and Table 2 as printed, and every way to get it wrong."""

import math
from dataclasses import FrozenInstanceError, replace
from importlib.resources import files

import pytest

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import hs_20_100, load_datasheet

TEXT = (files("pymoo_hdte.drive") / "data" / "hs_20_100.toml").read_text(encoding="utf-8")


def test_holds_table_4_in_si_units():
    sheet = hs_20_100()
    assert sheet.ratio == 101.0
    assert sheet.input_speed == pytest.approx(2000 * math.pi / 30)
    assert sheet.load_torque == 40.0
    nominal = sheet.nominal
    assert nominal.static_error * 648000 / math.pi == pytest.approx(36.251)
    assert (nominal.stiffness, nominal.input_inertia, nominal.output_inertia) == (
        2.583e4,
        1.970e-4,
        8.505e-4,
    )
    assert (nominal.input_damping, nominal.mesh_damping, nominal.output_damping) == (
        1.700e-4,
        4.465e-4,
        5.022e-4,
    )


def test_holds_thirteen_sources_with_the_sums_of_table_2():
    sources = hs_20_100().error_sources
    assert len(sources) == 13
    assert sum(source.mean for source in sources) == pytest.approx(88.51e-6)
    assert sum(source.std for source in sources) == pytest.approx(13.43e-6)
    assert sorted({source.component for source in sources}) == ["CS", "FB", "FS", "WG"]


def test_orders_follow_from_the_teeth():
    orders = hs_20_100().error_orders
    assert orders == {"e_m": 2.0, "e_g": 2.02, "e_w": 1.0, "e_p": 2.0, "e_h": 404.0}


def test_without_a_word_the_circular_spline_is_held(tmp_path):
    lines = [one for one in TEXT.splitlines() if "held =" not in one]
    path = tmp_path / "sheet.toml"
    path.write_text("\n".join(lines))
    # 200 and 202 teeth.
    assert load_datasheet(path).ratio == 100.0


@pytest.mark.parametrize(
    ("held", "ratio", "of_output", "of_teeth"),
    [("circular_spline", 50.0, 2.04, 204.0), ("flexspline", 51.0, 2.0 * 100 / 102, 200.0)],
)
def test_ratio_and_orders_follow_from_the_held_member(held, ratio, of_output, of_teeth):
    sheet = replace(
        hs_20_100(),
        flexspline_teeth=100,
        circular_spline_teeth=102,
        held=held,
        orders_as_held=None,
    )
    assert sheet.ratio == pytest.approx(ratio, rel=1e-15)
    orders = sheet.error_orders
    assert orders == pytest.approx(
        {"e_m": 2, "e_g": of_output, "e_w": 1, "e_p": 2, "e_h": of_teeth}
    )
    # Either end passes errors of the output as often as the wave generator turns against it.
    turn = {"circular_spline": -1.0, "flexspline": 1.0}[held] / ratio
    assert orders["e_g"] == pytest.approx(2.0 * (1.0 - turn), rel=1e-14)
    # In one turn of the generator against the output, as many of its teeth mesh as it has.
    teeth = {"circular_spline": 100, "flexspline": 102}[held]
    assert orders["e_g"] * teeth == pytest.approx(orders["e_h"], rel=1e-14)


def test_the_paper_has_the_ratio_of_one_arrangement_and_the_orders_of_the_other():
    sheet = hs_20_100()
    assert (sheet.held, sheet.orders_as_held) == ("flexspline", "circular_spline")
    other = replace(sheet, held="circular_spline", orders_as_held=None)
    assert (other.ratio, other.error_orders) == (100.0, sheet.error_orders)


def test_the_twist_at_the_rated_load_tells_a_lost_power_of_ten(tmp_path):
    path = tmp_path / "hs.toml"
    for lost, refused in ((1.0, False), (1e-1, False), (1e-4, True)):
        path.write_text(TEXT.replace("2.583e4", f"{2.583e4 * lost}"), encoding="utf-8")
        if refused:
            with pytest.raises(InvalidInput, match=r"nominal.stiffness is 2.583.*10\^4 N.m/rad"):
                load_datasheet(path)
        else:
            load_datasheet(path)


def test_is_immutable():
    with pytest.raises(FrozenInstanceError):
        hs_20_100().nominal.stiffness = 1.0


STIFFNESS = 'stiffness = { value = 2.583e4, unit = "N.m/rad" }'


@pytest.mark.parametrize(
    ("old", "new", "field", "allowed"),
    [
        (STIFFNESS, "", "nominal.stiffness", "missing"),
        (STIFFNESS, "stiffness = 2.583e4", "nominal.stiffness", "unit"),
        (STIFFNESS, "stiffness = { value = 2.583e4 }", "nominal.stiffness", "unit"),
        (STIFFNESS, 'stiffness = { value = 1, unit = "N/m" }', "stiffness.unit", "N.m/rad"),
        (STIFFNESS, 'stiffness = { value = -1, unit = "N.m/rad" }', "stiffness.value", "above 0"),
        (STIFFNESS, 'stiffness = { value = nan, unit = "N.m/rad" }', "stiffness.value", "finite"),
        (STIFFNESS, 'stiffness = { value = inf, unit = "N.m/rad" }', "stiffness.value", "finite"),
        (STIFFNESS, 'stiffness = { value = "2", unit = "N.m/rad" }', "stiffness.value", "number"),
        (STIFFNESS, 'stiffness = { value = true, unit = "N.m/rad" }', "stiffness.value", "number"),
        (STIFFNESS, STIFFNESS + "\nstifness = 1", "nominal.stifness", "no such field"),
        ("flexspline = 200", "flexspline = 203", "teeth.circular_spline", "204"),
        ("flexspline = 200", "flexspline = 200.5", "teeth.flexspline", "whole number"),
        ("flexspline = 200", "flexspline = 201", "teeth.circular_spline", "likely a tooth number"),
        ('held = "flexspline"', 'held = "housing"', "teeth.held", "'circular_spline'"),
        ('as_held = "circ', 'as_held = "c', "teeth.orders_as_held", "'circular_spline'"),
        ('class = "e_h"', 'class = "e_x"', "error class of dfi1", "'e_m'"),
        ('symbol = "dfi1"', 'symbol = "dFp1"', "symbols", "each symbol once"),
        ('symbol = "dfi1"', 'symbol = ""', "error_source[1].symbol", "non-empty"),
        ("teeth_in_mesh = 50", "teeth_in_mesh = 0", "mesh.teeth_in_mesh", "at least 1"),
        ("[teeth]", "[tooth]", "teeth", "missing; is it 'tooth'?"),
        ("[teeth]", "[teeth]\nmodule = 1", "teeth.module", "no such field"),
        ("[rated]", "[rated]\npower = 1", "rated.power", "no such field"),
        ("value = 20, unit", "value = 95, unit", "pressure_angle", "below 1.5"),
        (
            STIFFNESS,
            f'stiffness = {{ value = 1{"0" * 400}, unit = "N.m/rad" }}',
            "stiffness.value",
            "finite",
        ),
        ("value = 0.89", "value = -0.89", "error_source[0].std.value", "at least 0"),
        ("value = 2000", "value = 0", "rated.input_speed.value", "above 0"),
        ("[teeth]", "[teeth", "hs.toml", "valid TOML"),
    ],
)
def test_bad_fields_are_named_with_what_is_allowed(tmp_path, old, new, field, allowed):
    assert old in TEXT
    path = tmp_path / "hs.toml"
    path.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        load_datasheet(path)
    assert field in str(caught.value)
    assert allowed in str(caught.value)
    assert caught.value.field.startswith("hs.toml")


def test_the_line_of_a_bad_field_is_told(tmp_path):
    path = tmp_path / "hs.toml"
    path.write_text(TEXT.replace("circular_spline = 202", "circular_spline = 201", 1))
    line = 1 + path.read_text().splitlines().index("circular_spline = 201")
    with pytest.raises(
        InvalidInput, match=rf"hs\.toml, line {line}: teeth\.circular_spline is 201"
    ):
        load_datasheet(path)
