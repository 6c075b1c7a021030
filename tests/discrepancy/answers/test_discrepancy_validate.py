"""Revised models and the validation on held-out records."""

from dataclasses import fields, replace

import numpy as np
import pytest
from analysed_campaigns import LISTED, ORDERS, clean_analysis, ripple_analysis
from made_verdicts import with_status
from virtual_rig_cases import BELIEVED, RIG

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._answers.revision_drive import drive_model, revised_model
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import base_parameters
from pymoo_hdte.discrepancy._evidence.order_lines.prediction import coefficients_of
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._verdicts.validation_drive import PredictionError, validate_drive
from pymoo_hdte.drive import load_datasheet, load_model
from pymoo_hdte.drive.toml_text import model_toml, sheet_toml
from pymoo_hdte.units import ARCSEC


@pytest.fixture(scope="module")
def ripple():
    return ripple_analysis()


@pytest.fixture(scope="module")
def clean():
    return clean_analysis()


def at_start(*chosen):
    """Return a fit that stopped where it began."""
    base = base_parameters(BELIEVED, RIG, (0.3, 1.9, 4.0), 0.0)
    parameters = (*base, *(parameter for one in chosen for parameter in one.parameters))
    starts = [start for one in chosen for start in one.starts[-1]]
    values = np.array([*(parameter.start for parameter in base), *starts])
    return Fit(chosen, parameters, values, np.zeros(1), np.zeros((1, len(values))))


@pytest.mark.slow
@pytest.mark.parametrize("candidate", LISTED, ids=lambda one: one.label)
def test_model_has_the_coefficients_of_the_fit(candidate, clean):
    fitted = at_start(candidate)
    model = drive_model(clean.campaign, fitted, "revised", "a model")
    found = model.coefficients(model.nominal[None, :])
    values = {
        parameter.name: np.array([value])
        for parameter, value in zip(fitted.parameters, fitted.values, strict=True)
    }
    wanted = coefficients_of(BELIEVED, values, fitted.effects, 1)
    for field in fields(wanted):
        if field.name not in ("input_speed", "load_torque", "laws"):
            one, other = getattr(found, field.name), getattr(wanted, field.name)
            if one is None or other is None:
                assert one is other, field.name
            else:
                assert np.allclose(one, other, rtol=1e-12, atol=0.0, equal_nan=True), field.name
    assert found.laws == wanted.laws
    assert (found.input_speed, found.load_torque) == (pytest.approx(209.44, rel=1e-4), 40.0)


@pytest.mark.slow
@pytest.mark.parametrize("candidate", LISTED, ids=lambda one: one.label)
def test_model_is_read_back_exactly(candidate, clean, tmp_path):
    model = drive_model(clean.campaign, at_start(candidate), "revised", 'a "model" \\ of µm')
    (tmp_path / "sheet.toml").write_text(sheet_toml(model.sheet), encoding="utf-8")
    (tmp_path / "model.toml").write_text(model_toml(model), encoding="utf-8")
    again = load_model(tmp_path / "model.toml", load_datasheet(tmp_path / "sheet.toml"))
    assert again == model


def test_revised_model_predicts_the_fit_s_transmission_error(ripple):
    fitted = ripple.verdict.chosen.fit
    campaign = replace(ripple.campaign, rig=replace(RIG, proportional=0.0, integral=0.0))
    free = replace(ripple.data.features.conditions, lead=None)
    data = replace(
        ripple.data, campaign=campaign, features=replace(ripple.data.features, conditions=free)
    )
    features = data.predict(fitted.values[None, : len(data.base)], fitted.effects)[0]
    model = revised_model(ripple)
    speeds = data.features.conditions.input_speed
    names = [parameter.name for parameter in data.base]
    gain, zero = (fitted.values[names.index(f"output_torque_{part}")] for part in ("gain", "zero"))
    loads = (data.features.conditions.output_torque - zero) / (1.0 + gain)
    for record, (speed, load) in enumerate(zip(speeds, loads, strict=True)):
        spectrum = model.at(float(speed), float(load)).steady_state(model.nominal[None, :])
        amplitudes = spectrum.amplitudes()
        for line, order in enumerate(ORDERS):
            real, imaginary = features[record][data.features.places(0)[line]]
            assert amplitudes[order][0] == pytest.approx(np.hypot(real, imaginary), abs=1e-12)


