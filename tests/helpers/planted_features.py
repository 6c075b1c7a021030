"""Campaigns without raw records: what a known drive gives, with noise of known covariance."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
from made_verdicts import made_verdict
from virtual_rig_cases import BELIEVED, PHASES, RIG

from pymoo_hdte.discrepancy._evidence.order_lines.candidates import drive_candidates
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._evidence.order_lines.features import Features
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import base_parameters
from pymoo_hdte.discrepancy._evidence.order_lines.prediction import Conditions, coefficients_of
from pymoo_hdte.discrepancy._evidence.order_lines.sizes import Scales, port_sizes
from pymoo_hdte.discrepancy._evidence.order_lines.torsion_curve import TorsionPoints
from pymoo_hdte.discrepancy._selection.candidate import Layout
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis
from pymoo_hdte.discrepancy._verdicts import records_judged
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.drive import mean_torsion
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

ORDERS = np.array([1.0 / 101.0, 1.0, 2.0, 2.02, 3.0, 6.0])
SCALES = Scales(210.0, 40.0, 0.5, 2000.0, 8.0 * ARCSEC, 0.01, 1.0, swept=True)
"""Of a typical campaign on a drive of this size with something missing."""
SWEEP_NOISE = 0.05 * ARCSEC
CONDITIONS = [(rpm, load) for rpm in (10.0, 2000.0) for load in (0.0, 10.0, 20.0, 30.0, 40.0)]


def known_data(conditions=CONDITIONS, orders=ORDERS):
    """Noise of a typical campaign, no record behind it, and features all zero."""
    speed, load = np.array(conditions).T
    size = 2 + 8 * len(orders)
    m = len(orders)
    lines = np.repeat([0.03 * ARCSEC, 1e-4, 6e-3, 3.0 * ARCSEC], 2 * m)
    deviation = np.concatenate([[0.03 * ARCSEC, 1e-4], lines])
    correlation = np.eye(size)
    correlation[2 : 2 + m, 2 + m : 2 + 2 * m] = 0.3 * np.eye(m)
    correlation[2 + m : 2 + 2 * m, 2 : 2 + m] = 0.3 * np.eye(m)
    no_bends = np.zeros((len(speed), 3, 1 + m), dtype=complex)
    names = [f"run_{k}" for k in range(len(speed))]
    records = tuple(
        SimpleNamespace(
            name=name, input_speed=s * REVOLUTION_PER_MINUTE, load_torque=t, reading_errors=()
        )
        for name, (s, t) in zip(names, conditions, strict=True)
    )
    features = Features(
        records,
        Conditions(speed * REVOLUTION_PER_MINUTE, load, 100.0 * np.arange(len(speed)), no_bends),
        np.array(orders),
        np.zeros((len(speed), size)),
        np.tile(correlation * np.outer(deviation, deviation), (len(speed), 1, 1)),
    )
    campaign = SimpleNamespace(
        believed=BELIEVED,
        rig=RIG,
        train=records,
        running=records,
        held_out=(),
        good_enough_error=None,
        good_enough_torque=None,
        title="planted",
        torque_scale=1.0,
    )
    return Data(campaign, features, base_parameters(BELIEVED, RIG, PHASES, 0.0))


FEW = known_data(
    [(10.0, 5.0), (40.0, 40.0), (150.0, 5.0), (500.0, 20.0), (1200.0, 40.0), (2000.0, 10.0)],
    [1.0, 2.0, 2.02],
)
"""Records enough beside a sweep."""


def measured(effects=(), rng=None, data=None, **changes):
    """Data whose features a true drive gives, with noise of their covariance from ``rng``.

    ``changes`` are factors on base parameters; records and orders are those of ``data``.
    """
    data = known_data() if data is None else data
    layout = Layout(data.base)
    truth = layout.array("start")
    for name, value in changes.items():
        truth[layout.index(name)] *= value
    values = data.predict(truth[None], effects)[0]
    if rng is not None:
        noise = rng.standard_normal(values.shape)
        # An error that does not repeat is a motion, and what a channel shows of it the drive's.
        true_noise = replace(data, reference=truth, reference_effects=tuple(effects)).whiteners
        values = values + np.einsum("rij,rj->ri", true_noise, noise)
    return replace(data, features=replace(data.features, values=values)), truth


def with_sweep(data, effects=(), rng=None, **changes):
    """Add a torsion sweep up, down and up again of the same drive."""
    turns = np.array([0.0, 40.0, -40.0, 40.0])
    legs = [np.linspace(one, other, 21) for one, other in pairwise(turns)]
    path = np.concatenate([legs[0], *(leg[1:] for leg in legs[1:])])
    values = {p.name: np.array([p.start * changes.get(p.name, 1.0)]) for p in data.base}
    coefficients = coefficients_of(data.campaign.believed, values, effects, 1)
    stiffness = coefficients.stiffness * values["locked_stiffness"]
    angle = mean_torsion(replace(coefficients, stiffness=stiffness), path)[0]
    if rng is not None:
        angle = angle + SWEEP_NOISE * rng.standard_normal(len(angle))
    torque = (path[:-1] + path[1:]) / 2.0
    covariance = SWEEP_NOISE**2 * np.eye(len(angle))
    points = TorsionPoints(torque, angle, covariance, path, np.arange(len(angle)))
    return replace(data, torsion=(points,))


def library(data, seen=()):
    """All candidates; lines of unexpected order at those that were seen."""
    orders = data.features.orders.tolist()
    scales = replace(SCALES, swept=bool(data.torsion))
    return drive_candidates(port_sizes(data.campaign.believed, orders, seen, scales))


def listed(data, name, seen=()):
    return next(candidate for candidate in library(data, seen) if candidate.name == name)


def analysed(data, status="unlisted", candidate=None, start=()):
    base = fit(data)
    chosen = None
    if candidate is not None:
        chosen = Hypothesis(fit(data, (candidate,), np.concatenate([base.values, start])), 0.0, 1.0)
    verdict = made_verdict(status, base, chosen, freedom=len(base.residuals) - len(base.values))
    return DriveFinding(data.campaign, data, verdict, ())


def judged(data, candidates):
    """Return the verdict on planted data."""
    return records_judged._judged_on(data, fit(data), lambda *_: candidates)[1]
