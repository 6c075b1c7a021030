"""Campaigns without raw records: what a known drive gives, with noise of known covariance."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from virtual_rig_cases import BELIEVED, PHASES, RIG

from pymoo_hdte.discrepancy.features import Features
from pymoo_hdte.discrepancy.fit import Data, fit
from pymoo_hdte.discrepancy.forward import Conditions
from pymoo_hdte.discrepancy.library import candidates
from pymoo_hdte.discrepancy.naming import Rival, Verdict
from pymoo_hdte.discrepancy.parameters import Layout, base_parameters
from pymoo_hdte.discrepancy.workflow import Analysis
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

ORDERS = np.array([1.0 / 101.0, 1.0, 2.0, 2.02, 3.0, 6.0])
CONDITIONS = [(rpm, load) for rpm in (10.0, 2000.0) for load in (0.0, 10.0, 20.0, 30.0, 40.0)]


def known_data():
    """Noise of a typical campaign, no record behind it, and features all zero."""
    speed, load = np.array(CONDITIONS).T
    size = 2 + 8 * len(ORDERS)
    m = len(ORDERS)
    lines = np.repeat([0.03 * ARCSEC, 1e-4, 6e-3, 3.0 * ARCSEC], 2 * m)
    deviation = np.concatenate([[0.03 * ARCSEC, 1e-4], lines])
    correlation = np.eye(size)
    correlation[2 : 2 + m, 2 + m : 2 + 2 * m] = 0.3 * np.eye(m)
    correlation[2 + m : 2 + 2 * m, 2 : 2 + m] = 0.3 * np.eye(m)
    names = [f"run_{k}" for k in range(len(speed))]
    records = tuple(
        SimpleNamespace(name=name, input_speed=s * REVOLUTION_PER_MINUTE, load_torque=t)
        for name, (s, t) in zip(names, CONDITIONS, strict=True)
    )
    features = Features(
        records,
        Conditions(speed * REVOLUTION_PER_MINUTE, load, 100.0 * np.arange(len(speed))),
        ORDERS,
        np.zeros((len(speed), size)),
        np.tile(correlation * np.outer(deviation, deviation), (len(speed), 1, 1)),
    )
    campaign = SimpleNamespace(believed=BELIEVED, rig=RIG, train=records, title="planted")
    return Data(campaign, features, base_parameters(BELIEVED, RIG, PHASES, 0.0))


def measured(effects=(), rng=None, **changes):
    """Data whose features a true drive gives, with noise of their covariance from ``rng``."""
    data = known_data()
    layout = Layout(data.base)
    truth = layout.array("start")
    for name, value in changes.items():
        truth[layout.index(name)] *= value
    values = data.predict(truth[None], effects)[0]
    if rng is not None:
        noise = rng.standard_normal(values.shape)
        values = values + np.einsum("rij,rj->ri", data.whiteners, noise)
    return replace(data, features=replace(data.features, values=values)), truth


def listed(data, name, orders=()):
    return next(
        c for c in candidates(data.campaign.believed, ORDERS.tolist(), orders) if c.name == name
    )


def analysed(data, status="unlisted", candidate=None, start=()):
    base = fit(data)
    chosen = None
    if candidate is not None:
        chosen = Rival(fit(data, (candidate,), np.concatenate([base.values, start])), 0.0, 1.0)
    verdict = Verdict(status, base, chosen, (), (), len(base.residuals) - len(base.values))
    return Analysis(data.campaign, data, verdict, ())