@pytest.mark.slow
def test_model_without_a_name_has_no_effect_and_says_so(ripple, clean):
    unlisted = replace(ripple, verdict=with_status(ripple.verdict, "unlisted"))
    for analysis, words in ((unlisted, "outside the library"), (clean, "nothing is missing")):
        model = revised_model(analysis)
        assert [one.name for one in model.effects] == ["load_inertia", "damping_reference"]
        assert words in model.description
    assert "torque_ripple:input@6" in revised_model(ripple).description


@pytest.mark.slow
@pytest.mark.parametrize(("ratio", "teeth"), [(101.0, (200, 202)), (100.5, (199, 201))])
def test_teeth_give_the_ratio(ratio, teeth, clean):
    sheet = drive_model(_of_ratio(clean.campaign, ratio), at_start(), "revised", "a model").sheet
    assert (sheet.flexspline_teeth, sheet.circular_spline_teeth) == teeth
    assert sheet.ratio == ratio


@pytest.mark.slow
def test_ratio_of_no_gear_is_refused(clean):
    with pytest.raises(InvalidInput, match=r"ratio is 101\.00003"):
        drive_model(_of_ratio(clean.campaign, 101.00003), at_start(), "revised", "a model")


def _of_ratio(campaign, ratio):
    record = campaign.running[0]
    turned = replace(record, output_angle=record.output_angle * BELIEVED.ratio / ratio)
    believed = replace(BELIEVED, ratio=ratio)
    return replace(campaign, believed=believed, running=(turned,), torsion=())


def test_error_shrinks_to_the_noise_where_the_effect_is_named(ripple):
    validation = validate_drive(ripple)
    torque = validation.channels["input_torque"]
    assert torque.before > 10.0 * torque.noise_floor
    assert torque.after < 1.5 * torque.noise_floor
    assert torque.shrinkage > 0.97
    assert validation.overall.after < 1.3
    # The ripple stands at order 6 and nowhere else.
    line = validation.by_order[1 + ORDERS.index(6.0)]
    assert line.before == max(error.before for error in validation.by_order)
    assert validation.records == tuple(record.name for record in ripple.campaign.held_out)


@pytest.mark.slow
def test_nothing_changes_where_nothing_is_named(clean):
    validation = validate_drive(clean)
    for error in (
        *validation.channels.values(),
        *validation.by_record,
        *validation.by_order,
        validation.overall,
    ):
        assert error.before == error.after
    assert validation.overall.shrinkage is None


def test_parts_add_up_to_the_error(ripple):
    validation = validate_drive(ripple)
    for part in ("before", "after", "noise_floor"):
        whole = getattr(validation.channels["transmission_error"], part) ** 2
        by_record = [getattr(error, part) ** 2 for error in validation.by_record]
        by_order = [getattr(error, part) ** 2 for error in validation.by_order]
        assert np.mean(by_record) == pytest.approx(whole)
        assert np.sum(by_order) == pytest.approx(whole)


def test_error_is_the_root_mean_square_over_a_period(ripple):
    validation = validate_drive(ripple)
    data, fitted = ripple.held_out, ripple.verdict.chosen.fit
    predicted = data.predict(fitted.values[None, : len(data.base)], fitted.effects)[0]
    # All orders close over 50 input turns.
    angle = 2.0 * np.pi * 50.0 * np.arange(4000) / 4000.0
    for record, error in enumerate(validation.by_record):
        difference = (data.features.values - predicted)[record]
        parts = difference[data.features.places(0)]
        waves = np.exp(1j * np.outer(ORDERS, angle))
        signal = difference[0] + ((parts[:, 0] + 1j * parts[:, 1]) @ waves).real
        assert error.after == pytest.approx(np.sqrt(np.mean(signal**2)) / ARCSEC, rel=1e-9)


def test_overlay_shows_the_record_that_was_measured(ripple):
    error, torque = validate_drive(ripple).overlays
    for shown in (error, torque):
        assert (shown.turns[0], shown.turns[-1]) == (0.0, 2.0)
        curve = np.interp(shown.sample_turns, shown.turns, shown.measured)
        assert np.corrcoef(curve, shown.samples)[0, 1] > 0.9
    # The base cannot follow the ripple; the revised model does.
    missed = np.std(torque.before - torque.measured)
    assert missed > 10.0 * np.std(torque.after - torque.measured)


