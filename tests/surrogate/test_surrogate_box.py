"""The box: its map to the cube, and its refusal of anything outside."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.surrogate import Box, ExtrapolationError

BOX = Box(("K", "J_in"), (6e3, 3e-5), (1e4, 8e-5))


@given(st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=5))
def test_the_two_maps_are_inverse(cube):
    assert BOX.to_cube(BOX.from_cube(np.array(cube))) == pytest.approx(np.array(cube), abs=1e-14)


def test_corners_map_to_corners_whatever_the_scale():
    corners = BOX.to_cube([BOX.lower, BOX.upper])
    assert corners == pytest.approx(np.array([[-1, -1], [1, 1]]), abs=1e-15)
    assert np.abs(corners).max() <= 1.0


def test_a_rounding_outside_is_let_in_and_clipped():
    edge = BOX.upper + 1e-13 * BOX.half_width
    assert np.array_equal(BOX.to_cube([edge]), [[1.0, 1.0]])


@pytest.mark.parametrize("value", [1e4 * (1 + 1e-9), 6e3 * (1 - 1e-9), np.nan, np.inf, -np.inf])
def test_outside_is_refused_by_name_value_and_interval(value):
    with pytest.raises(ExtrapolationError) as caught:
        BOX.check_inside([[8e3, 5e-5], [value, 5e-5]])
    assert caught.value.field == "K"
    assert caught.value.value == pytest.approx(value, nan_ok=True)
    assert "6000.0 to 10000.0 (row 1" in str(caught.value)
    assert isinstance(caught.value, InvalidInput)


def test_what_printing_put_outside_is_moved_to_the_boundary():
    box = Box(("K", "J_in"), (19372.5, 1.4775e-4), (32287.5, 2.4625e-4))
    inside = box.settle([[32290.0, 1.477e-4], [19370.0, 2.463e-4], [2e4, 2e-4]])
    assert np.array_equal(inside, [[32287.5, 1.4775e-4], [19372.5, 2.4625e-4], [2e4, 2e-4]])


@given(st.lists(st.floats(1e-6, 1e6), min_size=2, max_size=2, unique=True), st.booleans())
def test_every_end_comes_back_from_its_four_digits(ends, negative):
    lower, upper = sorted(-np.array(ends) if negative else ends)
    unit = max(abs(lower), abs(upper)) * 1e-3
    assume(upper - lower > 200 * unit)
    box = Box(("x",), (lower,), (upper,))
    read_back = [[float(f"{end:.3e}")] for end in (lower, upper)]
    assert np.array_equal(box.settle(read_back), np.clip(read_back, lower, upper))


@pytest.mark.parametrize(
    ("lower", "upper", "value"),
    [
        (6e3, 1e4, 1e4 + 5.01),
        (6e3, 1e4, 6e3 - 0.51),
        (0.0, 1.0, -1e-9),
        (1.0, 1.0001, 1.0003),
        (6e3, 1e4, np.nan),
        (6e3, 1e4, np.inf),
    ],
)
def test_more_than_printing_explains_is_refused(lower, upper, value):
    box = Box(("K",), (lower,), (upper,))
    with pytest.raises(ExtrapolationError, match=f"K is {value}"):
        box.settle([[value]])


def test_the_second_variable_is_named_too():
    with pytest.raises(ExtrapolationError, match="J_in is 9e-05"):
        BOX.check_inside([[8e3, 9e-5]])


@pytest.mark.parametrize("points", [[8e3, 5e-5], [[8e3]], [[8e3, 5e-5, 1.0]], "K", [["K", "J"]]])
def test_points_of_another_shape_are_refused(points):
    with pytest.raises(InvalidInput, match="points"):
        BOX.to_cube(points)


def test_no_points_give_no_points():
    assert BOX.to_cube(np.empty((0, 2))).shape == (0, 2)


@pytest.mark.parametrize(
    ("names", "lower", "upper", "field"),
    [
        ((), (), (), "names"),
        (("K", "K"), (0, 0), (1, 1), "names"),
        (("K", ""), (0, 0), (1, 1), "names"),
        ("KJ", (0, 0), (1, 1), "names"),
        (("K", 3), (0, 0), (1, 1), "names"),
        (("K", "J"), (0, 0), (1, 0), "upper['J']"),
        (("K", "J"), (0, 2), (1, 1), "upper['J']"),
        (("K", "J"), (0, np.nan), (1, 1), "lower[1]"),
        (("K", "J"), (0, 0), (1, np.inf), "upper[1]"),
        (("K", "J"), (0,), (1, 1), "shape of lower"),
    ],
)
def test_a_box_that_is_none_is_refused(names, lower, upper, field):
    with pytest.raises(InvalidInput) as caught:
        Box(names, lower, upper)
    assert caught.value.field == field


def test_a_box_does_not_share_or_release_its_bounds():
    lower = np.zeros(2)
    box = Box(("a", "b"), lower, np.ones(2))
    lower[0] = 0.5
    assert box.lower[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        box.lower[0] = 0.5


def test_points_are_left_as_they_were():
    points = np.array([[8e3, 5e-5], [1e4 * (1 + 1e-15), 8e-5]])
    before = points.copy()
    BOX.to_cube(points)
    assert np.array_equal(points, before)


def test_boxes_compare_by_value_and_survive_copying():
    assert pickle.loads(pickle.dumps(BOX)) == BOX == copy.deepcopy(BOX)
    assert Box(("K", "J"), BOX.lower, BOX.upper) != BOX
    assert Box(BOX.names, BOX.lower, 2 * BOX.upper) != BOX
    assert BOX != "a box"
