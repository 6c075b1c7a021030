"""Parts of the compact swarm: neighbours, archive, size."""

import numpy as np
import pytest
from moocore import is_nondominated
from pymoo.core.population import Population
from pymoo.core.termination import NoTermination
from pymoo.termination import get_termination
from pymoo.termination.default import DefaultMultiObjectiveTermination
from scipy.stats import kstest, ortho_group

from pymoo_hdte.algorithms.archive import FrontArchive
from pymoo_hdte.algorithms.base import particles_at
from pymoo_hdte.algorithms.compact import size_for
from pymoo_hdte.algorithms.horizon import evaluation_limit
from pymoo_hdte.algorithms.moves import NeighbourDifference, nearest_in_objectives
from pymoo_hdte.algorithms.points import Points
from pymoo_hdte.algorithms.quadratic import ModelStep, Quadratic, Span, fitted, lowest_within
from pymoo_hdte.algorithms.spread import most_spread

D = 5


def points(F, violation):
    F = np.asarray(F, dtype=float)
    return Points(np.zeros((len(F), 1)), F, np.asarray(violation, dtype=float))


# --- move among neighbours ------------------------------------------------------------------------


def test_the_move_among_neighbours_turns_with_the_coordinates(rng):
    X, around = rng.random((40, D)), rng.random((40, 12, D))
    rotation = ortho_group.rvs(D, random_state=np.random.default_rng(3))
    move = NeighbourDifference()
    plain = move(X, X, around, np.random.default_rng(7)) @ rotation
    turned = move(X @ rotation, X @ rotation, around @ rotation, np.random.default_rng(7))
    np.testing.assert_allclose(plain, turned, atol=1e-12)


def test_the_move_among_neighbours_stays_in_the_flat_they_span(rng):
    """Particles and neighbours on a plane through space: so do the steps."""
    plane = rng.standard_normal((2, D))
    X, around = rng.random((50, 2)) @ plane, rng.random((50, 12, 2)) @ plane
    steps = NeighbourDifference()(X, X, around, rng)
    assert np.linalg.matrix_rank(np.vstack([plane, steps])) == 2
    # Neighbours in one place: only the pull is left, up to a whole step.
    there = np.ones((2000, 12, D))
    share = NeighbourDifference()(np.zeros((2000, D)), X, there, rng)
    np.testing.assert_array_equal(share, np.broadcast_to(share[:, :1], share.shape))
    assert kstest(share[:, 0], "uniform").pvalue > 1e-3


@pytest.mark.parametrize("n_obj", [2, 3, 5])
def test_neighbours_are_the_nearest_in_scaled_objectives(rng, n_obj):
    F = rng.random((30, n_obj)) * 10.0 ** np.arange(n_obj)
    near = nearest_in_objectives(F, 12, np.arange(len(F)))
    scaled = (F - F.min(axis=0)) / np.ptp(F, axis=0)
    distance = np.linalg.norm(scaled[:, np.newaxis] - scaled, axis=2)
    expected = np.argsort(distance, axis=1)[:, 1:13]
    np.testing.assert_array_equal(np.sort(near), np.sort(expected))
    assert nearest_in_objectives(F[:4], 12, np.arange(4)).shape == (4, 3)


@pytest.mark.parametrize("lost", [np.nan, np.inf])
def test_objectives_that_are_not_finite_have_neighbours_like_themselves(rng, lost):
    F = rng.random((20, 2))
    F[:5, 1] = lost
    near = nearest_in_objectives(F, 4, np.arange(len(F)))
    assert np.all(np.sort(near[:5]) < 5)
    assert np.all(near[5:] >= 5)
    assert nearest_in_objectives(np.full((6, 2), lost), 3, np.arange(6)).shape == (6, 3)


# --- archive --------------------------------------------------------------------------------------


def evaluated(F):
    population = particles_at(np.zeros((len(F), 1)))
    population.set("F", F)
    return population


def offer(archive, F):
    population = evaluated(F)
    archive.update(population, constrained=False)


