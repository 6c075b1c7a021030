"""A static error that changed when the drive was mounted anew is told from one that is wrong."""

from dataclasses import replace

import numpy as np
import pytest
from kept_results import kept
from planted_features import SCALES
from quick_campaigns import CONDITIONS
from virtual_rig_cases import BELIEVED, RIG

from experiments.studies.virtual_rig.own_effects import with_effects
from experiments.studies.virtual_rig.rig import draw_rig, run_campaign
from pymoo_hdte.discrepancy import analyse, read_campaign, write_campaign
from pymoo_hdte.discrepancy._evidence.order_lines.candidates import drive_candidates
from pymoo_hdte.discrepancy._evidence.order_lines.sizes import port_sizes
from pymoo_hdte.discrepancy._report.document import effects_of
from pymoo_hdte.drive import ChangedStaticError
from pymoo_hdte.units import ARCSEC

NAME = ChangedStaticError.name


@kept
def campaign_in_two_series(stated):
    """Return a campaign after half of which the orders 1 and 2 change, and the changes."""
    rng = np.random.default_rng(5)
    rig = draw_rig(BELIEVED, (), rng)
    campaign = run_campaign(rig, BELIEVED, RIG, rng, CONDITIONS)
    times = sorted(record.elapsed for record in campaign.train)
    after = (times[3] + times[4]) / 2.0
    planted = [
        ChangedStaticError(1.0, 2.0 * ARCSEC, 0.4, after),
        ChangedStaticError(2.0, 3.0 * ARCSEC, 2.0, after),
    ]
    changed = with_effects(campaign, rig, planted)
    series = [1 + (record.elapsed > after) if stated else 1 for record in changed.running]
    running = [
        replace(record, series=number)
        for record, number in zip(changed.running, series, strict=True)
    ]
    return replace(changed, running=tuple(running)), planted


@pytest.mark.slow
@pytest.mark.parametrize("stated", [True, pytest.param(False, marks=pytest.mark.nightly)])
def test_a_hidden_change_is_named_with_its_lines(stated):
    campaign, planted = campaign_in_two_series(stated)
    analysis = analyse(campaign)
    assert analysis.verdict.status == "named"
    lines = [one for one in analysis.revised_model().effects if one.name == NAME]
    assert [line.order for line in lines] == [1.0, 2.0]
    (told,) = [one["parameters"] for one in effects_of(analysis.verdict)]
    for line, truth in zip(lines, planted, strict=True):
        found, hidden = (one.amplitude * np.exp(1j * one.phase) for one in (line, truth))
        assert abs(found - hidden) < 0.5 * ARCSEC
        # A document has cosines, each line with a phase of its own.
        amplitude, phase = (
            told[f"order_{line.order:g}_{number}"]["value"] for number in ("amplitude", "phase")
        )
        assert amplitude * np.exp(1j * phase) == pytest.approx(-1j * found, rel=0.01)


def test_files_keep_the_series(tmp_path):
    campaign, _ = campaign_in_two_series(True)
    write_campaign(campaign, tmp_path / "rig")
    read = read_campaign(tmp_path / "rig")
    assert {record.name: record.series for record in read.running} == {
        record.name: record.series for record in campaign.running
    }


def times_sought(**changes):
    orders = [1.0, 2.0, 3.0]
    sizes = port_sizes(BELIEVED, orders, orders, replace(SCALES, **changes))
    candidates = [one for one in drive_candidates(sizes) if one.name == NAME]
    for one in candidates:
        assert {effect.order for effect in one.build(one.starts[0])} == {1.0, 2.0}
    return sorted({effect.after for one in candidates for effect in one.build(one.starts[0])})


def test_it_is_sought_between_series_for_lines_that_the_drive_is_believed_to_have():
    assert times_sought(series=(500.0, 900.0)) == [500.0, 900.0]
    assert times_sought(series=()) == []
