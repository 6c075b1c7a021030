"""Location of the misfit: closed forms of the statistics, planted misfits, unbiased refits."""

from dataclasses import replace

import numpy as np
import pytest
from planted_features import analysed, known_data, listed, measured
from scipy.stats import chi2

from pymoo_hdte.discrepancy.drive.misfit.location import locate, refit_clean
from pymoo_hdte.discrepancy.drive.misfit.map import benjamini_hochberg
from pymoo_hdte.discrepancy.drive.observations import cell_chi_square, cell_degrees_of_freedom
from pymoo_hdte.discrepancy.engine.candidate import Layout
from pymoo_hdte.discrepancy.engine.fitting import fit
from pymoo_hdte.units import ARCSEC


def test_false_discovery_rule_of_benjamini_and_hochberg():
    # The example of their paper: 15 hypotheses, of which the rule rejects four at 5 %.
    p_values = [0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344]
    p_values += [0.0459, 0.3240, 0.4262, 0.5719, 0.6528, 0.7590, 1.0]
    shuffled = np.random.default_rng(1).permutation([*p_values, np.nan])
    assert set(shuffled[benjamini_hochberg(shuffled, 0.05)]) == set(p_values[:4])


@pytest.mark.parametrize("rank", [1, 2, 5, 10])
def test_a_p_value_is_held_against_its_rank(rank):
    """The k smallest of n are discoveries at a rate q if they are no larger than q k / n."""
    for share, found in ((0.999, rank), (1.001, 0)):
        p_values = np.ones(10)
        p_values[:rank] = share * 0.05 * rank / 10.0
        assert benjamini_hochberg(p_values, 0.05).sum() == found


def test_a_cell_is_weighed_by_its_own_marginal_covariance():
    data = known_data()
    difference = np.zeros_like(data.features.values)
    real, imaginary = data.features.places(0)[4]
    difference[3, [real, imaginary]] = 0.06 * ARCSEC, -0.03 * ARCSEC
    # Whatever misfit the other features have, it does not reach this cell.
    difference[3, 1] = 1.0
    found = cell_chi_square(data, difference)
    triangle = data.whiteners[3]
    block = (triangle @ triangle.T)[np.ix_([real, imaginary], [real, imaginary])]
    pair = difference[3, [real, imaginary]]
    assert found[3, 0, 5] == pytest.approx(pair @ np.linalg.inv(block) @ pair)
    assert np.nanmax(found[[0, 1, 2, 4]]) == 0.0


def test_cells_of_noise_follow_their_chi_square():
    data = known_data()
    rng = np.random.default_rng(2)
    p_values = []
    for _ in range(20):
        noise = rng.standard_normal(data.features.values.shape)
        found = cell_chi_square(data, np.einsum("rij,rj->ri", data.whiteners, noise))
        p_values.append(chi2.sf(found, cell_degrees_of_freedom(data)))
    known = np.array(p_values)
    known = known[np.isfinite(known)]
    assert known.mean() == pytest.approx(0.5, abs=0.02)
    assert np.mean(known < 0.01) == pytest.approx(0.01, abs=0.004)


def test_a_clean_campaign_has_no_flag():
    data, _ = measured(rng=np.random.default_rng(3), stiffness=1.05)
    found = locate(analysed(data, "adequate"))
    assert not found.flagged.any()
    assert not found.named
    assert "may be trusted as it is wherever" in found.trusted


def test_a_local_misfit_does_not_bias_the_refitted_base():
    data, truth = measured(rng=np.random.default_rng(4), stiffness=0.97)
    values = data.features.values.copy()
    loaded = data.features.conditions.output_torque == 40.0
    values[loaded, 0] += 20.0 * ARCSEC
    data = replace(data, features=replace(data.features, values=values))
    base = fit(data)
    row = Layout(data.base).index("stiffness")
    biased = abs(base.values[row] / truth[row] - 1.0)
    clean = refit_clean(data, base).values
    assert biased > 0.02
    assert abs(clean[row] / truth[row] - 1.0) < 0.1 * biased
    left = data.features.values - data.predict(clean[None], ())[0]
    p_value = chi2.sf(cell_chi_square(data, left), cell_degrees_of_freedom(data))
    flagged = np.argwhere(benjamini_hochberg(p_value, 0.01))
    assert flagged.tolist() == [[record, 0, 0] for record in np.flatnonzero(loaded)]
    # What is not left out keeps its weight: it is fitted down to its noise and no further.
    clean = refit_clean(data, base)
    degrees_of_freedom = data.features.values.size - loaded.sum()
    assert clean.chi_square == pytest.approx(
        degrees_of_freedom, abs=4.0 * np.sqrt(2.0 * degrees_of_freedom)
    )


def test_a_named_line_flags_the_cells_that_it_moves():
    data, truth = measured()
    candidate = listed(data, "kinematic_error", [3.0])
    effect, *_ = candidate.build((1.5 * ARCSEC, 0.5 * ARCSEC))
    data, truth = measured((effect,), np.random.default_rng(5), stiffness=1.03)
    found = locate(analysed(data, "named", candidate, candidate.starts[0]))
    moved = (data.predict(truth[None], (effect,)) - data.predict(truth[None], ()))[0]
    truly = cell_chi_square(data, moved) > cell_degrees_of_freedom(data)
    both = np.sum(truly & found.flagged)
    assert 2.0 * both / (truly.sum() + found.flagged.sum()) > 0.95
    assert "order 3" in found.sentence
    assert found.named
    assert len(found.summary()["flagged"]) == found.flagged.sum()
