"""Reasons of a verdict are data; words are made of them in one place."""

import json

import pytest

from pymoo_hdte.discrepancy._report.words import LIMITS, in_a_sentence, limit_sentence
from pymoo_hdte.discrepancy._selection import reason as codes
from pymoo_hdte.discrepancy._selection.reason import Reason

CODES = [value for name, value in vars(codes).items() if name.isupper()]
NUMBERS = {
    codes.ABOVE_NOISE: {"times_noise": 3.0},
    codes.EXPLAINS_TOO_LITTLE: {"share": 0.6},
    codes.HARMONIC_OF_ANOTHER: {"backlash:mesh@1": 2.0},
    codes.MORE_MISSING: {"outside": 0.6},
    codes.RICHER_LEAVES_LESS: {"share": 0.16},
    codes.SENSOR_OFF: {"fitted": 0.1, "stated": 0.01},
    codes.LINES_ABOVE: {"20": 20.0, "highest": 18.0},
    codes.HARMONIC_ABOVE: {"order": 10.0, "highest": 18.0},
}


@pytest.mark.parametrize("code", CODES)
def test_every_code_has_a_sentence_and_is_plain_data(code):
    effect = "input_torque_gain" if code == codes.SENSOR_OFF else "hysteresis:mesh"
    reason = Reason.of(code, effect, NUMBERS.get(code, {"level": 0.5}))
    assert (limit_sentence if code in LIMITS else in_a_sentence)(reason)
    assert json.loads(json.dumps(reason.as_dict())) == {
        "code": code,
        "effect": effect,
        "numbers": dict(reason.numbers),
    }


def test_no_two_codes_are_one():
    assert len(set(CODES)) == len(CODES)


def test_reasons_are_the_same_if_all_of_them_is():
    reason = Reason.of(codes.ABOVE_NOISE, numbers={"times_noise": 2.0})
    assert reason == Reason.of(codes.ABOVE_NOISE, numbers={"times_noise": 2.0})
    assert len({reason, Reason.of(codes.ABOVE_NOISE, numbers={"times_noise": 3.0})}) == 2
