"""Fits that decide a verdict have converged: no other start ends at a lower chi-square."""

from functools import partial

import numpy as np
import pytest
from analysed_campaigns import CONDITIONS, LISTED, analysed, ripple_analysis
from planted_features import judged, known_data, listed, measured
from quick_campaigns import quick_analysis, ripple_analysis_and_report
from verdict_cases import case_campaign
from virtual_rig_cases import BELIEVED, RIG, effect, true_rig

from experiments.studies.blind.campaigns import campaign_of, hiding
from experiments.studies.blind.cases import Case
from experiments.studies.virtual_rig.rig import run_campaign
from pymoo_hdte.discrepancy import analyse
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.hypothesis import hypothesis_of, label_of
from pymoo_hdte.discrepancy._selection.starts import best_fit
from pymoo_hdte.drive._solve import free_angle

STARTS = 10
SAME = 0.1
"""Chi-square within which two fits are the same."""
REACH = 2.0
"""Farthest start from a believed or typical value, in its tolerance or its size."""
CASES = (
    *("coulomb", "coulomb-gap", "coulomb-noise-x3", "coulomb-one-load", "cubic-drag"),
    *("drag-coulomb", "hardening-soft-windup", "kinematic-eccentricity"),
    *("load-dependent-friction", "nothing-all-values-off", "stiffness-off"),
    *("nothing-encoder-spikes", "nothing-encoder-jump", "rig-11", "amplitude-off"),
    "load-dependent-order",
)


def random_start(parameters, rng):
    """Draw values around where they are believed or guessed, within their bounds."""
    start = np.array([one.start for one in parameters])
    reach = REACH * np.array([one.scale for one in parameters])
    lower = np.maximum([one.lower for one in parameters], start - reach)
    upper = np.minimum([one.upper for one in parameters], start + reach)
    return rng.uniform(lower, upper)


def differences(data, fitted, others):
    """Return what ten fits from random starts leave beyond a fit: chi-square, shape (10,).

    Each is fitted as the sets that decide are: from other starts, too, beside the other sets.
    """
    rng = np.random.default_rng(1)
    starts = [random_start(fitted.parameters, rng) for _ in range(STARTS)]
    fits = [hypothesis_of(fit(data, fitted.candidates, start), 0.0) for start in starts]
    again = [best_fit(data, one, (), others) for one in fits]
    return np.array([one.chi_square for one in again]) - fitted.chi_square


def compared(verdict):
    """Return the fits that decide a verdict: of the named set and of those it is not told from.

    Other alternatives stay where their sets were, and are not fitted to the records of the verdict.
    """
    if verdict.chosen is None:
        return [verdict.base]
    return [verdict.chosen.fit, *(other.fit for other in verdict.equivalent)]


def friction():
    """Fits of a drive with dry friction at its input, beside a law that contains it."""
    rig = true_rig(effect("input", coulomb=0.05, rounding_speed=0.2))
    campaign = run_campaign(rig, BELIEVED, RIG, np.random.default_rng(7), CONDITIONS)
    clean = analysed(campaign, status="adequate")
    labels = ("coulomb_friction:input", "stribeck_friction:input")
    laws = [one for one in LISTED if one.label in labels]
    verdict = judged(clean.data, laws)
    # The noise is that of the drive with friction.
    data = clean.data.with_noise_of(verdict.chosen.fit) or clean.data
    return data, compared(verdict)


def ripple():
    """The fit of a drive with a ripple of its motor torque."""
    found = ripple_analysis()
    return found.data, [found.verdict.chosen.fit]


def nothing():
    """The fit of a drive that is as believed."""
    found = quick_analysis(1)
    return found.finding.data, compared(found.verdict)


@pytest.mark.nightly
@pytest.mark.parametrize(("fits", "share"), [(nothing, 1.0), (ripple, 1.0), (friction, 0.2)])
def test_no_start_ends_below_the_fits_that_decide(fits, share):
    hold(*fits(), share)


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["quick-ripple", *CASES])
def test_no_start_ends_below_the_fits_that_decide_a_case(name):
    if name == "quick-ripple":
        analysis, _ = ripple_analysis_and_report()
    else:
        analysis = analyse(case_campaign(name))
    data = analysis.finding.data
    hold(data, compared(analysis.verdict), 0.2)


def hold(data, found, share):
    """Compare fits with those from random starts, of which a least share ends where they did.

    The others stop at local minima: where Stribeck's excess has faded below all speeds it changes
    nothing, and nothing leads back; and a damping at one end of its tolerance hides some friction.
    """
    others = [hypothesis_of(one, 0.0) for one in found]
    for one in found:
        label = [candidate.label for candidate in one.candidates]
        beyond = differences(data, one, others)
        print(label, np.sort(beyond).round(2))
        assert beyond.min() > -SAME, label
        assert np.mean(beyond < SAME) >= share, label


def of_blind_single(index):
    """A campaign of the blind rig with one effect, from a seed that no blind case has."""
    hidden = hiding(Case("single", index, 34))
    return campaign_of(hidden, hidden.session)


@pytest.mark.nightly
@pytest.mark.parametrize(
    "campaign",
    [
        # No record shows whether a friction falls: once it was fitted before one that does not.
        partial(case_campaign, "coulomb-noise-x3"),
        # Its clearance varies less than the phase of a line of the error can hide.
        partial(of_blind_single, 4),
    ],
)
def test_fits_leave_the_same_however_many_rows_are_solved_at_once(campaign, monkeypatch):
    """A row begins from those beside it, so that rounding differs, and the way a search goes."""
    there, left, names = campaign(), [], []
    for rows in (48, 64, 96, 256):
        monkeypatch.setattr(free_angle, "_ROWS_AT_ONCE", rows)
        analysis = analyse(there)
        verdict = analysis.verdict
        left.append({label_of(one.candidates): one.chi_square for one in compared(verdict)})
        names.append([one.label for one in (verdict.chosen, *verdict.equivalent)])
    assert all(each.keys() == left[0].keys() for each in left)
    for label in left[0]:
        assert np.ptp([each[label] for each in left]) < SAME, label
    assert all(each == names[0] for each in names)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("inertia", "stiffness"), [pytest.param(0.08, 0.92, marks=pytest.mark.nightly), (0.3, 1.0)]
)
def test_an_inertia_beyond_the_load_s_is_found_past_the_resonance(inertia, stiffness):
    """A fit from near the believed load ends at none, and parameters at bounds leave less."""
    conditions = [(150.0, 5.0), (500.0, 20.0), (1000.0, 30.0), (1500.0, 40.0), (2000.0, 10.0)]
    empty = known_data(conditions, [1.0, 2.0, 2.02, 3.0])
    load = listed(empty, "load_inertia")
    effect = load.build((inertia,))
    data = measured(effect, np.random.default_rng(1), empty, stiffness=stiffness)[0]
    verdict = judged(data, [load])
    assert (verdict.status, verdict.chosen.label) == ("named", load.label)
    # Data leave the share of it open that the believed load inertia may have: a tenth of 0.08.
    assert verdict.chosen.fit.values[-1] == pytest.approx(inertia, abs=0.02)
