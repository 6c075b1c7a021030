"""The report on a campaign, and what a correction does to the robust optimum."""

import base64
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from analysed_campaigns import ripple_analysis
from hypothesis import given
from hypothesis import strategies as st
from made_verdicts import with_status

from pymoo_hdte._reports.html import digits, number, percent
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._answers.next_test_drive import Proposal
from pymoo_hdte.discrepancy._answers.revision_drive import drive_model, revised_model
from pymoo_hdte.discrepancy._answers.where.coverage import campaign_limits
from pymoo_hdte.discrepancy._answers.where.location import locate
from pymoo_hdte.discrepancy._report import write as report
from pymoo_hdte.discrepancy._report.certainty import how_sure
from pymoo_hdte.discrepancy._report.folder import FOLDER
from pymoo_hdte.discrepancy._report.optimum import OptimumShift
from pymoo_hdte.discrepancy._report.tables import parameter_rows
from pymoo_hdte.discrepancy._report.write import validation_sentence, write_report
from pymoo_hdte.discrepancy._robust_optimum import optimum_shift
from pymoo_hdte.discrepancy._selection.reason import MORE_MISSING, SENSOR_OFF, Reason
from pymoo_hdte.discrepancy._verdicts.validation_drive import validate_drive
from pymoo_hdte.drive import (
    LawAtPort,
    LoadInertia,
    MeshStiffnessVariation,
    load_datasheet,
    load_model,
    preset,
)
from pymoo_hdte.effects.stiffness import SoftWindup
from pymoo_hdte.units import ARCSEC

PROPOSAL = Proposal("Turn it backwards.", "running", -600.0, 40.0, ("a", "b"), 12.0)


@pytest.fixture(scope="module")
def ripple():
    return ripple_analysis()


@pytest.fixture(scope="module")
def location(ripple):
    return locate(ripple)


@pytest.fixture(scope="module")
def written(ripple, location, tmp_path_factory):
    out = tmp_path_factory.mktemp("reports") / "ripple"
    write_report(ripple, location, validate_drive(ripple), PROPOSAL, optimum_shift, out)
    return out


def not_tried(*_):
    """Leave the optimum out, which takes longer than all the rest."""
    return OptimumShift((), "not tried")


@pytest.mark.slow
def test_page_stands_alone_and_answers(written):
    page = (written / "report.html").read_text()
    assert not re.findall(r"<script|https?://|<link|@import|url\(", page)
    sources = re.findall(r'src="([^"]*)"', page)
    plots = json.loads((written / "verdict.json").read_text())["plots"]
    assert len(sources) == 6 + len(plots)
    for source in sources:
        head, body = source.split(",", 1)
        assert head == "data:image/svg+xml;base64"
        assert b"</svg>" in base64.b64decode(body)
    for question in ("Where is the model wrong?", "How sure", "held-out records?", "test next"):
        assert question in page
    assert "torque ripple" in page
    assert "Turn it backwards." in page
    assert "torque_ripple" not in page


@pytest.mark.slow
def test_verdict_and_model_are_read_back(written, ripple):
    names = {path.name for path in written.iterdir()}
    # This campaign has no torsion sweep, and the model that describes is one of mechanisms.
    absent = ("torsion", "descriptive_model")
    assert names == {name for name in FOLDER.files if not name.startswith(absent)}
    verdict = json.loads((written / "verdict.json").read_text())
    assert verdict["status"] == "named"
    held_out = verdict["held_out"]
    assert held_out["unit"] == "arcsec"
    assert {"before", "after", "noise_floor", "shrinkage"} <= held_out.keys()
    assert held_out["channels"]["input_torque"]["after"] < 0.2
    sheet = load_datasheet(written / "revised_model_sheet.toml")
    assert load_model(written / "revised_model.toml", sheet) == revised_model(ripple)


@pytest.mark.nightly
def test_same_analysis_gives_the_same_bytes(written, ripple, location, tmp_path):
    again = tmp_path / "again"
    write_report(ripple, location, validate_drive(ripple), PROPOSAL, optimum_shift, again)
    for path in written.iterdir():
        assert (again / path.name).read_bytes() == path.read_bytes()


