"""The library of effects: its names, its ranges, and the waves that its lines are made of."""

import tomllib
from dataclasses import replace
from itertools import chain

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planted_features import ORDERS, SCALES, known_data, library, listed
from virtual_rig_cases import BELIEVED

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.discrepancy._evidence.order_lines.candidates import (
    drive_candidates,
    out_of_tolerance,
)
from pymoo_hdte.discrepancy._evidence.order_lines.prediction import coefficients_of
from pymoo_hdte.discrepancy._evidence.order_lines.sizes import port_sizes
from pymoo_hdte.discrepancy._records.believed import MECHANICAL
from pymoo_hdte.drive import LawAtPort, preset
from pymoo_hdte.drive._effects import PreslidingFriction, effect_from_fields
from pymoo_hdte.drive.toml_text import model_toml
from pymoo_hdte.effects.friction import CoulombFriction, NonlinearDrag
from pymoo_hdte.effects.guess import Sizes
from pymoo_hdte.effects.shear_thinning import ShearThinningDrag
from pymoo_hdte.effects.unknowns import line_with_variance, lines_of, polar, starts_along_each, wave
from pymoo_hdte.units import ARCSEC

NAMES = {
    "hardening_stiffness", "soft_windup", "hysteresis", "backlash", "clearance_variation",
    "coulomb_friction", "stribeck_friction", "position_dependent_friction", "nonlinear_drag",
    "mesh_stiffness_variation", "kinematic_error", "kinematic_reaction", "eccentricity",
    "torque_ripple", "load_dependent_friction", "load_inertia", "damping_reference",
    "thermal_drift", "presliding_friction", "uneven_load_sharing",
}  # fmt: skip
"""Of design section 7, "Words", with the friction before breakaway and the half stiffness."""
SEEN = [3.0, 6.0, 46.0 / BELIEVED.ratio]
LISTED = drive_candidates(
    port_sizes(BELIEVED, [*ORDERS, *SEEN, 2.0 * 46.0 / BELIEVED.ratio], SEEN, SCALES)
)
parts = st.floats(-1e3, 1e3)


def label(candidate):
    return candidate.label


def values_of(candidate):
    """Any values within the bounds of a candidate."""
    return st.tuples(*(st.floats(one.lower, one.upper) for one in candidate.parameters))


def orders_of(candidate):
    """Orders, in cycles per input turn, of the effects of a candidate that is a line."""
    effects = candidate.build(candidate.starts[-1])
    slower = BELIEVED.ratio if candidate.port in ("load", "sensor") else 1.0
    return [getattr(effect, "law", effect).order / slower for effect in effects]


def test_every_name_of_the_design_is_listed_and_no_other():
    of_drive = [candidate for candidate in LISTED if candidate.listed and not candidate.nuisance]
    assert {candidate.name for candidate in of_drive} == NAMES


def test_what_is_not_listed_is_the_encoder_s_alone():
    assert {(one.name, one.port) for one in LISTED if not one.listed} == {
        ("encoder_line", "sensor")
    }


@pytest.mark.parametrize("swept", [True, False])
def test_the_play_where_the_input_was_locked_is_sought_with_a_sweep_only(swept):
    """No other record knows it: it would end at a bound by chance."""
    sizes = port_sizes(BELIEVED, ORDERS.tolist(), [], replace(SCALES, swept=swept))
    plays = [one for one in drive_candidates(sizes) if "narrowest" in names_of(one)]
    assert {one.name for one in plays} == {"clearance_variation", "uneven_load_sharing"}
    assert {"locked" in names_of(one) for one in plays} == {swept}


def names_of(candidate):
    return [parameter.name for parameter in candidate.parameters]


def test_labels_tell_candidates_apart():
    assert len({candidate.label for candidate in LISTED}) == len(LISTED)


@pytest.mark.parametrize("candidate", LISTED, ids=label)
def test_starts_are_within_the_bounds(candidate):
    lower = [parameter.lower for parameter in candidate.parameters]
    upper = [parameter.upper for parameter in candidate.parameters]
    for start in candidate.starts:
        assert np.all(np.array(lower) <= start)
        assert np.all(np.array(start) <= upper)
        assert np.any(np.array(start) != 0.0)
    assert all(parameter.lower <= parameter.start <= parameter.upper > parameter.lower
               for parameter in candidate.parameters)  # fmt: skip
    assert all(parameter.scale > 0.0 for parameter in candidate.parameters)


