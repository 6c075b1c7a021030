"""Steps of Newton's method without matrices, for many harmonics of several beats."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from pymoo_hdte.drive import LawAtPort, harmonic_balance, preset
from pymoo_hdte.drive._solve import newton
from pymoo_hdte.drive._solve.free_angle import torus_of
from pymoo_hdte.drive._solve.linear_systems import Iterated, Linearised, factored
from pymoo_hdte.drive._solve.recursion import Recollection
from pymoo_hdte.drive._solve.torus import Torus
from pymoo_hdte.effects.bouc_wen import BoucWen
from pymoo_hdte.effects.friction import CoulombFriction, PeriodicFriction

LOOP = LawAtPort("bouc_wen_hysteresis", "mesh", BoucWen(3.0, 2e-4))
TURNING = tuple(
    LawAtPort("position_dependent_friction", "output", PeriodicFriction(order, 0.1, 1.0 / order))
    for order in (1.0, 2.0, 3.0)
)
FRICTION = (LawAtPort("coulomb_friction", "output", CoulombFriction(3.0)), *TURNING)


def linearised(torus, rng, remembers):
    n, size = 2, torus.size
    slope = 1.0 + 0.3 * rng.standard_normal((n, size))
    viscous = 0.2j * torus.orders * np.ones((n, 1))
    if not remembers:
        return Linearised(torus, slope, viscous, None)
    kept = rng.uniform(0.5, 0.9, (3, n, 2 * size))
    gained = 0.1 * rng.standard_normal(kept.shape)
    places = np.array([rng.permutation(size) for _ in range(n)])
    return Linearised(torus, slope, viscous, Recollection(kept, gained, places))


def drives(n, *effects):
    model = preset("calibrated")
    model = replace(model, effects=(*model.effects, *effects))
    return model.coefficients(np.tile(model.nominal, (n, 1)))


def with_another_beat(found):
    """Return drives whose error has one more line, which repeats with nothing else."""
    orders = np.append(found.error_orders, 1.35)
    phasors = np.pad(found.error_phasors, ((0, 0), (0, 1)), constant_values=2e-5)
    return replace(found, error_orders=orders, error_phasors=phasors)


@pytest.mark.parametrize("remembers", [False, True])
def test_what_is_iterated_solves_the_equations_of_the_matrix(remembers, rng):
    torus = Torus((1.0, 0.02, 0.35), (3, 2, 1))
    system = linearised(torus, rng, remembers)
    cores = system.core().matrix()
    right = rng.standard_normal(2 * len(torus.orders))
    # The mean has no imaginary part.
    right[len(torus.orders)] = 0.0
    for row, matrix in enumerate(system.matrix()):
        one = Iterated(system.row(row), factored(cores[row]))
        assert one._times(right) == pytest.approx(matrix @ right, abs=1e-12 * np.abs(right).max())
        found = one.solve(right)
        assert np.linalg.norm(matrix @ found - right) < 2e-5 * np.linalg.norm(right)


def test_what_stays_within_the_core_is_solved_at_once(monkeypatch):
    """A stiffness that varies with the input angle alone leads to no other beat."""
    torus = Torus((1.0, 0.02, 0.35), (3, 2, 1))
    slope = 1.0 + 0.95 * np.sign(np.cos(torus.phase(1.0) + 0.1))[None]
    system = Linearised(torus, slope, 0.2j * torus.orders[None], None)
    right = np.zeros(2 * len(torus.orders))
    right[torus.of_core] = np.cos(torus.of_core)
    times, products = Iterated._times, []
    monkeypatch.setattr(
        Iterated, "_times", lambda one, values: products.append(1) or times(one, values)
    )
    found = Iterated(system, factored(system.core().matrix()[0])).solve(right)
    assert system.matrix()[0] @ found == pytest.approx(right, abs=1e-6)
    assert len(products) < 5


def test_where_an_iteration_does_not_end_the_whole_matrix_serves(rng):
    """A mesh that pushes at some places and pulls at others, without order."""
    system = linearised(Torus((1.0, 0.02, 0.35), (3, 2, 1)), rng, remembers=True)
    system = system._replace(slope=20.0 * rng.standard_normal(system.slope.shape)).row(0)
    right = rng.standard_normal(2 * len(system.torus.orders))
    right[len(system.torus.orders)] = 0.0
    found = Iterated(system, factored(system.core().matrix()[0])).solve(right)
    assert system.matrix()[0] @ found == pytest.approx(right, abs=1e-9)


def test_a_system_that_is_asked_often_is_factored(rng):
    """As when derivatives by all values of a fit are found with it."""
    system = linearised(Torus((1.0, 0.02, 0.35), (3, 2, 1)), rng, remembers=True).row(0)
    one = Iterated(system, factored(system.core().matrix()[0]))
    asked = rng.standard_normal((len(system.torus.orders), 2 * len(system.torus.orders)))
    asked[:, len(system.torus.orders)] = 0.0
    for right in asked:
        found = one.solve(right)
    assert system.matrix()[0] @ found == pytest.approx(right, abs=1e-9)
    products = one._products
    one.solve(asked[0])
    assert one._products == products


def test_what_is_not_finite_has_no_solution(rng):
    system = linearised(Torus((1.0, 0.02, 0.35), (2, 1, 1)), rng, remembers=False).row(0)
    one = Iterated(system, factored(system.core().matrix()[0]))
    for value in (np.nan, 1e200):
        with np.errstate(over="ignore"):
            found = one.solve(np.full(2 * len(system.torus.orders), value))
        assert np.isnan(found).all()


def test_a_core_is_what_a_matrix_says_of_its_harmonics(rng):
    system = linearised(Torus((1.0, 0.02, 0.35), (3, 2, 1)), rng, remembers=True)
    torus, core = system.torus, system.core()
    np.testing.assert_array_equal(core.torus.orders, torus.orders[torus.of_core])
    assert len(torus.of_core) == 3 + (2 + 1) * 7 + 1
    both = np.concatenate([torus.of_core, torus.of_core + len(torus.orders)])
    expected = system.matrix()[:, both[:, None], both]
    np.testing.assert_allclose(core.matrix(), expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("effects", [FRICTION, (LOOP, *FRICTION)])
def test_a_steady_state_does_not_depend_on_how_its_steps_are_found(effects, monkeypatch):
    coefficients = drives(3, *effects)
    load = np.array([20.0, 40.0, 60.0])
    expected = harmonic_balance(coefficients, load_torque=load)
    monkeypatch.setattr(newton, "_OF_A_MATRIX", 0)
    solved = []
    solve = Iterated.solve
    monkeypatch.setattr(Iterated, "solve", lambda *one: solved.append(1) or solve(*one))
    found = harmonic_balance(coefficients, load_torque=load)
    assert solved
    assert found.converged.all()
    assert expected.converged.all()
    difference = np.abs(found.torsion - expected.torsion).max()
    assert difference < 1e-10 * np.abs(expected.torsion).max()


@pytest.mark.nightly
def test_three_beats_at_once_leave_most_of_the_memory_free():
    """Matrices of 24 rows with 689 harmonics and what they are made of took 1.2 GB."""
    coefficients = with_another_beat(drives(24, LOOP, *FRICTION))
    torus = torus_of(coefficients)
    assert len(torus.orders) == 689
    tracemalloc.start()
    harmonic_balance(coefficients, steps=2)
    largest = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert largest < 3e8
