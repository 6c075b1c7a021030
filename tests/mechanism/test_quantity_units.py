"""Units of what is read off a mechanism: of shafts, of slides, and where nothing tells which."""

from types import SimpleNamespace

import pytest

from pymoo_hdte.discrepancy._report.mechanism_values import ripples
from pymoo_hdte.effects import effect_named
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port
from pymoo_hdte.mechanism.quantity_units import base_unit, unit_of_number

RIPPLE = {"order": 1.0, "amplitude": 1.0, "phase": 1.0}


def one_coordinate(angles):
    port = Port("bearing", {"q": 1.0}, damping=BelievedValue(1.0, 0.1))
    inertia = BelievedValue(1.0, 0.1)
    return Mechanism({"q": inertia}, [port], [Input("drive", {"q": 1.0})], angles=angles)


@pytest.mark.parametrize(
    ("angles", "units"),
    [
        (("q",), {"order": "1", "amplitude": "N.m", "phase": "rad"}),
        ((), {"order": "rad/m", "amplitude": "N", "phase": "rad"}),
        (None, {"order": "SI", "amplitude": "SI", "phase": "rad"}),
    ],
)
def test_a_ripple_beyond_the_band_has_the_units_of_its_port(angles, units):
    effect = {
        "name": "torque_ripple",
        "port": "bearing",
        "parameters": {name: {"value": value} for name, value in RIPPLE.items()},
    }
    found = SimpleNamespace(lines=[SimpleNamespace(as_dicts=lambda: [effect])])
    (one,) = ripples(SimpleNamespace(mechanism=one_coordinate(angles), ripples=found))
    assert {name: value["unit"] for name, value in one["parameters"].items()} == units


@pytest.mark.parametrize(
    ("quantity", "shaft", "slide"),
    [
        ("inertia of q", "kg.m2", "kg"),
        ("damping of bearing", "N.m.s/rad", "N.s/m"),
        ("stiffness of bearing", "N.m/rad", "N/m"),
        ("zero of bearing", "N.m", "N"),
    ],
)
def test_a_force_over_a_length_is_no_torque_over_an_angle(quantity, shaft, slide):
    assert base_unit(one_coordinate(("q",)), quantity) == shaft
    assert base_unit(one_coordinate(()), quantity) == slide
    assert base_unit(one_coordinate(None), quantity) == "SI"


def test_a_motor_whose_scale_is_not_known_gives_no_force_in_newtons():
    turning = one_coordinate(("q",))
    counted = Mechanism(
        turning.inertias, turning.ports, [Input("counts", {"q": 1.0}, scaled=False)], angles=("q",)
    )
    assert unit_of_number(counted, "bearing", "amplitude", "N.m") == "SI"


@pytest.mark.parametrize(("angles", "unit"), [(("q",), "N.m"), ((), "N"), (None, "SI")])
@pytest.mark.parametrize("line", ["amplitude", "second_amplitude", "order_2.02_amplitude"])
def test_a_line_of_a_ripple_is_a_force_whichever_its_order(line, angles, unit):
    of_shaft = effect_named("torque_ripple").unit(line)
    assert unit_of_number(one_coordinate(angles), "bearing", line, of_shaft) == unit
    assert unit_of_number(one_coordinate(angles), "bearing", f"{line}_phase", "1") == "rad"