IN_FILES = {
    # A model takes the believed inertia beside it.
    "load_inertia/coupled": "coupled_inertia",
    # Another law, with other numbers.
    "nonlinear_drag/shear_thinning": "shear_thinning_drag",
    "hysteresis/bouc_wen": "bouc_wen_hysteresis",
}
"""Forms of effects that stand in a model under a name of their own."""


@settings(max_examples=8)
@pytest.mark.parametrize("candidate", LISTED, ids=label)
@given(data=st.data())
def test_a_model_takes_the_effects_and_its_file_gives_them_back(candidate, data):
    effects = candidate.build(data.draw(values_of(candidate)))
    model = replace(preset("calibrated"), effects=effects)
    tables = tomllib.loads(model_toml(model))["effect"]
    assert tuple(effect_from_fields(Fields(table, "effect")) for table in tables) == effects
    named = IN_FILES.get(f"{candidate.name}/{candidate.form}", candidate.name)
    assert effects[0].name == named or not candidate.listed


@given(parts, parts, st.floats(-10.0, 10.0))
def test_polar_is_the_same_wave(cosine, sine, angle):
    amplitude, phase = polar(cosine, sine)
    wanted = cosine * np.cos(angle) - sine * np.sin(angle)
    assert amplitude * np.cos(angle + phase) == pytest.approx(wanted, abs=1e-12 * (1 + amplitude))


@given(st.floats(-3.1, 3.1), st.floats(0.1, 10.0), st.floats(-0.9, 0.9))
def test_variances_of_a_line_are_carried_from_its_parts(angle, ratio, correlation):
    cosine, sine = 2.0 * np.cos(angle), 2.0 * np.sin(angle)
    covariance = 1e-4 * np.array([[1.0, correlation * ratio], [correlation * ratio, ratio**2]])
    (amplitude, of_amplitude), (phase, of_phase) = line_with_variance(cosine, sine, covariance)
    assert (amplitude, phase) == polar(cosine, sine)
    # The slopes of amplitude and phase by the parts, as differences.
    step = 1e-6 * np.eye(2)
    ahead, behind = (
        np.array([polar(cosine + sign * dc, sine + sign * ds) for dc, ds in step])
        for sign in (1.0, -1.0)
    )
    slopes = (ahead - behind).T / 2e-6
    expected = np.einsum("pi,ij,pj->p", slopes, covariance, slopes)
    np.testing.assert_allclose([of_amplitude, of_phase], expected, rtol=1e-5)


@pytest.mark.parametrize("part", [1e-9, 1e-200, 0.0])
def test_of_a_line_that_is_not_there_the_phase_is_anywhere_in_a_turn(part):
    (_, of_amplitude), (_, of_phase) = line_with_variance(part, -part, 4.0 * np.eye(2))
    assert of_phase == pytest.approx((2.0 * np.pi) ** 2 / 12.0)
    assert of_amplitude == pytest.approx(4.0)


@given(st.lists(st.tuples(parts, parts), min_size=1, max_size=3))
def test_lines_of_a_wave_come_back(pairs):
    lines = lines_of(list(chain(*pairs)))
    for (amplitude, phase), (cosine, sine) in zip(lines, pairs, strict=True):
        phasor = amplitude * np.exp(1j * phase)
        assert phasor == pytest.approx(cosine + 1j * sine, abs=1e-12 * (1.0 + amplitude))


@given(st.floats(1e-6, 1e3), st.sets(st.integers(2, 5)))
def test_starts_of_a_wave_span_its_parts(typical, further):
    harmonics = [1, *sorted(further)]
    unknowns = wave("amplitude", 2.0 * typical, typical, harmonics)
    starts = np.array(starts_along_each(unknowns))
    assert len(unknowns) == 2 * len(harmonics)
    assert np.linalg.matrix_rank(starts / typical) == 2 * len(harmonics)
    assert np.count_nonzero(starts) == 2 * len(harmonics)
    assert np.max(starts) == typical
    assert len({parameter.name for parameter in unknowns}) == 2 * len(harmonics)
    # Each line begins with its cosine, and both of its parts know of it.
    assert [one.begins_line for one in unknowns] == [True, False] * len(harmonics)
    assert all(one.line.endswith("amplitude") for one in unknowns)
    assert [one.line for one in unknowns[::2]] == [one.line for one in unknowns[1::2]]


