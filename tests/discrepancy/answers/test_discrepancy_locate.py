"""Location of the misfit: closed forms of the statistics, planted misfits, unbiased refits."""

from dataclasses import replace

import numpy as np
import pytest
from planted_features import analysed, known_data, listed, measured, with_sweep
from scipy.stats import chi2

from pymoo_hdte.discrepancy._answers.where.location import groups_within_noise, locate, refit_clean
from pymoo_hdte.discrepancy._answers.where.map import benjamini_hochberg
from pymoo_hdte.discrepancy._evidence.order_lines.observations import (
    cell_chi_square,
    cell_degrees_of_freedom,
)
from pymoo_hdte.discrepancy._selection.candidate import Layout, out_of_tolerance
from pymoo_hdte.discrepancy._selection.fitting import fit
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


def test_cells_that_a_record_does_not_show_do_not_count():
    data, truth = measured(rng=np.random.default_rng(4), stiffness=0.97)
    features = data.features
    shown = np.ones((len(features.records), len(features.orders)), dtype=bool)
    shown[:2, -1] = False
    values = features.values.copy()
    values[features.conditions.output_torque == 40.0, 0] += 20.0 * ARCSEC
    of_line = np.concatenate([features.places(channel)[-1] for channel in range(4)])
    values[np.ix_([0, 1], of_line)] = 0.0
    data = replace(data, features=replace(features, values=values, shown=shown))
    row = Layout(data.base).index("stiffness")
    assert refit_clean(data, fit(data)).values[row] == pytest.approx(truth[row], rel=0.005)


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


UNLISTED = {
    "line of one torque": (1, 5, lambda speed, load: load >= 0.0, 1e-3),
    "line of the error under load": (0, 4, lambda speed, load: load > 15.0, 0.5 * ARCSEC),
    "mean of the torque at one condition": (
        1, -1, lambda speed, load: (speed < 100.0) & (load == 20.0), -3e-3,
    ),
    "line of the output at one condition": (
        2, 0, lambda speed, load: (speed > 100.0) & (load == 20.0), 0.1,
    ),
}  # fmt: skip
"""Channel, line (-1 for the mean), records and size of misfits that no effect explains."""


@pytest.mark.parametrize("case", UNLISTED)
def test_an_unlisted_effect_flags_the_cells_where_it_is_and_no_other(case):
    channel, line, where, size = UNLISTED[case]
    data, _ = measured(rng=np.random.default_rng(11), stiffness=1.03)
    speed = data.features.conditions.input_speed
    records = np.flatnonzero(where(speed, data.features.conditions.output_torque))
    place = channel if line < 0 else data.features.places(channel)[line][0]
    values = data.features.values.copy()
    values[records, place] += size
    found = locate(analysed(replace(data, features=replace(data.features, values=values))))
    wanted = np.zeros(found.flagged.shape, dtype=bool)
    wanted[records, channel, 1 + line] = True
    assert np.argwhere(found.flagged).tolist() == np.argwhere(wanted).tolist()
    assert not found.named
    # What is flagged is not trusted, and the rest is.
    assert not found.within_noise.channels[channel]
    assert found.within_noise.channels.sum() == 3
    assert not found.within_noise.orders[1 + line]
    assert found.within_noise.orders.sum() == len(found.orders) - 1


def located_with_stiffness(factor):
    """Locate what a drive of another stiffness misses, which is freed where out of tolerance."""
    rng = np.random.default_rng(12)
    data, truth = measured(rng=rng, stiffness=factor)
    data = with_sweep(data, (), rng, stiffness=factor)
    freed = out_of_tolerance("stiffness", "stiffness")
    if factor == 1.05:
        return data, truth, locate(analysed(data, "adequate"))
    return data, truth, locate(analysed(data, "parameter", freed))


def test_a_freed_value_flags_the_cells_that_it_moves_and_is_not_trusted_there():
    data, truth, found = located_with_stiffness(1.3)
    believed = truth.copy()
    believed[0] *= 1.1 / 1.3
    moved = (data.predict(truth[None], ()) - data.predict(believed[None], ()))[0]
    truly = cell_chi_square(data, moved) > cell_degrees_of_freedom(data)
    both = np.sum(truly & found.flagged)
    assert 2.0 * both / (truly.sum() + found.flagged.sum()) > 0.95
    loaded = data.features.conditions.output_torque > 0.0
    assert found.flagged[loaded, 0, 0].all()
    assert "wherever it was measured" not in found.trusted
    assert "transmission error" not in found.trusted
    assert "grows with load" in found.sentence
    # With the input locked the torsion is the same.
    assert found.sweep_flagged
    assert "the sweep with the input locked shows it" in found.sentence


def test_a_value_within_its_tolerance_is_trusted():
    _, _, found = located_with_stiffness(1.05)
    assert not found.flagged.any()
    assert not found.sweep_flagged
    assert "wherever it was measured" in found.trusted


def test_a_friction_proportional_to_load_grows_with_it():
    """A fit takes a part of it for a zero of the sensor: then it would vanish at half load."""
    data, _ = measured(rng=np.random.default_rng(13))
    load = data.features.conditions.output_torque
    values = data.features.values.copy()
    values[:, 1] += 1.3e-3 * load
    found = locate(analysed(replace(data, features=replace(data.features, values=values))))
    assert "hardly changes with speed and grows with load" in found.sentence
    assert found.misfit[:, 1, 0].real == pytest.approx(1.3e-3 * load, abs=4e-3)
    assert np.flatnonzero(found.flagged[:, 1, 0]).tolist() == np.flatnonzero(load).tolist()
    assert "in all records without load" in found.trusted


def test_cells_that_are_off_by_less_than_their_noise_are_seen_together():
    data, _ = measured()
    difference = np.zeros(data.features.values.shape)
    assert groups_within_noise(data, difference).everywhere
    places = data.features.places(3).ravel()
    difference[:, places] = 1.5 * np.sqrt(data.covariance[:, places, places])
    assert np.nanmax(cell_chi_square(data, difference)) < 6.0
    found = groups_within_noise(data, difference)
    assert found.channels.tolist() == [True, True, True, False]
    assert not found.everywhere


def test_groups_of_noise_are_within_it():
    data, rng = known_data(), np.random.default_rng(14)
    apart = 0
    for _ in range(100):
        noise = rng.standard_normal(data.features.values.shape)
        found = groups_within_noise(data, np.einsum("rij,rj->ri", data.whiteners, noise))
        apart += not found.everywhere
    # Twenty-one groups, each at four standard deviations: a chance of some 1e-3 each.
    assert apart <= 7
