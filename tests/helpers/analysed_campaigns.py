"""Campaigns of few short records, fitted with one effect only or with none."""

import numpy as np
from kept_results import kept
from made_verdicts import made_verdict
from planted_features import SCALES
from virtual_rig_cases import BELIEVED, RIG, effect, true_rig

from experiments.studies.virtual_rig.rig import run_campaign
from experiments.studies.virtual_rig.runs import Condition
from pymoo_hdte.discrepancy._evidence.order_lines.candidates import drive_candidates
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data, start_parameters
from pymoo_hdte.discrepancy._evidence.order_lines.features import measure
from pymoo_hdte.discrepancy._evidence.order_lines.sizes import port_sizes
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding

ORDERS = [1.0, 2.0, 2.02, 3.0, 4.0, 6.0]
CONDITIONS = tuple(
    Condition(speed, load, 1000.0, 1, role)
    for speed, load, role in (
        (1000.0, 10.0, "train"),
        (1000.0, 40.0, "train"),
        (1400.0, 20.0, "train"),
        (2000.0, 40.0, "train"),
        (1000.0, 0.0, "held_out"),
        (1400.0, 40.0, "held_out"),
        (2000.0, 10.0, "held_out"),
    )
)
LISTED = drive_candidates(port_sizes(BELIEVED, [6.0], [6.0], SCALES))


def analysed(campaign, label=None, status="named"):
    """Return what the workflow finds when it fits the effect ``label`` only."""
    features = measure(campaign, campaign.train, ORDERS)
    data = Data(campaign, features, start_parameters(campaign, features))
    base = fit(data)
    chosen = None
    if label is not None:
        (candidate,) = (one for one in LISTED if one.label == label)
        start = np.concatenate([base.values, candidate.starts[0]])
        chosen = Hypothesis(fit(data, (candidate,), start), 0.0, 1.0)
    degrees_of_freedom = len(base.residuals) - len(base.values)
    return DriveFinding(
        campaign, data, made_verdict(status, base, chosen, freedom=degrees_of_freedom), ()
    )


@kept
def ripple_analysis():
    """Return what is found on a rig whose motor torque has a ripple."""
    rig = true_rig(effect("input", ripple=0.015, ripple_order=6.0, ripple_phase=0.7))
    campaign = run_campaign(rig, BELIEVED, RIG, np.random.default_rng(5), CONDITIONS)
    return analysed(campaign, "torque_ripple:input@6")


@kept
def clean_analysis():
    """Return what is found on a rig that is as believed."""
    campaign = run_campaign(true_rig(), BELIEVED, RIG, np.random.default_rng(6), CONDITIONS)
    return analysed(campaign, status="adequate")
