"""Designs without a steady state among others: left out, or continued from their neighbours."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from pymoo_hdte.drive import (
    DampingReference,
    LoadInertia,
    MeshStiffnessVariation,
    UnstableDrive,
    preset,
)
from pymoo_hdte.drive._effects import LawAtPort
from pymoo_hdte.drive._solve.free_angle import continued_from_neighbours, harmonic_balance
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.stiffness import SoftWindup

MODEL = preset("calibrated")


def around(model, n, spread=0.3, seed=1):
    return model.nominal * np.random.default_rng(seed).uniform(1 - spread, 1 + spread, (n, 5))


def test_where_all_are_found_they_are_the_plain_ones():
    designs = around(MODEL, 20)
    assert np.array_equal(MODEL.dte_where_found(designs), MODEL.dte_arcsec(designs))
    assert MODEL.dte_where_found(designs[:0]).shape == (0,)


def test_a_motion_that_grows_leaves_the_others_as_they_are():
    effects = (LoadInertia(0.395), DampingReference(0.01), MeshStiffnessVariation(0.3, 0.0))
    shaky = replace(MODEL, effects=effects).at(280.0, 40.0)
    designs = around(shaky, 30)
    found = shaky.dte_where_found(designs)
    for row, value in enumerate(found):
        if np.isnan(value):
            with pytest.raises(UnstableDrive):
                shaky.dte_arcsec(designs[[row]])
        else:
            assert value == pytest.approx(shaky.dte_arcsec(designs[[row]])[0], rel=1e-9)
    assert 0 < np.isnan(found).sum() < 30


def test_designs_that_share_their_stiffness_are_judged_one_by_one():
    effects = (LoadInertia(0.395), DampingReference(0.01), MeshStiffnessVariation(0.3, 0.0))
    shaky = replace(MODEL, effects=effects).at(280.0, 40.0)
    designs = np.tile(shaky.nominal, (15, 1))
    designs[:, 1] *= 1.2
    # Inertia moves the resonance, and with it the growth.
    designs[:, 2] *= np.linspace(0.7, 1.3, 15)
    found = np.isnan(shaky.dte_where_found(designs))
    assert np.array_equal(found, [np.isnan(shaky.dte_where_found(one[None]))[0] for one in designs])
    assert 0 < found.sum() < 15


@pytest.fixture
def soft():
    """A drive that softens near zero torque."""
    windup = LawAtPort("soft_windup", "mesh", SoftWindup(0.3, 5e-4, 4.0))
    return replace(MODEL, effects=(LoadInertia(0.395), DampingReference(1.1), windup))


def test_lost_designs_start_from_their_neighbours(soft):
    coefficients = soft.coefficients(around(soft, 200))
    # So few steps that not all get there from rest.
    alone = harmonic_balance(coefficients, steps=6)
    lost = np.flatnonzero(~alone.converged)
    assert 0 < len(lost) < 200
    found = continued_from_neighbours(coefficients, alone)
    assert found.converged[lost].any()
    rest = harmonic_balance(coefficients)
    assert rest.converged.all()
    regained = lost[found.converged[lost]]
    assert found.torsion[regained] == pytest.approx(rest.torsion[regained], rel=1e-6, abs=1e-9)
    kept = np.flatnonzero(alone.converged)
    assert np.array_equal(found.torsion[kept], alone.torsion[kept])


@pytest.mark.parametrize("patience", [1, 2])
def test_a_lost_design_is_lost_in_any_company(soft, monkeypatch, patience):
    """Whether a design has a steady state does not depend on what is solved beside it."""
    monkeypatch.setattr("pymoo_hdte.drive._solve.free_angle._PATIENCE", patience)
    coefficients = soft.at(280.0, 2.0).coefficients(around(soft, 40))
    together = harmonic_balance(coefficients).converged
    alone = [harmonic_balance(coefficients.rows([row])).converged[0] for row in range(40)]
    assert together.tolist() == alone
    assert 0 < together.sum() < 40


@pytest.mark.parametrize("share", [1.0, 0.1, 0.01])
@pytest.mark.parametrize("level", [7.0, 35.0])
def test_friction_winds_up_a_precise_drive_without_load(share, level):
    """Steps were as long as the static error at most, and fifteen of them did not lead there."""
    plain = MODEL.coefficients(MODEL.nominal[np.newaxis])
    small = replace(plain, error_phasors=share * plain.error_phasors)
    rubbing = replace(small, laws=(("output", CoulombFriction(level)),))
    found = harmonic_balance(rubbing, load_torque=np.zeros(1))
    assert found.converged.all()
    held = rubbing.stiffness * found.torsion[:, 0].real
    assert held == pytest.approx(level, rel=1e-2)


def test_the_dte_of_a_drive_uses_them(soft, monkeypatch):
    designs = around(soft, 200)
    few = partial(harmonic_balance, steps=6)
    alone = few(soft.coefficients(designs)).converged
    monkeypatch.setattr("pymoo_hdte.drive._solve.hill.harmonic_balance", few)
    found = np.isfinite(soft.dte_where_found(designs))
    assert found[alone].all()
    assert found[~alone].any()


def test_without_any_neighbour_nothing_changes(soft):
    coefficients = soft.coefficients(around(soft, 3))
    alone = harmonic_balance(coefficients, steps=1)
    assert not alone.converged.any()
    assert continued_from_neighbours(coefficients, alone) is alone


def test_what_is_found_beside_designs_that_stay_lost_is_their_own_steady_state(soft):
    """Near zero torque some are not found from their neighbours either."""
    fast = soft.at(280.0, 2.0)
    designs = around(soft, 40)
    coefficients = fast.coefficients(designs)
    from_rest = harmonic_balance(coefficients)
    reached = continued_from_neighbours(coefficients, from_rest).converged
    alone = from_rest.converged
    assert 0 < alone.sum() < reached.sum() < len(designs)
    dte = fast.dte_where_found(designs)
    assert np.array_equal(np.isfinite(dte), reached)
    assert dte[alone] == pytest.approx(fast.dte_arcsec(designs[alone]), rel=1e-6)