def test_the_archive_has_the_front_of_all_it_was_given(rng):
    archive, everything = FrontArchive(1000, most_spread), []
    for _ in range(12):
        F = rng.random((30, 2))
        F[3] = F[4]
        everything.append(F)
        offer(archive, F)
    everything = np.concatenate(everything)
    np.testing.assert_array_equal(archive.members.get("F"), everything[is_nondominated(everything)])


def test_the_archive_is_bounded_and_thinned_out_evenly():
    archive = FrontArchive(40, most_spread, thinned_to=30)
    line = np.random.default_rng(2).random(2000)
    for some in line.reshape(100, 20):
        offer(archive, np.column_stack([some, 1.0 - some]))
        assert len(archive) <= 40
    kept = np.sort(archive.members.get("F")[:, 0])
    assert kept[0] == line.min()
    assert kept[-1] == line.max()
    assert np.diff(kept).max() < 0.1


@pytest.mark.parametrize(("offered", "kept"), [(20, 20), (21, 21), (22, 11), (40, 11)])
def test_the_archive_is_thinned_out_once_it_is_more_than_full(offered, kept):
    """Then to what it leaves, the ends of the front among it, and no pair nearer than before."""
    archive = FrontArchive(21, most_spread, thinned_to=11)
    line = np.linspace(0.0, 1.0, offered)
    offer(archive, np.column_stack([line, 1.0 - line]))
    members = archive.members.get("F")
    assert len(members) == kept
    assert (members[:, 0].min(), members[:, 0].max()) == (0.0, 1.0)
    gaps = np.diff(np.sort(members[:, 0]))
    # Halved or more, a line of even steps has none between neighbours of less than two of them.
    assert gaps.min() >= (1.0 if kept == offered else 1.999) / (offered - 1) * (1.0 - 1e-9)


def test_the_archive_forgets_what_is_no_longer_feasible():
    """As constraint handling that grows stricter needs."""
    archive = FrontArchive(10, most_spread)
    population = evaluated(np.array([[0.0, 1.0], [1.0, 0.0]]))
    population.set("G", np.array([[0.1], [-0.1]]))
    for particle in population:
        particle.config["cv_eps"] = 0.5
    archive.update(population, constrained=True)
    assert len(archive) == 2
    for particle in population:
        particle.config["cv_eps"] = 0.0
    archive.update(Population.empty(), constrained=True)
    np.testing.assert_array_equal(archive.members.get("F"), [[1.0, 0.0]])


# --- size -----------------------------------------------------------------------------------------


def test_the_swarm_grows_with_the_square_root_of_what_it_spent():
    assert [size_for(n) for n in (10, 500, 2_000, 10_000, 25_000)] == [10, 11, 22, 50, 79]
    assert size_for(1e6) == size_for(np.inf) == 100


@pytest.mark.parametrize(
    ("termination", "limit"),
    [
        (get_termination("n_eval", 700), 700),
        (get_termination("n_gen", 50), np.inf),
        (DefaultMultiObjectiveTermination(n_max_evals=900), 900),
        (NoTermination(), np.inf),
    ],
)
def test_the_budget_is_what_the_termination_tells_in_evaluations(termination, limit):
    assert evaluation_limit(termination) == limit


# --- quadratic models -----------------------------------------------------------------------------


def _quadratics(rng):
    """Two ill-conditioned quadratics, turned and shifted: objectives of X, lowest places."""
    turned = ortho_group.rvs(D, random_state=rng)
    hessians = [turned @ np.diag(10.0 ** np.linspace(0, 4, D)) @ turned.T, np.diag(np.arange(1, 6))]
    lowest = rng.standard_normal((2, D))

    def objectives(X):
        away = X[:, np.newaxis] - lowest
        return np.stack(
            [0.5 * np.einsum("ni,ij,nj->n", away[:, k], hessians[k], away[:, k]) for k in (0, 1)], 1
        )

    return objectives, np.array(hessians), lowest