def test_overlay_begins_where_a_turn_of_the_record_does(ripple):
    validation = validate_drive(ripple)
    (record,) = (one for one in ripple.campaign.held_out if one.name == validation.worst)
    row = np.abs(np.diff(record.input_angle)).max() / (2.0 * np.pi)
    for shown in validation.overlays:
        # Both turns are covered by samples from end to end.
        assert np.diff([0.0, *np.sort(shown.sample_turns), 2.0]).max() <= 1.01 * row


def test_the_worst_record_is_that_of_the_largest_multiple_of_its_noise(ripple):
    data, worst = ripple.held_out, validate_drive(ripple).worst
    place = [record.name for record in data.features.records].index(worst)
    covariance = data.features.covariance.copy()
    covariance[place] *= 1e6
    drowned = replace(data, features=replace(data.features, covariance=covariance))
    assert validate_drive(_With(ripple, drowned)).worst != worst


def test_the_worst_record_is_not_one_that_the_base_predicts(ripple):
    data, base = ripple.held_out, ripple.verdict.base
    predicted = data.predict(base.values[None, : len(data.base)], ())[0]
    for place, record in enumerate(data.features.records):
        values = data.features.values.copy()
        # Here the base is right, and the ripple that the revised model adds is not.
        values[place] = predicted[place]
        followed = replace(data, features=replace(data.features, values=values))
        assert validate_drive(_With(ripple, followed)).worst != record.name


def test_statistics_are_relative_to_what_was_measured(ripple):
    validation = validate_drive(ripple)
    measured = validation.dte[0]
    for predicted, metrics in zip(validation.dte[1:], validation.metrics, strict=True):
        relative = 100.0 * np.mean(np.abs(predicted - measured) / measured)
        assert metrics.mape_percent == pytest.approx(relative)
        assert metrics.mean_error == pytest.approx(np.mean(predicted - measured))


@pytest.mark.nightly
def test_floor_is_what_a_perfect_model_leaves(clean, rng):
    held_out = clean.held_out
    base = clean.verdict.base
    perfect = held_out.predict(base.values[None, : len(held_out.base)], ())[0]
    squares = []
    floors = []
    for _ in range(100):
        noise = np.einsum("rij,rj->ri", held_out.whiteners, rng.standard_normal(perfect.shape))
        noisy = replace(held_out, features=replace(held_out.features, values=perfect + noise))
        validation = validate_drive(_With(clean, noisy))
        errors = [*validation.channels.values(), validation.overall]
        squares.append([error.after**2 for error in errors])
        floors.append([error.noise_floor**2 for error in errors])
    assert np.mean(squares, axis=0) == pytest.approx(np.mean(floors, axis=0), rel=0.1)


class _With:
    """An analysis with other held-out data."""

    def __init__(self, analysis, data):
        self.verdict = analysis.verdict
        self.held_out = data


@pytest.mark.slow
def test_without_held_out_records_there_is_no_validation(clean):
    campaign = replace(clean.campaign, running=clean.campaign.train)
    assert validate_drive(replace(clean, data=replace(clean.data, campaign=campaign))) is None


def test_one_held_out_record_has_errors_but_no_statistics(ripple):
    campaign = ripple.campaign
    running = (*campaign.train, campaign.held_out[0])
    fewer = replace(campaign, running=running)
    validation = validate_drive(replace(ripple, data=replace(ripple.data, campaign=fewer)))
    assert validation.metrics is None
    assert validation.channels["input_torque"].shrinkage > 0.9


def test_shrinkage_counts_from_the_floor():
    assert PredictionError(5.0, 1.0, 1.0, "arcsec").shrinkage == 1.0
    assert PredictionError(5.0, 5.0, 1.0, "arcsec").shrinkage == 0.0
    assert PredictionError(5.0, 3.0, 1.0, "arcsec").shrinkage == 0.5
    assert PredictionError(5.0, 3.0, 1.0, "arcsec").reduction == pytest.approx(0.4)
    assert PredictionError(1.05, 1.0, 1.0, "arcsec").shrinkage is None


@pytest.mark.slow
def test_peak_to_peak_is_that_of_the_measured_signal(clean):
    validation = validate_drive(clean)
    for record, measured in zip(clean.campaign.held_out, validation.dte[0], strict=True):
        error = record.transmission_error(BELIEVED.ratio) / ARCSEC
        # The extremes of about 3000 raw samples carry noise of about 1 arcsec.
        assert measured < np.ptp(error) < measured + 9.0