def test_cosine_and_sine_are_real_and_imaginary_part_of_the_static_error():
    line = listed(known_data(), "kinematic_error", [3.0])
    values = {parameter.name: np.array([parameter.start]) for parameter in known_data().base}
    effects = line.build((2.0 * ARCSEC, 0.7 * ARCSEC, -0.1 * ARCSEC, 0.3 * ARCSEC))
    plain = coefficients_of(BELIEVED, values, (), 1)
    found = coefficients_of(BELIEVED, values, effects, 1)
    assert found.error_orders[3:].tolist() == [3.0, 6.0]
    added = found.error_phasors[0, 3:] / ARCSEC
    assert added == pytest.approx([2.0 + 0.7j, -0.1 + 0.3j], rel=1e-12)
    assert np.array_equal(found.error_phasors[:, :3], plain.error_phasors)


@pytest.mark.parametrize("seen", [[3.0], [1.0, 6.0], [1.01], [46.0 / 101.0, 0.5], [2.0, 4.0]])
def test_lines_have_harmonics_only_where_the_features_look(seen):
    orders = sorted({*ORDERS.tolist(), *seen})
    for candidate in drive_candidates(port_sizes(BELIEVED, orders, seen, SCALES)):
        if candidate.name not in ("kinematic_error", "torque_ripple", "encoder_line"):
            continue
        if candidate.nuisance:
            # A brake or a coupling has orders of its own.
            continue
        first, *further = orders_of(candidate)
        assert any(np.isclose(first, order, rtol=1e-12) for order in seen)
        held = [order for order in orders if np.isclose(order, 2.0 * first, rtol=1e-9)]
        if candidate.name == "kinematic_error":
            held = [order for order in held if order not in BELIEVED.error_orders]
        assert further == pytest.approx(held, rel=1e-9)
        assert len(candidate.parameters) == 2 * (1 + len(held))


@pytest.mark.parametrize(
    ("seen", "expected"),
    [
        ([2.0], (2.0, 4.0)),
        ([2.0, 6.0, 10.0], (2.0, 4.0, 6.0, 10.0)),
        ([2.0, 10.0, 12.0], (2.0, 4.0, 10.0)),
        ([2.0, 6.0, 8.0], (2.0, 4.0, 6.0)),
    ],
)
def test_a_line_has_further_harmonics_up_to_the_fifth_where_they_are_seen(seen, expected):
    sizes = Sizes(1.0, 1.0, 1.0, 1.0, 1.0, seen=tuple(seen), shown=(2.0, 4.0, 6.0, 10.0, 12.0))
    family = sizes.family(2.0)
    assert family.order == 2.0
    assert family.orders == expected
    values = np.arange(1.0, 1.0 + len(family.waves("amplitude", 2.0, 1.0)))
    assert tuple(order for order, _, _ in family.lines(values)) == expected
    at_output = replace(sizes, slower=100.0, seen=tuple(one / 100.0 for one in seen),
                        shown=tuple(one / 100.0 for one in sizes.shown))  # fmt: skip
    assert at_output.family(2.0).orders == expected


def test_lines_that_bring_no_candidates_are_harmonics_all_the_same():
    """Where many lines are strong, as of a reaction, the weaker harmonics of others are seen."""
    turn = 1.0 / BELIEVED.ratio
    orders = [turn, 2.0 * turn, 3.0 * turn, *ORDERS[1:]]

    def held(clear):
        sizes = port_sizes(BELIEVED, orders, [turn], SCALES, clear)
        found = drive_candidates(sizes)
        (one,) = [each for each in found if each.name == "eccentricity"]
        return len(one.parameters) // 2

    assert held([turn, 3.0 * turn]) == 3
    assert held([turn]) == 2


@pytest.mark.parametrize(
    "law", [CoulombFriction(1.0), PreslidingFriction(1.0, 1e-4)], ids=lambda law: type(law).__name__
)
def test_a_believed_dry_friction_leaves_none_to_be_found_at_its_port(law):
    name = "coulomb_friction" if type(law) is CoulombFriction else "presliding_friction"
    sizes = port_sizes(BELIEVED, ORDERS.tolist(), [], SCALES)
    found = drive_candidates(sizes, [LawAtPort(name, "output", law)])
    labels = {one.label for one in found}
    assert not labels & {"coulomb_friction:output", "presliding_friction:output"}
    assert "coulomb_friction:input" in labels


@pytest.mark.parametrize(
    ("name", "law"),
    [
        ("nonlinear_drag", NonlinearDrag(1e-6)),
        ("shear_thinning_drag", ShearThinningDrag(0.02, 10.0, 200.0)),
    ],
)
def test_a_believed_drag_leaves_none_in_any_form(name, law):
    sizes = port_sizes(BELIEVED, ORDERS.tolist(), [1.0], SCALES)
    assert {one.form for one in drive_candidates(sizes) if one.name == "nonlinear_drag"} == {
        "",
        "sublinear",
        "shear_thinning",
    }
    found = drive_candidates(sizes, [LawAtPort(name, "input", law)])
    assert not [one for one in found if one.name == "nonlinear_drag"]