def test_quadratics_are_found_again(rng):
    objectives, hessians, lowest = _quadratics(rng)
    Z = rng.standard_normal((60, D))
    model = fitted(Z, objectives(Z))
    expected = -np.einsum("kij,kj->ki", hessians, lowest)
    scale = np.abs(hessians).max(axis=(1, 2))
    assert np.all(np.abs(model.hessian - hessians).max(axis=(1, 2)) < 0.01 * scale)
    assert np.all(np.abs(model.gradient - expected).max(axis=1) < 0.01 * scale)


def test_fewer_points_than_coefficients_give_the_slope(rng):
    Z, slope = rng.standard_normal((D + 3, D)), rng.standard_normal((D, 2))
    model = fitted(Z, Z @ slope)
    assert np.linalg.norm(model.gradient - slope.T) < 0.1 * np.linalg.norm(slope)
    assert np.abs(model.hessian).max() < 0.2 * np.abs(slope).max()


@pytest.mark.parametrize("signs", [(1, 1, 1, 1, 1), (1, 1, 1, -1, 1), (-1, -1, -1, -1, -1)])
def test_no_place_within_the_radius_is_lower(rng, signs):
    turned = ortho_group.rvs(D, random_state=rng)
    hessian = turned @ np.diag(np.array(signs) * np.array([1.0, 3.0, 0.1, 10.0, 2.0])) @ turned.T
    model = Quadratic(rng.standard_normal((1, D)), hessian[np.newaxis])
    radii = np.array([0.1, 1.0, 30.0])
    places = lowest_within(model, np.zeros(3, dtype=int), radii)

    def values(Z):
        return Z @ model.gradient[0] + 0.5 * np.einsum("ni,ij,nj->n", Z, hessian, Z)

    assert np.all(np.linalg.norm(places, axis=1) <= radii * (1 + 1e-6))
    directions = rng.standard_normal((2000, D))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for place, radius in zip(places, radii, strict=True):
        inside = directions * radius * rng.random((2000, 1)) ** 0.2
        found = values(place[np.newaxis])[0]
        assert found <= values(inside).min() + 1e-3 * abs(found)


def test_the_lowest_place_in_many_variables_lies_in_the_span_of_the_points(rng):
    """Found in the coordinates of the span, it is as low as the one of the model as a whole."""
    Z = 0.2 * rng.standard_normal((30, 200))
    Z[0] = 0.0
    F = np.column_stack([Z[:, 0] + 0.3 * Z[:, 1] ** 2, (Z[:, :5] ** 2).sum(axis=1) - 0.2 * Z[:, 2]])
    weights = np.array([[0.5, 0.5], [0.0, 1.0], [1.0, 0.0]])
    which, radii = np.array([0, 1, 2, 0]), np.array([0.1, 0.5, 1.0, 1.0])
    whole = fitted(Z, F).weighted(weights)
    span = Span.of(Z)
    places = span.lowest(fitted(span.places, F).weighted(weights), which, radii)

    def values(at):
        slopes = np.einsum("ki,ki->k", whole.gradient[which], at)
        return slopes + 0.5 * np.einsum("ki,kij,kj->k", at, whole.hessian[which], at)

    np.testing.assert_allclose(
        values(places), values(lowest_within(whole, which, radii)), rtol=1e-3
    )
    assert np.all(np.linalg.norm(places, axis=1) <= radii * (1.0 + 1e-6))
    beside = places - np.linalg.lstsq(Z.T, places.T, rcond=None)[0].T @ Z
    assert np.abs(beside).max() < 1e-9


def test_model_steps_lead_to_the_front_of_quadratics(rng):
    """After one generation's step, positions satisfy the condition of a weighted optimum."""
    objectives, _, lowest = _quadratics(rng)
    X = lowest.mean(axis=0) + 4.0 * rng.standard_normal((35, D))
    move = ModelStep()
    assert not move(X, X, X, rng).any()
    F = objectives(X)
    move.learn(Points(X, F, np.zeros(35)))
    steps = move(X, X[[F.sum(axis=1).argmin()]].repeat(35, axis=0), X, rng)
    reached = objectives(X + steps)
    assert np.all(reached.min(axis=0) < 0.1 * F.min(axis=0))


