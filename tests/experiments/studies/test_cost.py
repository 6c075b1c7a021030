"""The page on cost: its ratios are those of its times, and only marked tables hold times."""

import pytest

from experiments.published_values import (
    BATCH_MODEL_SECONDS,
    BATCH_SURROGATE_SECONDS,
    SPEED_UPS,
)
from experiments.runner.registry import Context
from experiments.studies import cost
from experiments.studies.cost import LITTLE, Seconds
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.result import OF_MODELS
from pymoo_hdte.drive import preset, simulate_drive


def results(tmp_path, monkeypatch, pace):
    """Return the page on a machine on which everything takes so many times as long."""
    seconds = {"published": 1.0, "calibrated": 2.0, "resonant": 3.0}

    def measured(name):
        slow = pace * seconds[name]
        return Seconds(name, 200.0 * slow, slow, 0.1 * slow, 1e-4 * slow)

    monkeypatch.setattr(cost, "_measured", measured)
    monkeypatch.setattr(cost, "_direct_seconds", lambda: 0.01 * pace)
    return cost.run(Context(1, tmp_path, Campaign(tmp_path)))


def steady(result):
    """Return everything that is stored apart from wall times."""
    tables = [table for table in result.tables if not table.wall_times]
    return result.answer, result.paragraphs, dict(result.first_page), result.notes, tables


def test_nothing_outside_the_marked_tables_depends_on_how_long_it_took(tmp_path, monkeypatch):
    slow, fast = (results(tmp_path, monkeypatch, pace) for pace in (1.7, 0.3))
    assert steady(slow) == steady(fast)
    assert set(slow.first_page) == {OF_MODELS}


def test_ratios_are_those_of_the_times(tmp_path, monkeypatch):
    (times,) = (t for t in results(tmp_path, monkeypatch, 1.0).tables if t.name == "times")
    *ours, paper = times.rows
    for _, integration, _, steady_state, surrogate, *ratios in ours:
        expected = integration / surrogate, steady_state / surrogate, integration / steady_state
        assert ratios == pytest.approx(expected)
    assert (paper[1], paper[4]) == (BATCH_MODEL_SECONDS, BATCH_SURROGATE_SECONDS)
    assert round(paper[1] / paper[4]) == paper[5] == SPEED_UPS[1]


def test_a_model_that_takes_long_is_not_said_to_need_no_surrogate(tmp_path, monkeypatch):
    fast, slow = (results(tmp_path, monkeypatch, pace) for pace in (1.0, 20.0 * LITTLE))
    assert fast.answer != slow.answer
    agreed = [
        [f.agrees for t in page.tables if t.name == "times" for f in t.findings]
        for page in (fast, slow)
    ]
    assert agreed[0] == [True, True]
    assert agreed[1] == [True, False]


def test_what_is_timed_are_the_same_dtes():
    """Integration, harmonic balance and steady state give one DTE, so that their times compare."""
    entry = cost._measured("resonant")
    assert min(entry.integration, entry.balance, entry.steady_state, entry.surrogate) > 0.0
    assert entry.integration > entry.steady_state > entry.surrogate
    model = preset("resonant")
    integrated = simulate_drive(model, model.nominal, method=cost.METHOD).dte_arcsec()
    points = model.nominal[None]
    assert cost.balanced_dte(model, points)[0] == pytest.approx(integrated, rel=1e-4)
    assert model.dte_arcsec(points)[0] == pytest.approx(integrated, rel=1e-2)
