"""Torque balances against the harmonic balance, and candidate laws against closed forms."""

import numpy as np
import pytest
from planted_balances import EFFECTS, library_of, swept
from planted_features import measured

from experiments.studies.blind.candidate_terms import BREAKAWAYS
from experiments.studies.blind.torque_balances import balances, regression
from pymoo_hdte.discrepancy._selection.candidate import Layout


def test_the_balances_of_a_clean_drive_are_nil():
    data, truth = measured()
    found = regression(data, truth, library_of(data))
    assert np.max(np.abs(found.target)) < 0.3
    assert np.sqrt(np.mean(found.target**2)) < 0.05


def test_balances_are_affine_in_the_features():
    data, truth = measured()
    one, other = np.random.default_rng(1).standard_normal((2, *data.features.values.shape))
    left = balances(data, truth, 0.3 * one + 0.7 * other)
    right = 0.3 * balances(data, truth, one) + 0.7 * balances(data, truth, other)
    np.testing.assert_allclose(left, right, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_leaves_what_its_terms_say(name):
    """The harmonic balance on one side, the equations of motion on the other."""
    data, truth = measured((EFFECTS[name],))
    library = library_of(data)
    found = regression(data, truth, library)
    own = found.library[:, [term.name == name for term in library]]
    scale = np.linalg.norm(own, axis=0)
    rest = found.target - own / scale @ np.linalg.lstsq(own / scale, found.target)[0]
    assert np.linalg.norm(rest) ** 2 < 0.005 * (found.target @ found.target)


@pytest.mark.parametrize(
    ("name", "port", "coefficient"),
    [("hardening_stiffness", "mesh", 1e9), ("nonlinear_drag", "input", 5e-7)],
)
def test_the_coefficient_of_a_term_is_that_of_the_law(name, port, coefficient):
    data, truth = measured((EFFECTS[name],))
    library = library_of(data)
    found = regression(data, truth, library)
    column = found.library[:, [(t.name, t.port) for t in library].index((name, port))]
    assert column @ found.target / (column @ column) == pytest.approx(coefficient, rel=0.01)


def test_base_columns_are_what_a_changed_parameter_leaves():
    data, truth = measured()
    layout = Layout(data.base)
    shifted = truth.copy()
    place = layout.index("stiffness")
    shifted[place] *= 1.01
    found = regression(data, shifted, library_of(data))
    # The base was 1 % too stiff: what is left is that of so many units of its scale.
    units = (truth[place] - shifted[place]) / data.base[place].scale
    left = found.target - regression(data, truth, library_of(data)).target
    rest = left - units * found.base[:, place]
    assert np.linalg.norm(rest) < 0.005 * np.linalg.norm(left)


def sweep_rows(data, values):
    library = library_of(data)
    found = regression(data, values, library)
    rows = found.record == len(data.features.records)
    return library, found.target[rows], found.library[rows]


def test_a_cubic_stiffness_at_rest_leaves_its_term():
    data, truth = measured()
    stiffness = truth[0]

    def torsion(torque):
        fine = np.linspace(-3e-3, 3e-3, 20001)
        return np.interp(torque, stiffness * fine + 1e9 * fine**3, fine)

    library, target, columns = sweep_rows(swept(data, torsion), truth)
    column = columns[:, [term.name for term in library].index("hardening_stiffness")]
    assert column @ target / (column @ column) == pytest.approx(1e9, rel=1e-3)
    # The rest: where the torsion is zero is itself read from the sweep.
    assert np.linalg.norm(target - 1e9 * column) < 3e-3 * np.linalg.norm(target)


def test_dry_friction_at_rest_holds_the_output_until_it_breaks_away():
    data, truth = measured()
    level = BREAKAWAYS[1]

    def torsion(torque):
        """Play by hand: the shaft follows the load, behind by the friction."""
        carried, found = 0.0, []
        for load in torque:
            carried = min(max(carried, load - level), load + level)
            found.append(carried / truth[0])
        return np.array(found)

    library, target, columns = sweep_rows(swept(data, torsion), truth)
    place = [i for i, t in enumerate(library) if (t.name, t.port) == ("coulomb_friction", "output")]
    np.testing.assert_allclose(level * columns[:, place[1]], target, atol=1e-6)
