"""Eight members of RE, a suite of engineering problems.

Source: R. Tanabe, H. Ishibuchi, An easy-to-use real-world multi-objective optimization problem
suite, Applied Soft Computing 89, 2020, whose names these are. Constraints of the original problems
are an objective of their own there, the sum of what they are violated by. Of the sixteen members,
RE22, RE25, RE35, RE36, RE41, RE42, RE61 and RE91 are left out.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from experiments.studies.suites.formulas.plain_problem import PlainProblem

Array = NDArray[np.float64]

ROOT_2 = np.sqrt(2.0)


def make_engineering(name: str) -> PlainProblem:
    """Return the member of that name, one of `MEMBERS`."""
    objectives, lower, upper, n_obj = MEMBERS[name]
    return PlainProblem(objectives, lower, upper, n_obj)


def _violated(*slacks: Array) -> Array:
    """Return the sum (n,) of what constraints, met from zero on, lack."""
    return np.maximum(-np.array(slacks), 0.0).sum(axis=0)


def _four_bar_truss(X: Array) -> Array:
    a, b, c, d = X.T
    volume = 200.0 * (2.0 * a + ROOT_2 * b + np.sqrt(c) + d)
    shift = 0.01 * (2.0 / a + 2.0 * ROOT_2 / b - 2.0 * ROOT_2 / c + 2.0 / d)
    return np.column_stack([volume, shift])


def _pressure_vessel(X: Array) -> Array:
    shell, head = 0.0625 * np.rint(X[:, 0]), 0.0625 * np.rint(X[:, 1])
    radius, length = X[:, 2], X[:, 3]
    cost = (
        0.6224 * shell * radius * length
        + 1.7781 * head * radius**2
        + 3.1661 * shell**2 * length
        + 19.84 * shell**2 * radius
    )
    volume = np.pi * radius**2 * length + 4.0 / 3.0 * np.pi * radius**3
    slacks = shell - 0.0193 * radius, head - 0.00954 * radius, volume - 1_296_000.0
    return np.column_stack([cost, _violated(*slacks)])


def _hatch_cover(X: Array) -> Array:
    flange, beam = X.T
    bending = 4500.0 / (flange * beam)
    buckling = 7000.0 * flange**2
    shear = 1800.0 / beam
    deflection = 56.2e4 / (7e5 * flange * beam**2)
    slacks = (
        1.0 - bending / 700.0,
        1.0 - shear / 450.0,
        1.0 - deflection / 1.5,
        1.0 - bending / buckling,
    )
    return np.column_stack([flange + 120.0 * beam, _violated(*slacks)])


def _two_bar_truss(X: Array) -> Array:
    a, b, y = X.T
    long, short = np.sqrt(16.0 + y**2), np.sqrt(1.0 + y**2)
    volume = a * long + b * short
    stress = 20.0 * long / (y * a)
    slacks = 0.1 - volume, 1e5 - stress, 1e5 - 80.0 * short / (y * b)
    return np.column_stack([volume, stress, _violated(*slacks)])


def _welded_beam(X: Array) -> Array:
    h, length, t, b = X.T
    load, span, young, shear = 6000.0, 14.0, 30e6, 12e6
    cost = 1.10471 * h**2 * length + 0.04811 * t * b * (14.0 + length)
    deflection = 4.0 * load * span**3 / (young * b * t**3)
    half = (h + t) / 2.0
    radius = np.sqrt(length**2 / 4.0 + half**2)
    polar = 2.0 * ROOT_2 * h * length * (length**2 / 12.0 + half**2)
    primary = load / (ROOT_2 * h * length)
    secondary = load * (span + length / 2.0) * radius / polar
    stress = np.sqrt(primary**2 + primary * secondary * length / radius + secondary**2)
    bending = 6.0 * load * span / (b * t**2)
    slender = t / (2.0 * span) * np.sqrt(young / (4.0 * shear))
    buckling = 4.013 * young * t * b**3 / 6.0 / span**2 * (1.0 - slender)
    slacks = 13_600.0 - stress, 30_000.0 - bending, b - h, buckling - load
    return np.column_stack([cost, deflection, _violated(*slacks)])


def _disc_brake(X: Array) -> Array:
    inner, outer, force, discs = X.T
    squares, cubes = outer**2 - inner**2, outer**3 - inner**3
    mass = 4.9e-5 * squares * (discs - 1.0)
    time = 9.82e6 * squares / (force * discs * cubes)
    slacks = (
        outer - inner - 20.0,
        0.4 - force / (3.14 * squares),
        1.0 - 2.22e-3 * force * cubes / squares**2,
        2.66e-2 * force * discs * cubes / squares - 900.0,
    )
    return np.column_stack([mass, time, _violated(*slacks)])


def _crash(X: Array) -> Array:
    a, b, c, d, e = X.T
    mass = 1640.2823 + X @ [2.3573285, 2.3220035, 4.5688768, 7.7213633, 4.4559504]
    slowing = 6.5856 + 1.15 * a - 1.0427 * b + 0.9738 * c + 0.8364 * d - 0.3695 * a * d
    slowing += 0.0861 * a * e + 0.3628 * b * d - 0.1106 * a**2 - 0.3437 * c**2 + 0.1764 * d**2
    push = -0.0551 + 0.0181 * a + 0.1024 * b + 0.0421 * c - 0.0073 * a * b + 0.024 * b * c
    push += -0.0118 * b * d - 0.0204 * c * d - 0.008 * c * e - 0.0241 * b**2 + 0.0109 * d**2
    return np.column_stack([mass, slowing, push])


_INJECTOR_TERMS = (
    *("1", "a", "b", "c", "d", "aa", "ab", "bb", "ac", "bc", "cc", "ad", "bd", "cd", "dd"),
    *("aab", "aac", "abb", "bbc", "bcc", "add", "abc"),
)
_INJECTOR = np.array(
    [
        # Largest temperature at the face, distance of combustion, largest temperature at the tip.
        [0.692, 0.477, -0.687, -0.080, -0.0650, -0.167, -0.0129, 0.0796, -0.0634, -0.0257, 0.0877,
         -0.0521, 0.00156, 0.00198, 0.0184, 0, 0, 0, 0, 0, 0, 0],
        [0.153, -0.322, 0.396, 0.424, 0.0226, 0.175, 0.0185, -0.0701, -0.251, 0.179, 0.0150,
         0.0134, 0.0296, 0.0752, 0.0192, 0, 0, 0, 0, 0, 0, 0],
        [0.370, -0.205, 0.0307, 0.108, 1.019, -0.135, 0.0141, 0.0998, 0.208, -0.0301, -0.226,
         0.353, 0, -0.0497, -0.423, 0.202, -0.281, -0.342, -0.245, 0.281, -0.184, -0.281],
    ]
)  # fmt: skip


def _rocket_injector(X: Array) -> Array:
    columns = dict(zip("abcd", X.T, strict=True))
    terms = [
        np.prod([columns[letter] for letter in term], axis=0) if term != "1" else np.ones(len(X))
        for term in _INJECTOR_TERMS
    ]
    return np.column_stack(terms) @ _INJECTOR.T


Member = tuple[Callable[[Array], Array], list[float], list[float], int]

MEMBERS: dict[str, Member] = {
    "RE21": (_four_bar_truss, [1.0, ROOT_2, ROOT_2, 1.0], [3.0] * 4, 2),
    "RE23": (_pressure_vessel, [1.0, 1.0, 10.0, 10.0], [100.0, 100.0, 200.0, 240.0], 2),
    "RE24": (_hatch_cover, [0.5, 0.5], [4.0, 50.0], 2),
    "RE31": (_two_bar_truss, [1e-5, 1e-5, 1.0], [100.0, 100.0, 3.0], 3),
    "RE32": (_welded_beam, [0.125, 0.1, 0.1, 0.125], [5.0, 10.0, 10.0, 5.0], 3),
    "RE33": (_disc_brake, [55.0, 75.0, 1000.0, 11.0], [80.0, 110.0, 3000.0, 20.0], 3),
    "RE34": (_crash, [1.0] * 5, [3.0] * 5, 3),
    "RE37": (_rocket_injector, [0.0] * 4, [1.0] * 4, 3),
}
"""Objectives, bounds and number of objectives by name."""
