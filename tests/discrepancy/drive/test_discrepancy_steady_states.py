"""Steady states of records: those without one, where a clearance would rattle, and nearby ones."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from planted_features import known_data, library, listed, measured, with_sweep

from pymoo_hdte.discrepancy.drive import rattling
from pymoo_hdte.discrepancy.drive.steady_states import merged
from pymoo_hdte.discrepancy.engine.candidate import Layout
from pymoo_hdte.discrepancy.engine.fitting import fit
from pymoo_hdte.drive.effects import LawAtPort
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.stiffness import SoftWindup

LOADED_OR_NOT = [(rpm, load) for rpm in (10.0, 2000.0) for load in (0.0, 10.0, 20.0, 40.0)]


@pytest.fixture(scope="module")
def data():
    return known_data()


@pytest.fixture(scope="module")
def softening():
    return (LawAtPort("soft_windup", "mesh", SoftWindup(0.3, 5e-4, 4.0)),)


def test_a_record_without_a_steady_state_makes_no_slope_of_the_jump(data, softening):
    """A quotient of a prediction with the law and one without would tell of the law's size."""
    records = len(data.features.records)
    values = Layout(data.base).array("start")[None]
    here = data.prediction(values, softening)
    lost = np.arange(records) == 2
    start = replace(here.balance.rows(slice(records)), converged=~lost)
    there = data.prediction(values, softening, start, for_slopes=True)
    assert np.array_equal(there.balance.converged, ~lost)
    plain = data.features.of_prediction(data.prediction(values, ()))[0]
    with_law = data.features.of_prediction(here)[0]
    found = data.features.of_prediction(there)[0]
    assert np.allclose(found[lost], plain[lost], rtol=1e-5, atol=1e-9)
    assert np.allclose(found[~lost], with_law[~lost], rtol=1e-5, atol=1e-9)
    assert not np.allclose(plain[lost], with_law[lost], rtol=1e-2, atol=1e-7)
    # What is not for slopes is tried anew.
    assert data.prediction(values, softening, start).balance.converged.all()


def test_merged_rows_keep_their_own_tangents(data):
    values = Layout(data.base).array("start")[None]
    # Memory needs a matrix for every row.
    springs = (LawAtPort("hysteresis", "mesh", MaxwellSlip(5.0, 1e-4)),)
    whole = data.prediction(values, springs).balance
    places = [np.array([0, 3]), np.array([1, 2])]
    found = merged([whole.rows(rows) for rows in places], places)
    for mine, own in zip(found.tangents.factors(), whole.tangents.factors()[:4], strict=True):
        assert all(np.array_equal(one, other) for one, other in zip(mine, own, strict=True))


@pytest.fixture(scope="module")
def swept():
    """Records whose sweep speaks for a soft wind-up."""
    rng = np.random.default_rng(5)
    data, _ = measured((), rng, known_data(LOADED_OR_NOT))
    data = with_sweep(data, listed(data, "soft_windup").build((0.3, 3e-4, 3.0)), rng)
    assert rattling.leading_sweep_effect(data, rattling.fit(data), library(data)) == "soft_windup"
    return data


def named(*names):
    return SimpleNamespace(effects=[SimpleNamespace(name=name, listed=True) for name in names])


def answer(*names, status="named", more=False, rivals=(), renewed=None):
    return SimpleNamespace(
        status=status,
        chosen=named(*names),
        equivalent=rivals,
        leaves_more_than_noise=more,
        renewed=renewed,
    )


HARDENING = "hardening_stiffness"
SOFT = answer("soft_windup", HARDENING, more=True)
PLAY = answer("backlash", HARDENING)


@pytest.mark.parametrize(
    ("of_all", "of_loaded", "kept"),
    [
        (SOFT, PLAY, 6),
        (answer("soft_windup", status="unlisted"), PLAY, 6),
        (SOFT, answer("soft_windup", HARDENING, rivals=[named("backlash", HARDENING)]), 6),
        # All records are explained: there is no reason to leave any out.
        (answer("soft_windup"), PLAY, 8),
        # The loaded records show no clearance beside another effect, or it leaves more than noise.
        (SOFT, answer("soft_windup", HARDENING), 8),
        (SOFT, answer("backlash"), 8),
        (SOFT, answer("backlash", HARDENING, more=True), 8),
        (SOFT, answer("backlash", HARDENING, status="unlisted"), 8),
    ],
)
def test_records_that_rattle_count_unless_a_clearance_explains_all_others(
    monkeypatch, swept, of_all, of_loaded, kept
):
    """A play with a soft skin beside a hardening was named a soft wind-up beside it."""

    def judge(some, base, candidates):
        return of_all if len(some.features.records) == len(LOADED_OR_NOT) else of_loaded

    monkeypatch.setattr(rattling, "judge", judge)
    found, _, verdict = rattling.judged(swept, lambda some, base: library(some))
    assert len(found.features.records) == kept
    assert verdict is (of_all if kept == len(LOADED_OR_NOT) else of_loaded)


def test_data_have_the_noise_that_they_were_judged_with(monkeypatch, swept):
    (law,) = (one for one in library(swept) if one.label == "kinematic_reaction:input")
    reaction = fit(swept, [law], steps=0)
    renewed = replace(swept, reference_effects=reaction.effects)
    monkeypatch.setattr(rattling, "judge", lambda *_: answer("kinematic_reaction", renewed=renewed))
    found, _, _ = rattling.judged(swept, lambda some, base: library(some))
    assert found.reference_effects == reaction.effects


@pytest.mark.parametrize(("name", "kept"), [("backlash", 6), (None, 8)])
def test_records_that_rattle_do_not_count_where_sweeps_speak_for_a_clearance(
    monkeypatch, name, kept
):
    data = known_data(LOADED_OR_NOT)
    monkeypatch.setattr(rattling, "leading_sweep_effect", lambda *_: name)
    monkeypatch.setattr(rattling, "judge", lambda *_: SOFT)
    found, _, _ = rattling.judged(data, lambda some, base: [])
    assert len(found.features.records) == kept
