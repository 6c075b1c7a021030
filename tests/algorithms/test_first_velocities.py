"""First velocities: the law that the paper prints, and one that knows no origin."""

import numpy as np
import pytest
from pymoo.core.population import Population
from pymoo.problems import get_problem
from swarm_problems import Parabolas, digest, run

from pymoo_hdte.algorithms import (
    AMOPSO,
    AMPMOPSO,
    MOPSO,
    MPMOPSO,
    FirstStepWithinBounds,
    VelocityWithinBounds,
)
from pymoo_hdte.checks import InvalidInput

FAMILY = [MOPSO, AMPMOPSO, AMOPSO, MPMOPSO]


class MovedParabolas(Parabolas):
    """The same landscape with its origin elsewhere."""

    def __init__(self, by):
        super().__init__(xl=-1.0 + by, xu=2.0 + by)
        self.by = by

    def _evaluate(self, X, out, *args, **kwargs):
        super()._evaluate(X - self.by, out)


def first_flight(swarm, problem, seed):
    """Return positions and velocities of the first generation, and the bounds."""
    swarm.setup(problem, termination=("n_gen", 2), seed=seed)
    particles = swarm.ask()
    return particles.get("X"), particles.get("V"), *problem.bounds()


@pytest.mark.parametrize("algorithm", FAMILY)
def test_the_family_draws_position_and_velocity_within_the_bounds_as_printed(algorithm):
    problem = get_problem("zdt4")  # bounds that differ from one variable to the next
    X, V, lower, upper = first_flight(algorithm(pop_size=50), problem, seed=7)
    twin = np.random.default_rng(7)
    shares = twin.random((2, 50, problem.n_var))
    expected = lower + (upper - lower) * shares
    np.testing.assert_allclose([X, V], expected, rtol=1e-15)


def test_a_first_step_within_bounds_fills_the_box_and_stays_in_it():
    swarm = AMPMOPSO(pop_size=4000, initial_velocity=FirstStepWithinBounds())
    X, V, lower, upper = first_flight(swarm, MovedParabolas(5.0), seed=1)
    reached = (X + V - lower) / (upper - lower)
    assert reached.min() >= 0.0
    assert reached.max() <= 1.0
    # Uniform in the box whatever the position: mean 1/2, variance 1/12, no correlation with it.
    np.testing.assert_allclose(reached.mean(axis=0), 0.5, atol=4 / np.sqrt(12 * 4000))
    np.testing.assert_allclose(reached.var(axis=0), 1 / 12, rtol=0.1)
    correlation = [np.corrcoef(X[:, i], reached[:, i])[0, 1] for i in range(X.shape[1])]
    np.testing.assert_allclose(correlation, 0.0, atol=4 / np.sqrt(4000))


def test_the_printed_law_depends_on_the_origin_and_the_other_one_does_not():
    """A whole run moves with the box under the second law; under the first it is another run."""
    moved = {}
    for law in (VelocityWithinBounds(), FirstStepWithinBounds()):
        runs = [
            run(AMPMOPSO(pop_size=20, initial_velocity=law), problem, n_gen=2, save_history=True)
            for problem in (MovedParabolas(0.0), MovedParabolas(64.0))
        ]
        moved[type(law)] = [result.history[-1].pop.get("X") for result in runs]
    here, there = moved[FirstStepWithinBounds]
    np.testing.assert_allclose(there - 64.0, here, atol=1e-10)
    # The mean velocity is the middle of the box: all particles of the moved box leave it.
    here, there = moved[VelocityWithinBounds]
    assert np.mean(there == 66.0) > 0.5
    assert np.mean(here == 2.0) < 0.5


def test_the_law_is_a_part_of_the_swarm_and_survives_a_restart():
    printed = run(AMPMOPSO(pop_size=20), n_gen=10)
    named = run(AMPMOPSO(pop_size=20, initial_velocity=VelocityWithinBounds()), n_gen=10)
    other = run(AMPMOPSO(pop_size=20, initial_velocity=FirstStepWithinBounds()), n_gen=10)
    assert digest(printed) == digest(named) != digest(other)


def test_velocities_of_another_shape_are_refused():
    def flat(X, lower, upper, random_state):
        return np.zeros(len(X))

    swarm = AMPMOPSO(pop_size=20, initial_velocity=flat)
    with pytest.raises(InvalidInput, match="initial_velocity"):
        swarm.setup(Parabolas(), termination=("n_gen", 2), seed=1).ask()


def test_a_given_population_flies_with_fresh_velocities():
    given = Population.new(X=np.zeros((20, 3)))
    X, V, lower, upper = first_flight(AMPMOPSO(pop_size=20, sampling=given), Parabolas(), seed=3)
    np.testing.assert_array_equal(X, 0.0)
    expected = np.random.default_rng(3).uniform(lower, upper, (20, 3))
    np.testing.assert_array_equal(V, expected)
