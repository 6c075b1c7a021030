"""Every value at both of its bounds goes through fit, validation, report and revised model."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from analysed_campaigns import ripple_analysis
from made_verdicts import made_verdict
from measured_oscillator import nothing, with_held_out
from night import others_at_night

from pymoo_hdte.discrepancy import read_mechanism_model
from pymoo_hdte.discrepancy._answers.next_test_mechanism import next_test
from pymoo_hdte.discrepancy._answers.revision_drive import drive_model
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import measured_data
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import base_parameters
from pymoo_hdte.discrepancy._report.mechanism import write_mechanism_report
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.discrepancy._verdicts.mechanism_simulation import simulate_held_out
from pymoo_hdte.discrepancy._verdicts.validation_drive import validate_drive
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import validate_mechanism
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port
from pymoo_hdte.mechanism.believed import LARGEST_FACTOR, SMALLEST_SHARE

CUTOFF = 20.0
QUANTITIES = ("inertia of x", "stiffness of spring", "damping of spring", "gain of force")
LIMITS = {"tolerance": 1.0, "factor": LARGEST_FACTOR}
BOUNDS = pytest.mark.parametrize("bound", ["lower", "upper"])


def oscillator(**limits):
    """The oscillator of `measured_oscillator`, nothing of which is known but within limits."""
    return Mechanism(
        {"x": BelievedValue(1.0, **limits)},
        [Port("spring", {"x": 1.0}, BelievedValue(4e3, **limits), BelievedValue(4.0, **limits))],
        [Input("force", {"x": 1.0}, BelievedValue(1.0, **limits))],
        angles=[],
    )


@pytest.mark.parametrize(
    "case",
    others_at_night(
        product(QUANTITIES, ("lower", "upper"), ("tolerance", "factor")),
        # Zero is the bound at which something may end; a factor bounds all quantities alike.
        *product(QUANTITIES, ("lower",), ("tolerance",)),
        ("stiffness of spring", "upper", "factor"),
    ),
    ids="-".join,
)
def test_a_mechanism_is_proved_reported_and_believed_again(case, tmp_path):
    """An inertia that a fit took to zero ended the analysis: "inertia of x is 0.0"."""
    quantity, bound, kind = case
    mechanism, records = oscillator(**{kind: LIMITS[kind]}), tuple(with_held_out(nothing))
    data = measured_data(mechanism, records[:1], CUTOFF)
    start = np.array([getattr(p, bound if p.name == quantity else "start") for p in data.base])
    base = fit(data, (), start, steps=0)
    assert base.values.tolist() == start.tolist()
    assert quantity in base.at_bounds
    verdict = made_verdict("unlisted", base, freedom=len(base.residuals) - len(base.values))
    simulated = simulate_held_out(mechanism, records, data, (base, base))
    finding = MechanismFinding(mechanism, records, CUTOFF, data, verdict, simulated=simulated)
    out = tmp_path / "report"
    document = write_mechanism_report(
        "rig", finding, validate_mechanism(finding), next_test(finding), out
    )
    told = document["base"][quantity]
    assert told["at_bound"]
    assert told["interval95"][0] > 0.0
    revised = read_mechanism_model(out / "revised_model.toml").mechanism
    # What is zero is no longer a value of the model, and could never be fitted again.
    assert {name: one.value for name, one in revised.quantities.items()} == pytest.approx(
        dict(zip([p.name for p in data.base], start.tolist(), strict=True))
    )
    again = measured_data(revised, records[:1], CUTOFF)
    assert [one.name for one in again.base] == [one.name for one in data.base]


@pytest.mark.parametrize("value", [2.0, -2.0])
def test_bounds_of_a_fit_are_those_of_the_file_without_zero(value):
    whole, half = BelievedValue(value, tolerance=1.0), BelievedValue(value, tolerance=0.5)
    assert half.fit_limits == half.limits
    assert sorted(map(abs, whole.limits)) == [0.0, 4.0]
    assert sorted(map(abs, whole.fit_limits)) == pytest.approx([2.0 * SMALLEST_SHARE, 4.0])
    assert all(limit * value > 0.0 for limit in whole.fit_limits)


@BOUNDS
def test_a_drive_is_proved_and_revised(bound):
    finding = ripple_analysis()
    fitted = finding.verdict.chosen.fit
    for row, parameter in enumerate(fitted.parameters[: fitted.n_base]):
        values = fitted.values.copy()
        values[row] = getattr(parameter, bound)
        chosen = replace(finding.verdict.chosen, fit=replace(fitted, values=values))
        there = replace(finding, verdict=replace(finding.verdict, chosen=chosen))
        validation = validate_drive(there)
        assert np.isfinite([error.after for error in validation.channels.values()]).all()
        model = drive_model(finding.campaign, chosen.fit, "revised", "at a bound")
        assert np.all(np.isfinite(model.dte_arcsec(model.nominal[None])))


@BOUNDS
@pytest.mark.parametrize("name", ["damping", "input_damping", "output_damping", "load_inertia"])
def test_a_drive_is_revised_where_nothing_is_believed(name, bound):
    finding = ripple_analysis()
    believed = replace(finding.campaign.believed, **{name: 0.0})
    campaign, fitted = replace(finding.campaign, believed=believed), finding.verdict.chosen.fit
    unknowns = base_parameters(believed, campaign.rig, [0.0] * len(believed.error_orders), 0.0)
    (parameter,) = [one for one in unknowns if one.name == name]
    values = fitted.values.copy()
    values[[one.name for one in fitted.parameters].index(name)] = getattr(parameter, bound)
    model = drive_model(campaign, replace(fitted, values=values), "revised", "at a bound")
    assert np.all(np.isfinite(model.dte_arcsec(model.nominal[None])))