def test_model_steps_survive_what_cannot_be_fitted(rng):
    X = np.ones((12, D))
    move = ModelStep()
    move.learn(Points(X, np.ones((12, 2)), np.zeros(12)))
    assert not move(X, X, X, rng).any()
    move.learn(Points(X, np.full((12, 2), np.nan), np.full(12, np.inf)))
    assert not move(X, X, X, rng).any()
    move.forget()
    assert not move(X, X, X, rng).any()


def test_model_steps_remember_no_more_than_they_say(rng):
    move = ModelStep()
    X = rng.random((6000, D))
    for told in range(300, 6001, 300):
        move.learn(Points(X[told - 300 : told], X[told - 300 : told, :2], np.zeros(300)))
        known = np.concatenate([block.X for block in move._known()])
        np.testing.assert_array_equal(known, X[max(0, told - move.MEMORY) : told])
        assert sum(map(len, move._told)) < move.MEMORY + 550


def test_flat_models_give_no_step_without_a_warning():
    """A plateau of one objective is as usual as an objective taken alone."""
    steep = np.eye(1, D)
    for slope in (np.zeros((1, D)), 1e-200 * steep, steep):
        places = lowest_within(Quadratic(slope, np.zeros((1, D, D))), np.zeros(2, int), np.ones(2))
        assert np.all(np.linalg.norm(places, axis=1) <= 1.0)
    assert places[:, 0] == pytest.approx(-1.0, rel=0.02)


def test_model_steps_do_not_depend_on_the_units_of_variables(rng):
    objectives, _, lowest = _quadratics(rng)
    X = lowest.mean(axis=0) + 4.0 * rng.standard_normal((35, D))
    units = 2.0 ** np.array([0, -30, 20, 3, -7])
    points = objectives(X), np.zeros(35)
    steps = []
    for scale in (np.ones(D), units):
        move = ModelStep()
        move.forget(scale)
        move.learn(Points(X * scale, *points))
        here = X * scale
        steps.append(move(here, here, here, np.random.default_rng(1)) / scale)
    np.testing.assert_allclose(steps[1], steps[0], rtol=1e-9)
    fixed = ModelStep()
    fixed.forget(np.array([1.0, 1.0, 0.0, 1.0, 1.0]))
    X[:, 2] = 0.5
    fixed.learn(Points(X, *points))
    steps = fixed(X, X, X, rng)
    assert steps.any()
    assert not steps[:, 2].any()


def _step_after(told, here, seed=3):
    """Steps of a move that was told points, batch by batch."""
    move = ModelStep()
    for X, F in told:
        for rows in np.array_split(np.arange(len(X)), max(1, len(X) // 50)):
            move.learn(Points(X[rows], F[rows], np.zeros(len(rows))))
    return move(here, here, here, np.random.default_rng(seed))


@pytest.mark.parametrize("before", [300, 900, 1100, 1900])
def test_models_of_a_problem_that_changed_are_those_of_its_latest_thousand_points(rng, before):
    """As the class of the swarm states for callbacks."""
    (old, *_), (new, _, lowest) = _quadratics(rng), _quadratics(rng)
    X = lowest.mean(axis=0) + rng.standard_normal((before + 1000, D))
    here = X[-10:]
    latest = X[before:], new(X[before:])
    steps = _step_after([(X[:before], old(X[:before])), latest], here)
    assert steps.any()
    np.testing.assert_allclose(steps, _step_after([latest], here), rtol=1e-6, atol=1e-9)


def test_models_are_fitted_to_the_points_nearest_to_the_leader(rng):
    """What is far away is of another shape, and does not enter."""
    objectives, _, lowest = _quadratics(rng)
    near = lowest.mean(axis=0) + rng.standard_normal((3 * D + 20, D))
    far = near + 1e3
    here = near[:10]
    told = [(far, rng.random((len(far), 2))), (near, objectives(near))]
    expected = _step_after(told[1:], here)
    assert expected.any()
    np.testing.assert_allclose(_step_after(told, here), expected, rtol=1e-6, atol=1e-9)