def test_a_believed_order_of_the_error_is_no_further_line_of_it():
    names = [
        (one.name, one.order)
        for one in drive_candidates(port_sizes(BELIEVED, ORDERS.tolist(), [1.0, 3.0], SCALES))
    ]
    assert ("kinematic_error", 1.0) not in names
    assert ("kinematic_error", 3.0) in names
    assert ("torque_ripple", 1.0) in names


def test_an_order_that_is_no_whole_number_of_output_turns_is_not_the_encoder_s():
    names = [
        one.label
        for one in drive_candidates(port_sizes(BELIEVED, [*ORDERS, 0.4567], [0.4567, 3.0], SCALES))
    ]
    assert "encoder_line:sensor@3" in names
    assert "kinematic_error:mesh@0.4567" in names
    assert "encoder_line:sensor@0.4567" not in names


def test_only_parameters_of_the_drive_can_be_out_of_tolerance():
    base = known_data().base
    names = [parameter.name for parameter in base]
    freed = [
        candidate.releases for candidate in out_of_tolerance(base, names, BELIEVED.error_orders)
    ]
    amplitudes = {f"error_amplitude_{line}" for line in range(len(BELIEVED.error_orders))}
    # Load inertia and damping have effects of their own names, unless several are freed together.
    assert set(freed) == set(MECHANICAL) - {"load_inertia", "damping"} | amplitudes
    together = out_of_tolerance(base, names, BELIEVED.error_orders, together=True)
    assert {candidate.releases for candidate in together} == set(MECHANICAL) | amplitudes
    for candidate in out_of_tolerance(base, names, BELIEVED.error_orders):
        assert candidate.build(()) == ()
        assert candidate.unknowns == 1
        assert not candidate.parameters


def test_what_is_believed_to_be_nothing_is_not_out_of_tolerance():
    base = tuple(
        replace(one, start=0.0) if one.name == "input_damping" else one for one in known_data().base
    )
    freed = {
        candidate.releases
        for candidate in out_of_tolerance(base, MECHANICAL, BELIEVED.error_orders)
    }
    assert "stiffness" in freed
    assert "input_damping" not in freed


def test_unknowns_count_what_a_fit_gains():
    for candidate in library(known_data(), [3.0]):
        assert candidate.unknowns == len(candidate.parameters)


def test_forms_of_one_effect_are_never_together():
    """Also where they are effects of their own in a model."""
    inertias = [one for one in LISTED if one.name == "load_inertia"]
    assert len(inertias) == 2
    rigid, coupled = inertias
    assert not rigid.places & coupled.places
    assert not rigid.goes_with(coupled)
    assert coupled.is_form_of(rigid)
    assert rigid.goes_with(next(one for one in LISTED if one.name == "backlash"))


def test_of_a_known_motor_one_line_is_enough():
    scales = replace(SCALES, motor=(8.0, 12.0, 24.0))
    for seen, forms in (([8.0], ["8"]), ([12.0, 5.0], ["12"]), ([9.0], [])):
        sizes = port_sizes(BELIEVED, [1.0, *seen], seen, scales, seen, 13.5)
        assert [one.form for one in drive_candidates(sizes) if one.name == "cogging"] == forms


@pytest.mark.parametrize(
    ("seen", "above", "folded", "forms"),
    [
        # Eight poles in twelve slots, whose common multiple lies above the band of some records.
        ([8.0, 12.0], [24.0], (), "8+12+24"),
        # Fourteen poles: one record's averages show the common multiple elsewhere.
        ([12.0], [14.0], (84.0,), "12+14+84"),
        ([12.0], [14.0], (72.0,), "12+14"),
        # No motor has five slots or poles.
        ([5.0], [], (), None),
        # Of eight poles the slots would be seen: it may be any ripple.
        ([8.0], [], (), None),
    ],
)
def test_a_motor_cogs_at_poles_slots_and_their_common_multiple(seen, above, folded, forms):
    orders = [1.0, 2.0, *seen, *above]
    scales = replace(SCALES, folded=folded)
    sizes = port_sizes(BELIEVED, orders, seen, scales, [*seen, *above], 13.5)
    motors = [one for one in drive_candidates(sizes) if one.name == "cogging"]
    assert all(one.nuisance for one in motors)
    # Others have fewer of the lines that are seen.
    lines = {f"{order:g}" for order in (*seen, *above)}
    whole = [one.form for one in motors if lines <= set(one.form.split("+"))]
    assert whole == ([] if forms is None else [forms])