@pytest.mark.nightly
def test_earlier_report_is_replaced_and_nothing_else(written, ripple, location, tmp_path):
    arguments = (ripple, location, None, PROPOSAL, not_tried)
    out = tmp_path / "deep" / "out"
    write_report(*arguments, out)
    write_report(*arguments, out)
    assert [path.name for path in out.parent.iterdir()] == ["out"]
    assert "No record was held out" in (out / "report.html").read_text()
    (out / "thesis.txt").write_text("years of work")
    for foreign in (out, out / "thesis.txt"):
        with pytest.raises(InvalidInput, match="folder of the report"):
            write_report(*arguments, foreign)
    assert (out / "thesis.txt").read_text() == "years of work"


@pytest.mark.slow
def test_a_wrong_folder_is_refused_before_the_work(ripple, location, tmp_path):
    def too_late(*_):
        raise AssertionError("the work began")

    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(InvalidInput, match="folder of the report"):
        write_report(ripple, location, None, PROPOSAL, too_late, tmp_path)


@pytest.mark.parametrize(
    ("document", "texts", "error", "words"),
    [
        ({"mean": float("nan")}, {}, ArithmeticError, "verdict.json is not finite"),
        ({}, {"stray.txt": ""}, ValueError, "stray.txt"),
    ],
)
def test_what_is_no_report_is_not_written(document, texts, error, words, tmp_path):
    with pytest.raises(error, match=words):
        FOLDER.write(tmp_path / "out", "page", document, texts)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_failure_leaves_the_earlier_report(ripple, location, tmp_path, monkeypatch):
    arguments = (ripple, location, None, PROPOSAL, not_tried, tmp_path / "out")
    write_report(*arguments)
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr(report, "_page", fail)
    with pytest.raises(OSError, match="disk full"):
        write_report(*arguments)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before


@pytest.mark.slow
def test_words_do_not_promise_what_is_not_there(ripple):
    validation = validate_drive(ripple)
    assert "the correction removes" in validation_sentence(ripple, validation)
    unlisted = replace(ripple, verdict=with_status(ripple.verdict, "unlisted"))
    assert "Nothing was added" in validation_sentence(unlisted, validate_drive(unlisted))
    assert "what it is remains open" in how_sure(unlisted)
    assert "explains 100 % of the misfit" in how_sure(ripple)


@pytest.mark.slow
def test_a_next_best_that_explains_the_same_share_is_told_apart_by_its_bic(ripple):
    chosen, verdict = ripple.verdict.chosen, ripple.verdict
    fit = replace(chosen.fit, candidates=(replace(chosen.candidates[0], name="another"),))
    rival = replace(chosen, fit=fit, bic=chosen.bic + 9.0)
    verdict = replace(verdict, equivalent=(), alternatives=(rival,))
    said = how_sure(replace(ripple, verdict=verdict))
    share = re.search(r"explains ([\d.]+ %)", said).group(1)
    assert said.count(share) == 1
    assert "its BIC is 9 above" in said


@pytest.mark.slow
@pytest.mark.parametrize(("gap", "told"), [(9.0, True), (-9.0, False)])
def test_a_set_with_more_that_the_evidence_prefers_is_told(ripple, gap, told):
    chosen, verdict = ripple.verdict.chosen, ripple.verdict
    more = replace(chosen.candidates[0], name="another")
    fit = replace(chosen.fit, candidates=(*chosen.candidates, more))
    richer = replace(chosen, fit=fit, bic=chosen.bic - gap, explained=0.9876)
    verdict = replace(verdict, equivalent=(), alternatives=(richer,))
    said = how_sure(replace(ripple, verdict=verdict))
    assert (percent(0.9876) in said) == (f"BIC is {number(abs(gap))} below" in said) == told


