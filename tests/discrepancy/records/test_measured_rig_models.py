"""Models of rigs as text: what is written reads back the same, or is not written."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from law_cases import LAWS

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._records.rig_model import (
    MechanismModel,
    model_text,
    read_mechanism_model,
)
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.effects.linear import ConstantForce
from pymoo_hdte.effects.stiffness import PeriodicClearance
from pymoo_hdte.mechanism import (
    BelievedValue,
    ErrorLine,
    Gear,
    Input,
    LawAt,
    Loop,
    Mechanism,
    Port,
)
from pymoo_hdte.mechanism.effects import law_effects
from pymoo_hdte.mechanism.gear import KINDS

RIG = Mechanism(
    {"q": BelievedValue(2.0)},
    [Port("joint", {"q": 1.0}), Port("cell", {"q": 0.5}, read=True, load={"brake": 1.0})],
    [Input("brake", {"q": -1.0})],
)
READING = {"order": 3.0, "phase": 0.5, "amplitude": 0.1}
ERROR = effect_named("kinematic_error").law_of(READING)
FRICTION = effect_named("coulomb_friction").law_of({"level": 20.4})


def through_file(folder, *parts):
    (folder / "model.toml").write_text(model_text(MechanismModel(*parts)), encoding="utf-8")
    return read_mechanism_model(folder / "model.toml")


@pytest.mark.parametrize("known", law_effects(), ids=lambda known: known.name)
def test_every_effect_survives_the_file(known, tmp_path):
    values = {one: 1.0 / (3.0 + index) for index, one in enumerate(known.quantities)}
    for one in {"sharpness", "exponent"} & set(values):
        values[one] += 1.0
    effect = LawAt(known.name, "cell", known.law_of(values))
    assert known.numbers_of(effect.law) == values
    assert through_file(tmp_path, "x", RIG, [effect]) == MechanismModel("x", RIG, (effect,))


def test_registry_is_that_of_the_drive_and_six_more():
    extra = {"force_offset", "direction_dependent_friction", "kinematic_error"}
    extra |= {"linear_stiffness", "viscous_friction", "gravity"}
    # Ports of a mechanism know no temperature, and contacts that bend are a hysteresis there.
    of_motion = set(LAWS) - {"temperature_dependent_friction", "presliding_friction"}
    assert {one.name for one in law_effects()} == of_motion | extra
    locked = PeriodicClearance(2.0, 0.0, 1e-4, 0.0, 5e-5)
    assert "locked" not in effect_named("clearance_variation").numbers_of(locked)


NAMES = st.text(min_size=1, max_size=6)
BELIEVED = st.builds(BelievedValue, st.floats(1e-300, 1e300), st.floats(0.0, 1.0))
FINITE = st.floats(allow_nan=False, allow_infinity=False)


@given(
    names=st.lists(NAMES, min_size=4, max_size=4, unique=True),
    title=NAMES.filter(str.strip),
    values=st.lists(BELIEVED, min_size=4, max_size=4),
    numbers=st.lists(FINITE, min_size=5, max_size=5),
    share=FINITE.filter(bool),
    limit=st.floats(0.0, exclude_min=True),
    read=st.booleans(),
    gear=st.none()
    | st.builds(Gear, st.floats(1.0, 1e300), st.sampled_from(KINDS), st.integers(0, 99)),
)
def test_any_model_survives_the_file(
    tmp_path_factory, names, title, values, numbers, share, limit, read, gear
):
    first, second, port, signal = names
    mechanism = Mechanism(
        {first: values[0], second: values[1]},
        [
            Port(
                port,
                # A gear is at a port of one shaft.
                {second: share, first: 0.0 if gear else numbers[0]},
                stiffness=values[2],
                read=read,
                error=(ErrorLine(second, *numbers[1:4]), ErrorLine(first, *numbers[2:])),
                gear=gear,
            )
        ],
        [Input(signal, {first: share}, values[3])],
        [Loop(signal, "reference", second, numbers[0], numbers[1], limit)],
    )
    effect = LawAt("force_offset", port, ConstantForce(numbers[4]))
    found = through_file(tmp_path_factory.getbasetemp(), title, mechanism, (effect, effect))
    assert found == MechanismModel(title, mechanism, (effect, effect))
    assert list(found.mechanism.inertias) == [first, second]
    assert list(found.mechanism.ports[0].motion) == [second, first]


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ((" ", RIG, []), "title is ' '"),
        (("x", RIG, [], 0.0), "cutoff is 0.0, allowed: a finite number above 0"),
        (("x", RIG, [LawAt("windup", "joint", FRICTION)]), "effect.name is 'windup'"),
        (("x", RIG, [LawAt("backlash", "joint", FRICTION)]), "allowed: a DeadZone"),
        (("x", RIG, [LawAt("coulomb_friction", "hip", FRICTION)]), "port is 'hip'"),
        (("x", RIG, [LawAt("kinematic_error", "joint", ERROR)]), "read = true"),
    ],
)
def test_unreadable_model_is_not_written(parts, message):
    with pytest.raises(InvalidInput) as caught:
        model_text(MechanismModel(*parts))
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("windup", {}, "effect.name is 'windup', allowed: one of '"),
        ("backlash", {}, "backlash.half_width is None"),
        ("backlash", {"half_width": -1.0}, "backlash.half_width is -1.0"),
        ("backlash", {"width": 1.0}, "number of backlash is 'width', allowed: one of 'half_width'"),
        ("kinematic_error", READING | {"order": 0.0}, "kinematic_error.order is 0.0"),
        ("kinematic_error", READING | {"amplitude": "1"}, "kinematic_error.amplitude is '1'"),
        ("clearance_variation", {"locked": 1.0}, "number of clearance_variation is 'locked'"),
    ],
)
def test_impossible_effect_is_refused(name, values, message):
    with pytest.raises(InvalidInput) as caught:
        effect_named(name).law_of(values)
    assert message in str(caught.value)
