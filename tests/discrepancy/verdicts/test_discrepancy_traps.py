"""Traps: without their safeguards a clean drive looks faulty, or a new zero like a drift."""

from dataclasses import replace

import numpy as np
import pytest
from quick_campaigns import quick_analysis, quick_campaign

from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts.drive import examine_drive
from pymoo_hdte.units import ARCSEC


@pytest.fixture(scope="module", params=[1, pytest.param(2, marks=pytest.mark.nightly)])
def seed(request):
    return request.param


@pytest.fixture(scope="module")
def clean(seed):
    return quick_campaign(seed)


@pytest.mark.slow
def test_a_clean_drive_is_adequate(seed):
    """Fails when either safeguard is taken out of the code."""
    assert quick_analysis(seed).verdict.status == "adequate"


@pytest.mark.nightly
def test_a_clean_campaign_without_a_sweep_is_adequate(clean):
    without = replace(clean, torsion=())
    assert examine_drive(without).verdict.status == "adequate"


@pytest.mark.nightly
def test_a_frozen_base_makes_effects_of_its_own_errors(clean):
    frozen = replace(clean.believed, tolerance=RULES.least_tolerance)
    assert examine_drive(replace(clean, believed=frozen)).verdict.status != "adequate"


@pytest.mark.nightly
def test_repeatability_left_out_is_a_false_alarm(clean):
    exact = replace(clean.rig, repeatability=0.0)
    assert examine_drive(replace(clean, rig=exact)).verdict.status != "adequate"


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
def test_repeatability_of_one_channel_only_is_a_false_alarm(clean, monkeypatch):
    carried = Data.repeatability.func

    def of_the_transmission_error(self):
        own = np.zeros(self.features.values.shape[1])
        own[[0, *self.features.places(0).ravel()]] = 1.0
        return carried(self) * own

    monkeypatch.setattr(Data, "repeatability", property(of_the_transmission_error))
    assert examine_drive(clean).verdict.status != "adequate"