@pytest.mark.slow
@pytest.mark.parametrize(("deviations", "told"), [(2.9, False), (3.1, True)])
def test_a_sensor_far_from_what_is_stated_of_it_is_told(ripple, deviations, told):
    """Both gains ended four limits away, all values were 2 % off, and the page did not say it."""
    fitted = ripple.verdict.chosen.fit
    place = [one.name for one in fitted.parameters].index("input_torque_gain")
    values = fitted.values.copy()
    values[place] = deviations * fitted.parameters[place].prior
    chosen = replace(ripple.verdict.chosen, fit=replace(fitted, values=values))
    limits = campaign_limits(replace(ripple, verdict=replace(ripple.verdict, chosen=chosen)))
    assert any(limit.code == SENSOR_OFF for limit in limits) == told


@pytest.mark.slow
def test_parameters_are_told_in_the_reader_s_units(ripple):
    rows = {row.name: row for row in parameter_rows(ripple)}
    fitted = ripple.verdict.accepted
    amplitude = rows["error amplitude of order 2"]
    place = [parameter.name for parameter in fitted.parameters].index("error_amplitude_1")
    assert amplitude.value == pytest.approx(fitted.values[place] / ARCSEC)
    assert (amplitude.believed, amplitude.unit) == (pytest.approx(9.0), "arcsec")
    low, high = amplitude.interval95
    width = 2.0 * 1.96 * fitted.covariance[place, place] ** 0.5 / ARCSEC
    assert high - low == pytest.approx(width, rel=1e-3)
    assert rows["error phase of order 1"].believed is None
    # A value that was freed keeps the tolerance that it violates.
    wide = tuple(replace(one, upper=1e9) for one in fitted.parameters)
    chosen = replace(ripple.verdict.chosen, fit=replace(fitted, parameters=wide))
    freed = replace(ripple.verdict, chosen=chosen)
    assert parameter_rows(replace(ripple, verdict=freed))[0].upper == rows["stiffness"].upper


@pytest.mark.parametrize(
    ("value", "shown"),
    [(0.0, "0"), (-2.5, "−2.5"), (1.97e-4, "1.97·10⁻⁴"), (123456.0, "1.23·10⁵"), (None, "–")],  # noqa: RUF001
)
def test_numbers_are_readable(value, shown):
    assert number(value) == shown


def revised_with(ripple, *effects):
    """Return the fitted base with further effects as the drive model of a report."""
    model = drive_model(ripple.campaign, ripple.verdict.base, "revised", "a model")
    return replace(model, effects=(*model.effects, *effects))


def test_optimum_of_the_same_model_does_not_move():
    shift = optimum_shift(preset("calibrated"), preset("calibrated"))
    assert not shift.obstacle
    assert len(shift.choices) == 3
    for choice in shift.choices:
        assert choice.distance == 0.0
        assert choice.delivered == pytest.approx(choice.promised, rel=1e-12)
        assert np.array_equal(choice.reached, choice.promised)


def test_directions_that_do_not_matter_are_no_shift():
    old = preset("calibrated")
    inertia, damping, mesh = old.effects
    shift = optimum_shift(
        old, replace(old, effects=(inertia, damping, replace(mesh, depth=mesh.depth * 1.0001)))
    )
    # B_in hardly moves the DTE, so that nothing holds it where it is on either front.
    assert max(choice.distance for choice in shift.choices) > 0.05
    assert all(choice.stays for choice in shift.choices)
    for choice in shift.choices:
        for free in (choice.free_before, choice.free_after):
            assert free.tolist() == [False, False, True, False]
    assert "stays where it was" in shift.sentence


def test_old_optimum_is_judged_by_the_new_model():
    old = preset("calibrated")
    heavier = replace(old, effects=(LoadInertia(0.30), *old.effects[1:]))
    shift = optimum_shift(old, heavier)
    assert "stays" not in shift.sentence
    for choice in shift.choices:
        # What was chosen for the new model is not beaten in its own preference's leading objective.
        leading = 1 if choice.preference == "robustness_first" else 0
        assert choice.reached[leading] <= choice.delivered[leading] * (1.0 + 1e-3)
        assert not np.allclose(choice.delivered, choice.promised, rtol=1e-3)


