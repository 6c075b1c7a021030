"""Quality of fronts: closed forms, and fronts that indicators could overrate."""

import numpy as np
import pytest

from pymoo_hdte._comparing.quality import TrueFront
from pymoo_hdte.checks import InvalidInput

LINE = np.column_stack([np.linspace(0, 1, 1001), np.linspace(1, 0, 1001)])
SCALE, SHIFT = np.array([4.0, 0.1]), np.array([84.0, 15.4])
TWO_PIECES = LINE[(LINE[:, 0] < 0.4) | (LINE[:, 0] > 0.6)]


def test_true_front_is_at_distance_zero_from_itself_and_loses_nothing():
    quality = TrueFront(TWO_PIECES).quality(TWO_PIECES)
    assert quality.igd == 0.0
    assert quality.lost_pieces == 0


def test_igd_of_one_corner_is_the_mean_distance_to_it():
    """Along the diagonal of the unit square the mean distance to an end is sqrt(2) / 2."""
    assert TrueFront(LINE).quality(LINE[:1]).igd == pytest.approx(np.sqrt(0.5), rel=1e-12)


def test_hypervolume_of_the_middle_of_the_line():
    assert TrueFront(LINE).quality([[0.5, 0.5]]).hypervolume == pytest.approx(0.36, rel=1e-12)


def test_spacing_is_the_standard_deviation_of_neighbour_distances():
    """Nearest taxicab distances are 0.2, 0.2 and 1.8, about their mean 2.2 / 3."""
    front = [[0.0, 1.0], [0.1, 0.9], [1.0, 0.0]]
    expected = np.std([0.2, 0.2, 1.8])
    assert TrueFront(LINE).quality(front).spacing == pytest.approx(expected, rel=1e-12)


def test_units_and_offset_of_the_objectives_do_not_matter():
    rng = np.random.default_rng(7)
    front = LINE[rng.choice(1001, 30, replace=False)] + rng.uniform(0, 0.05, (30, 2))
    plain = TrueFront(TWO_PIECES).quality(front)
    scaled = TrueFront(TWO_PIECES * SCALE + SHIFT).quality(front * SCALE + SHIFT)
    np.testing.assert_allclose(scaled, plain, rtol=1e-9)


def test_a_front_is_measured_by_the_true_extent_and_not_by_its_own():
    """A tenth of the front, evenly sampled, must not count as the whole."""
    quality = TrueFront(LINE).quality(LINE[:101])
    assert quality.igd == pytest.approx(np.sqrt(2) * 0.9 * 0.9 / 2, rel=1e-2)


def test_pieces_and_the_one_that_is_lost():
    truth = TrueFront(TWO_PIECES[::-1])
    assert [len(piece) for piece in truth.pieces] == [400, 400]
    assert truth.quality(TWO_PIECES[:400]).lost_pieces == 1
    near_both = [TWO_PIECES[0], TWO_PIECES[-1] + 0.03]
    assert truth.quality(near_both).lost_pieces == 0
    too_far = [TWO_PIECES[0], TWO_PIECES[-1] + 0.04]
    assert truth.quality(too_far).lost_pieces == 1


def test_an_empty_front_is_the_worst_and_not_the_best():
    quality = TrueFront(TWO_PIECES).quality(np.empty((0, 2)))
    assert quality.igd == np.inf
    assert np.isnan(quality.spacing)
    assert (quality.hypervolume, quality.lost_pieces) == (0.0, 2)


def test_copies_of_one_point_have_no_spacing():
    assert np.isnan(TrueFront(LINE).quality([[0.5, 0.5]] * 50).spacing)


def test_duplicates_change_nothing():
    front = LINE[[0, 100, 500, 1000]]
    assert TrueFront(LINE).quality(np.vstack([front, front])) == TrueFront(LINE).quality(front)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused(bad):
    with pytest.raises(InvalidInput, match=r"F\[0, 1\]"):
        TrueFront(LINE).quality([[0.5, bad]])


def test_a_true_front_of_one_point_is_refused():
    with pytest.raises(InvalidInput, match="extent of the true front"):
        TrueFront([[1.0, 2.0]])
