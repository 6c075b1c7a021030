"""Traps: without their safeguards a clean drive looks faulty, or a new zero like a drift."""

from dataclasses import replace

import numpy as np
import pytest
from quick_campaigns import quick_analysis, quick_campaign

from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._selection import fitted_sets
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts.drive import examine_drive
from pymoo_hdte.units import ARCSEC


@pytest.fixture(scope="module", params=[1, pytest.param(2, marks=pytest.mark.nightly)])
def seed(request):
    return request.param


@pytest.fixture(scope="module")
def clean(seed):
    return quick_campaign(seed)


@pytest.fixture
def unsearched(monkeypatch):
    """Leave the candidates as screened: to fit them only names what the alarm is already about."""

    def as_screened(data, candidates, start, *settings, **named):
        return fit(data, candidates, start, 1)

    monkeypatch.setattr(fitted_sets, "fit", as_screened)
    return replace(RULES, most_fitted=1, most_effects=1)


def test_a_clean_drive_is_adequate(seed):
    """Fails when either safeguard is taken out of the code."""
    assert quick_analysis(seed).verdict.status == "adequate"


@pytest.mark.nightly
def test_a_clean_campaign_without_a_sweep_is_adequate(clean):
    without = replace(clean, torsion=())
    assert examine_drive(without).verdict.status == "adequate"


@pytest.mark.nightly
def test_a_frozen_base_makes_effects_of_its_own_errors(clean, unsearched):
    frozen = replace(clean.believed, tolerance=RULES.least_tolerance)
    assert examine_drive(replace(clean, believed=frozen), unsearched).verdict.status != "adequate"


@pytest.mark.nightly
def test_repeatability_left_out_is_a_false_alarm(clean, unsearched):
    exact = replace(clean.rig, repeatability=0.0)
    assert examine_drive(replace(clean, rig=exact), unsearched).verdict.status != "adequate"


@pytest.mark.nightly
def test_a_small_change_of_the_zero_is_no_drift():
    """Too small to be told from a smooth drift by means alone, it was named thermal drift."""
    clean = quick_campaign(1)
    moved = [
        replace(one, output_angle=one.output_angle + ARCSEC) if one.elapsed > 65.0 else one
        for one in clean.running
    ]
    finding = examine_drive(replace(clean, running=tuple(moved)))
    assert finding.verdict.status == "adequate"
    assert "new_zero" in {nuisance.name for nuisance, _ in finding.nuisances}


@pytest.mark.nightly
def test_repeatability_of_one_channel_only_is_a_false_alarm(clean, unsearched, monkeypatch):
    carried = Data._repeatability

    def of_the_transmission_error(self, layout, start):
        own = np.zeros(self.features.values.shape[1])
        own[[0, *self.features.places(0).ravel()]] = 1.0
        return carried(self, layout, start) * np.outer(own, own)

    monkeypatch.setattr(Data, "_repeatability", of_the_transmission_error)
    assert examine_drive(clean, unsearched).verdict.status != "adequate"
