"""Curves that laws of the machine are made of."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

MEAN_OF_BUMP = 1.2660658777520084
"""I0(1), mean of exp(cos x) over a period."""
TRAPEZOID = 3.0
"""How steep the sides of the rounded trapezoid are."""


@njit(cache=True)
def copy_into(target: NDArray[np.float64], source: NDArray[np.float64]) -> None:
    """Copy an array (n,) into another; slices take seconds to compile, for words of an error."""
    for place in range(len(source)):
        target[place] = source[place]


@njit(cache=True)
def wave(form: float, x: float) -> tuple[float, float]:
    """Return a wave of period 2 pi without mean, of amplitude near 1, and its slope.

    0 is a cosine, 1 one with 30 % of its second harmonic, 2 a rounded trapezoid, 3 a narrow crest.
    """
    cosine, sine = math.cos(x), math.sin(x)
    if form == 1.0:
        return cosine + 0.3 * math.cos(2.0 * x + 1.0), -sine - 0.6 * math.sin(2.0 * x + 1.0)
    if form == 2.0:
        value, top = math.tanh(TRAPEZOID * cosine), math.tanh(TRAPEZOID)
        return value / top, -TRAPEZOID * (1.0 - value * value) * sine / top
    if form == 3.0:
        crest = math.exp(cosine)
        return crest - MEAN_OF_BUMP, -crest * sine
    return cosine, -sine


@njit(cache=True)
def decay(form: float, x: float) -> float:
    """Return a curve that falls from 1 at x = 0: Gaussian, exponential or rational."""
    if form == 1.0:
        return math.exp(-abs(x))
    if form == 2.0:
        return 1.0 / (1.0 + x * x)
    return math.exp(-x * x)


@njit(cache=True)
def rounded_sign(form: float, x: float) -> float:
    """Return a sign rounded over x of about 1: tanh, arc tangent or root."""
    if form == 1.0:
        return 2.0 / math.pi * math.atan(0.5 * math.pi * x)
    if form == 2.0:
        return x / math.sqrt(1.0 + x * x)
    return math.tanh(x)


@njit(cache=True)
def beyond_gap(form: float, x: float, half_width: float) -> float:
    """Return the deflection of flanks with a gap: sharp, of soft skin, or of round contact."""
    distance = abs(x) - half_width
    if form == 1.0:
        skin = 0.3 * half_width + 1e-15
        # Two soft contacts, one on each side.
        upper = skin * _softplus((x - half_width) / skin)
        return upper - skin * _softplus((-x - half_width) / skin)
    if distance <= 0.0:
        return 0.0
    if form == 2.0:
        round_off = 0.25 * half_width
        distance = math.sqrt(distance * distance + round_off * round_off) - round_off
    return math.copysign(distance, x)


@njit(cache=True)
def _softplus(x: float) -> float:
    return max(x, 0.0) + math.log1p(math.exp(-abs(x)))


@njit(cache=True)
def bouc_wen(z: float, way: float, exponent: float, beta: float) -> float:
    """Return the state after a way in units of the torsion of yield, z between -1 and 1.

    dz/dx = 1 - |z|^n (beta sgn(dx z) + 1 - beta): midpoint steps of a twentieth of the yield.
    """
    steps = 1 + int(20.0 * abs(way))
    part = way / steps
    for _ in range(steps):
        middle = z + 0.5 * part * _bouc_wen_slope(z, part, exponent, beta)
        z += part * _bouc_wen_slope(middle, part, exponent, beta)
        z = min(max(z, -1.0), 1.0)
    return z


@njit(cache=True)
def _bouc_wen_slope(z: float, way: float, exponent: float, beta: float) -> float:
    turn = 1.0 if way * z > 0.0 else -1.0
    return 1.0 - abs(z) ** exponent * (beta * turn + 1.0 - beta)


@njit(cache=True)
def bump(time: float, period: float, width: float) -> float:
    """Return a smooth pulse of height 1 at an irregular moment of every period."""
    number = math.floor(time / period)
    # The golden ratio spreads the moments evenly and never repeats them.
    place = number * 0.6180339887498949
    begin = number * period + (place - math.floor(place)) * (period - width)
    share = (time - begin) / width
    if share <= 0.0 or share >= 1.0:
        return 0.0
    return math.sin(math.pi * share) ** 2