@pytest.mark.slow
def test_revised_model_with_a_law_goes_through_surrogate_and_swarm(ripple):
    plain = revised_with(ripple)
    soft = revised_with(ripple, LawAtPort("soft_windup", "mesh", SoftWindup(0.3, 2e-3)))
    shift = optimum_shift(plain, soft)
    assert not shift.obstacle
    for choice in shift.choices:
        # The load does not wind it up wholly: what was promised is not delivered.
        assert not np.allclose(choice.delivered, choice.promised, rtol=1e-2)
        design = np.array([soft.nominal[0], *choice.after * soft.nominal[1:]])
        assert soft.dte_arcsec(design[None, :])[0] == pytest.approx(choice.reached[0], rel=0.1)


@pytest.mark.nightly
def test_inert_law_moves_the_optimum_by_the_change_of_solver_only(ripple):
    plain = revised_with(ripple)
    inert = revised_with(ripple, LawAtPort("soft_windup", "mesh", SoftWindup(0.0, 2e-4)))
    shift = optimum_shift(plain, inert)
    assert "stays where it was" in shift.sentence
    for choice in shift.choices:
        # Hill's method takes theta_in = Omega t; the harmonic balance lets the input fluctuate.
        assert choice.delivered == pytest.approx(choice.promised, rel=5e-3)
        assert choice.reached == pytest.approx(choice.promised, rel=5e-3)


def test_model_without_steady_state_has_no_optimum():
    old = preset("calibrated")
    unstable = replace(old, effects=(*old.effects[:2], MeshStiffnessVariation(0.95, 0.0)))
    shift = optimum_shift(old, unstable)
    assert shift.choices == ()
    assert "no robust optimum" in shift.obstacle


@pytest.mark.parametrize(
    ("lower", "upper", "shown"),
    [
        (0.015735405, 0.015741384, 6),
        (1.0, 2.0, 3),
        (-3.0, 3.0, 2),
        (0.25, 0.35, 3),
        (0.99999, 1.00001, 7),
        (5.0, 5.0, 4),
        (1.0, 1.0 + 1e-15, 12),
    ],
)
def test_the_ends_of_an_interval_are_told_apart(lower, upper, shown):
    assert digits(lower, upper) == shown


@given(st.floats(1e-9, 1e9), st.floats(1e-9, 1.0))
def test_ends_are_printed_within_a_twentieth_of_the_width(middle, relative):
    lower, upper = middle * (1.0 - relative / 2.0), middle * (1.0 + relative / 2.0)
    for end in (lower, upper):
        printed = float(np.format_float_positional(end, digits(lower, upper), fractional=False))
        assert abs(printed - end) <= 0.051 * (upper - lower)


@pytest.mark.slow
def test_words_of_a_user_s_effect_are_no_lines_of_the_static_error(ripple, location, tmp_path):
    """A sentence with "error phase 5" ended the report in IndexError; names of numbers did too."""
    told, chosen = "Commutation error phase 5 of the motor at the input.", ripple.verdict.chosen
    fitted, base = chosen.fit, len(ripple.data.base)
    # One unknown in the place of the ripple's, at its bound.
    unknown = replace(fitted.parameters[base], name="error_phase_5", upper=fitted.values[base])
    own = replace(
        chosen.candidates[0],
        name="error_phase",
        sentence=told,
        parameters=(replace(unknown, linear=False),),
        build=lambda values: (),
        unit=lambda name: "rad",
    )
    alone = replace(
        fitted,
        candidates=(own,),
        parameters=(*fitted.parameters[:base], *own.parameters),
        values=fitted.values[: base + 1],
        jacobian=fitted.jacobian[:, : base + 1],
    )
    verdict = replace(
        ripple.verdict,
        chosen=replace(chosen, fit=alone),
        reasons=(Reason.of(MORE_MISSING, numbers={"outside": 0.5}),),
    )
    document = write_report(
        replace(ripple, verdict=verdict), location, None, PROPOSAL, not_tried, tmp_path / "own"
    )
    assert document["sentence"].startswith(told)
    assert document["effects"][0]["sentence"] == told
    assert "error phase 5" in (tmp_path / "own" / "report.html").read_text()
