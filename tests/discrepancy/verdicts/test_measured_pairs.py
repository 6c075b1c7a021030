"""Two effects that hide each other: found together, and the larger one named first."""

import numpy as np
import pytest

from pymoo_hdte.discrepancy._selection.reason import EXPLAINS_TOO_LITTLE
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.linear import DirectionalFriction
from pymoo_hdte.effects.stiffness import HardeningStiffness
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port, Record
from pymoo_hdte.mechanism.motion import SmoothedMotion
from pymoo_hdte.mechanism.port_motion import law_force


def lines(lowest, highest, duration, rate, size, seed, response=lambda omega: 1.0 / omega):
    """Return time, and a motion of random lines, Hz, with its derivatives."""
    generator = np.random.default_rng(seed)
    time = np.arange(0.0, duration, 1.0 / rate)
    omega = 2.0 * np.pi * np.arange(int(lowest * duration), int(highest * duration)) / duration
    amplitude = np.exp(1j * generator.uniform(0.0, 2.0 * np.pi, len(omega))) * response(omega)
    turned = np.exp(1j * np.outer(time, omega))
    parts = [(turned @ (amplitude * (1j * omega) ** order)).real for order in range(3)]
    scale = size / parts[0].std()
    return time, SmoothedMotion(*(scale * one for one in parts)), generator


def record_of(time, motion, force, noises, generator):
    noise = generator.standard_normal((2, len(time)))
    channels = {"x": motion.position + noises[0] * noise[0], "force": force + noises[1] * noise[1]}
    return Record("lines", "train", time, channels)


def machine(inertia, stiffness, damping):
    port = Port("spring", {"x": 1.0}, stiffness, damping)
    return Mechanism({"x": inertia}, [port], [Input("force", {"x": 1.0})])


def names(finding):
    return [one.name for one in finding.accepted.candidates]


def slipping_and_hardening(seed, disturbance=0.0):
    """A machine, and the record of one with springs that slip and a spring that hardens."""
    believed = machine(
        BelievedValue(2.0, 0.5), BelievedValue(5e4, 0.5), BelievedValue(10.0, factor=10.0)
    )

    def resonance(omega):
        return 1.0 / (8e4 - 2.0 * omega**2 + 60j * omega)

    time, motion, generator = lines(5.0, 60.0, 3.0, 750.0, 6e-4, seed, resonance)
    hidden = MaxwellSlip(62.0, 1.37e-3, 0.57), HardeningStiffness(1.95e10)
    force = 2.0 * motion.acceleration + 37.0 * motion.speed + 4e4 * motion.position
    force = force + sum(law_force(law, motion, 0.0) for law in hidden)
    force = force + disturbance * np.sin(2.0 * np.pi * 47.3 * time)
    return believed, record_of(time, motion, force, (1e-6, 0.1), generator)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.nightly)])
def test_springs_that_slip_and_a_spring_that_hardens_are_found_together(seed):
    """Each alone bends the believed stiffness so far that the other explains nothing beside it."""
    believed, record = slipping_and_hardening(seed)
    finding = examine_mechanism(believed, [record], 75.0)
    assert finding.verdict.status == "named"
    assert set(names(finding)) == {"hysteresis", "hardening_stiffness"}
    assert finding.accepted.values[0] == pytest.approx(2.0, rel=0.03)
    assert finding.share_removed > 0.9


@pytest.mark.nightly
def test_what_sets_the_noise_by_itself_is_no_plain_name_unless_it_explains_nine_tenths():
    """Beside a disturbance the same two effects are certain, but not that they are all."""
    believed, record = slipping_and_hardening(1, disturbance=7.0)
    finding = examine_mechanism(believed, [record], 75.0)
    assert RULES.main_share < finding.share_removed < RULES.explained_share
    assert set(names(finding)) == {"hysteresis", "hardening_stiffness"}
    assert finding.verdict.status == "partial"
    assert finding.verdict.has_reason(EXPLAINS_TOO_LITTLE)


@pytest.mark.nightly
def test_dry_friction_is_named_before_its_difference_between_the_directions():
    """At speeds that hardly vary, damping imitates all of the first and nothing of the second."""
    believed = machine(BelievedValue(100.0, 0.5), BelievedValue(0.0), BelievedValue(300.0, 1.0))
    time = np.arange(0.0, 40.0, 0.01)
    omega, size = 2.0 * np.pi * 0.25 * np.array([1.0, 3.0, 5.0]), 0.15 / np.array([1.0, 3.0, 5.0])
    turned = np.exp(1j * np.outer(time, omega))
    parts = [(turned @ (size * (1j * omega) ** order)).imag for order in range(-1, 2)]
    motion = SmoothedMotion(parts[0], parts[1], parts[2])
    generator = np.random.default_rng(3)
    force = 95.0 * motion.acceleration + 200.0 * motion.speed + 20.0 * np.sign(motion.speed)
    force = force + law_force(DirectionalFriction(0.2, 40.0), motion, 0.0)
    record = record_of(time, motion, force, (1e-6, 0.3), generator)
    finding = examine_mechanism(believed, [record])
    assert finding.verdict.status == "named"
    assert names(finding) == ["coulomb_friction", "direction_dependent_friction"]
    dry, turning = (one.law for one in finding.accepted.effects)
    assert dry.level == pytest.approx(20.0, rel=0.05)
    assert turning.viscous == pytest.approx(40.0, rel=0.05)
    # Values, residuals and their derivatives follow that order.
    accepted = finding.accepted
    stands = finding.data.objective(accepted.candidates)
    assert accepted.parameters == stands.parameters
    assert stands.residuals(accepted.values) == pytest.approx(accepted.residuals, abs=1e-9)
    slopes = stands.jacobian(accepted.values)
    sizes = np.linalg.norm(slopes, axis=0)
    assert np.all(np.linalg.norm(accepted.jacobian - slopes, axis=0) <= 0.05 * sizes)
