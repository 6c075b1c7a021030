"""A user's kind of machine, defined in one file, goes through verdict, report and revision."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from places import DOCS

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import analyse, read_revised_values

sys.path.insert(0, str(DOCS / "examples"))

from ring_down import Oscillator, RingDown

STIFFNESS, FREQUENCY, DAMPING, NOISE = 4e3, 63.0, 0.8, 2e-6
FRICTION = 0.03
STARTS = {"wide": 4e-3, "less": 3e-3, "little": 2e-3, "narrow": 1.5e-3, "between": 2.5e-3}


def amplitudes(start, friction, count=90):
    """Turning points in closed form, as each half cycle swings about a place of its own.

    Den Hartog, Transactions of the ASME 53 (1931): viscous and dry friction together.
    """
    ratio = DAMPING * FREQUENCY / (2.0 * STIFFNESS)
    shrink = np.exp(-np.pi * ratio / np.sqrt(1.0 - ratio**2))
    shift, found = friction / STIFFNESS, [start]
    while len(found) < count and found[-1] > 4.0 * shift:
        found.append((found[-1] - shift) * shrink - shift)
    return np.array(found)


def oscillator(friction, rng, damping=DAMPING):
    records = []
    for name, start in STARTS.items():
        role = "held_out" if name == "between" else "train"
        true = amplitudes(start, friction)
        records.append(RingDown(name, role, true + NOISE * rng.standard_normal(len(true))))
    return Oscillator(STIFFNESS, FREQUENCY, damping, 0.2, NOISE, records)


@pytest.fixture(scope="module")
def machine():
    return oscillator(FRICTION, np.random.default_rng(1), damping=0.85)


@pytest.fixture(scope="module")
def analysis(machine):
    return analyse(machine)


@pytest.fixture(scope="module")
def report(analysis, tmp_path_factory):
    out = tmp_path_factory.mktemp("ring_down") / "report"
    analysis.report(out)
    return out


def test_a_machine_without_friction_needs_none():
    clean = analyse(oscillator(0.0, np.random.default_rng(2), damping=0.85))
    assert clean.verdict.status == "adequate"
    assert clean.revised_model().values["damping"] == pytest.approx(DAMPING, rel=0.01)


@pytest.mark.slow
def test_dry_friction_is_named_with_its_level(analysis):
    assert analysis.verdict.status == "named"
    (friction,) = analysis.revised_model().effects
    assert friction.name == "coulomb_friction"
    assert friction.law.level == pytest.approx(FRICTION, rel=0.02)
    assert analysis.revised_model().values["damping"] == pytest.approx(DAMPING, rel=0.02)


@pytest.mark.slow
def test_no_effect_of_a_machine_of_one_s_own_is_a_nuisance_of_a_bench(machine, monkeypatch):
    """Its ports may be called "load": what hangs there was then explained, and nothing was said."""
    model = type(machine.evidence(machine.records))
    candidates = model.candidates
    monkeypatch.setattr(
        model,
        "candidates",
        lambda self, base: [replace(one, nuisance=True) for one in candidates(self, base)],
    )
    assert analyse(machine).verdict.status == "named"


@pytest.mark.slow
def test_held_out_test_is_predicted_to_the_noise(analysis):
    errors = analysis.validate()
    assert errors.overall.before > 5.0
    assert errors.overall.after == pytest.approx(1.0, abs=0.3)


@pytest.mark.slow
def test_report_and_location_say_the_same(analysis, report):
    document = json.loads((report / "verdict.json").read_text())
    assert document["status"] == "named"
    level = document["effects"][0]["parameters"]["level"]
    assert level["unit"] == "N"
    assert level["interval95"][0] < FRICTION < level["interval95"][1]
    assert document["location"]["sentence"] == analysis.locate().sentence
    assert document["next_experiment"]["record"] in STARTS
    assert document["next_experiment"]["description"] in (report / "report.html").read_text()


@pytest.mark.slow
def test_revised_model_is_believed_and_nothing_is_missing_any_more(machine, report):
    revised = read_revised_values(report / "revised_model.toml")
    again = replace(machine, damping=revised.values["damping"], known=revised.effects)
    assert analyse(again).verdict.status == "adequate"


@pytest.mark.slow
def test_records_of_no_use_are_refused(machine):
    held_out = [replace(record, role="held_out") for record in machine.records]
    with pytest.raises(InvalidInput, match="number of train records"):
        analyse(replace(machine, records=held_out))
    with pytest.raises(InvalidInput, match="role of wide"):
        analyse(replace(machine, records=[replace(machine.records[0], role="both")]))
    lost = replace(machine.records[0], amplitudes=np.array([1e-3, np.nan]))
    with pytest.raises(InvalidInput, match="residuals of amplitude in record 0"):
        analyse(replace(machine, records=[lost]))
