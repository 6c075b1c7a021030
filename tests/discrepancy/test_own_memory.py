"""A user's effect with a memory, defined in one file, goes through verdict, report and revision."""

import json
import sys

import numpy as np
import pytest
from measured_oscillator import (
    DAMPING,
    FORCE_NOISE,
    MASS,
    OSCILLATOR,
    POSITION_NOISE,
    RATE,
    STIFFNESS,
    multisine,
)
from places import DOCS

from pymoo_hdte.discrepancy import MeasuredMechanism, analyse, read_mechanism_model
from pymoo_hdte.effects.effect import registered
from pymoo_hdte.effects.law import PortState, periodic_phase
from pymoo_hdte.mechanism import Record

sys.path.insert(0, str(DOCS / "examples"))

from gripping_seal import GRIPPING_SEAL, GrippingSeal

PLANTED = GrippingSeal(force=8.0, slip=0.003)
SUBSTEPS = 20


def record_of(seed, role, duration):
    """Return a record of the oscillator with the seal, by the leapfrog method in small steps."""
    time, lines, phases, scale = multisine(seed, duration=duration)
    step = 1.0 / (SUBSTEPS * RATE)
    fine = step * (0.5 + np.arange(SUBSTEPS * len(time)))
    waves = 2.0 * np.pi * lines
    force = np.zeros(len(fine))
    for wave, phase in zip(waves, phases, strict=True):
        force += scale * np.cos(wave * fine + phase)
    x = v = stretch = 0.0
    positions = np.empty(len(fine))
    for k, pull in enumerate(force.tolist()):
        positions[k] = x
        half = 0.5 * step * v
        x += half
        stretch = min(max(stretch + half, -PLANTED.slip), PLANTED.slip)
        hidden = PLANTED.force * (stretch / PLANTED.slip) ** 3
        v += step * (pull - DAMPING * v - STIFFNESS * x - hidden) / MASS
        half = 0.5 * step * v
        x += half
        stretch = min(max(stretch + half, -PLANTED.slip), PLANTED.slip)
    at = scale * np.cos(np.outer(time, waves) + phases).sum(axis=1)
    noise = np.random.default_rng(100 + seed).standard_normal((2, len(time)))
    channels = {
        "x": positions[::SUBSTEPS] + POSITION_NOISE * noise[0],
        "force": at + FORCE_NOISE * noise[1],
    }
    return Record(f"{role} {seed}", role, time, channels)


@pytest.fixture(scope="module")
def measured():
    """Two records of the oscillator, and nothing known of the seal."""
    records = [record_of(1, "train", 6.0), record_of(3, "held_out", 2.0)]
    return MeasuredMechanism(OSCILLATOR, records, title="seal")


@pytest.fixture(scope="module")
def analysis(measured):
    return analyse(measured, effects=[GRIPPING_SEAL])


@pytest.fixture(scope="module")
def report(analysis, tmp_path_factory):
    out = tmp_path_factory.mktemp("seal")
    with registered(GRIPPING_SEAL):
        analysis.report(out / "report")
    return out / "report"


@pytest.mark.slow
def test_verdict_names_it_and_no_loop_of_the_library(analysis):
    assert analysis.verdict.status == "named"
    assert [one.label for one in analysis.verdict.chosen.candidates] == ["gripping_seal:spring"]


@pytest.mark.slow
def test_report_tells_its_values_and_sentence(report):
    (effect,) = json.loads((report / "verdict.json").read_text())["effects"]
    assert effect["sentence"] == GRIPPING_SEAL.sentence.format(port="spring", force="force")
    for name in ("force", "slip"):
        assert effect["parameters"][name]["value"] == pytest.approx(
            getattr(PLANTED, name), rel=0.03
        )


@pytest.mark.nightly
def test_revised_model_holds_it_as_it_was_fitted(report, measured, analysis):
    with registered(GRIPPING_SEAL):
        model = read_mechanism_model(report / "revised_model.toml")
        (seal,) = model.effects
        assert isinstance(seal.law, GrippingSeal)
        again = analyse(measured.believing(model)).verdict
    assert all(one.name != "gripping_seal" for one in again.accepted.effects)
    # Nothing more is left than beside the fitted effect; corners between samples remain.
    assert again.base.chi_square == pytest.approx(analysis.verdict.accepted.chi_square, rel=0.05)


@pytest.mark.slow
def test_held_out_record_is_simulated_far_better_with_it(report):
    document = json.loads((report / "verdict.json").read_text())
    (simulated,) = [one for one in document["held_out"] if one["kind"] == "simulation"]
    assert simulated["after"] < 0.1 * simulated["before"]


def test_its_two_descriptions_agree():
    """Along a path, as harmonic balance asks, and step by step, as an integrator does."""
    path = 0.01 * np.sin(np.linspace(0.0, 20.0, 400)) * np.linspace(0.1, 1.0, 400)
    rest = np.zeros_like(path)
    state = PortState(path, rest, periodic_phase(rest), rest)
    kept, before, expected = np.zeros(1), 0.0, []
    for place in path:
        kept, before = PLANTED.moved(kept, place - before), place
        expected.append(PLANTED.torque(kept))
    np.testing.assert_allclose(PLANTED.respond(state).torque.ravel(), expected, atol=1e-12)
