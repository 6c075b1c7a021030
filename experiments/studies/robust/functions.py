"""Ten functions of the literature of uncertainty quantification, with two designed inputs each.

Formulas and ranges are those of the sources, collected by Surjanovic and Bingham (Virtual Library
of Simulation Experiments, Simon Fraser University). Which two inputs are designed is chosen here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Uniform:
    """Uniform between two ends in the input's unit."""

    lower: float
    upper: float


@dataclass(frozen=True)
class Normal:
    """Normal of a mean and a standard deviation in the input's unit."""

    mean: float
    std: float


@dataclass(frozen=True)
class Function:
    """A function of d inputs and their laws.

    Attributes
    ----------
    name, source : str
    call : callable
        Maps d arrays of shape (n,) to one.
    laws : dict of Uniform or Normal
        By input, in the order of the arguments; those of ``designed`` are uniform.
    designed : tuple of str
    normal_deviation : float
        Standard deviation of a designed input as a share of its range; 0: it deviates uniformly.
    tuned : bool
        Whether constants of the package were chosen on it.
    """

    name: str
    source: str
    call: Callable[..., Array]
    laws: dict[str, Uniform | Normal]
    designed: tuple[str, ...]
    normal_deviation: float = 0.0
    tuned: bool = False


def ishigami(x1: Array, x2: Array, x3: Array) -> Array:
    """Return sin x1 + 7 sin^2 x2 + 0.1 x3^4 sin x1."""
    return np.sin(x1) * (1.0 + 0.1 * x3**4) + 7.0 * np.sin(x2) ** 2


def borehole(
    rw: Array, L: Array, r: Array, Tu: Array, Hu: Array, Tl: Array, Hl: Array, Kw: Array
) -> Array:
    """Return the flow of water through a borehole in m3/yr."""
    log = np.log(r / rw)
    return 2.0 * np.pi * Tu * (Hu - Hl) / (log * (1.0 + Tu / Tl) + 2.0 * L * Tu / (rw**2 * Kw))


def otl_circuit(
    Rb1: Array, Rb2: Array, Rf: Array, Rc1: Array, Rc2: Array, beta: Array, **inert: Array
) -> Array:
    """Return the midpoint voltage of a push-pull circuit in V; resistances in kOhm."""
    base = 12.0 * Rb2 / (Rb1 + Rb2)
    gain = beta * (Rc2 + 9.0)
    whole = gain + Rf
    return (base + 0.74) * gain / whole + (11.35 + 0.74 * gain / Rc1) * Rf / whole


def piston(S: Array, k: Array, M: Array, V0: Array, P0: Array, Ta: Array, T0: Array) -> Array:
    """Return the time in s of one cycle of a piston in a cylinder."""
    A = P0 * S + 19.62 * M - k * V0 / S
    gas = P0 * V0 * Ta / T0
    V = S / (2.0 * k) * (np.sqrt(A**2 + 4.0 * k * gas) - A)
    return 2.0 * np.pi * np.sqrt(M / (k + S**2 * gas / V**2))


def wing_weight(
    Sw: Array,
    A: Array,
    Wfw: Array,
    sweep: Array,
    q: Array,
    taper: Array,
    tc: Array,
    Nz: Array,
    Wdg: Array,
    Wp: Array,
) -> Array:
    """Return the weight in lb of a light aircraft's wing."""
    cosine = np.cos(np.deg2rad(sweep))
    shape = (A / cosine**2) ** 0.6 * q**0.006 * taper**0.04 * (100.0 * tc / cosine) ** -0.3
    return 0.036 * Sw**0.758 * Wfw**0.0035 * shape * (Nz * Wdg) ** 0.49 + Sw * Wp


def robot_arm(
    L1: Array, L2: Array, L3: Array, L4: Array, t1: Array, t2: Array, t3: Array, t4: Array
) -> Array:
    """Return how far the end of an arm of four segments is from its shoulder."""
    angles = np.cumsum([t1, t2, t3, t4], axis=0)
    lengths = np.array([L1, L2, L3, L4])
    return np.hypot((lengths * np.cos(angles)).sum(axis=0), (lengths * np.sin(angles)).sum(axis=0))


G_WEIGHTS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 500.0)


def g_function(**x: Array) -> Array:
    """Return the product of (|4 x_i - 2| + a_i) / (1 + a_i)."""
    factors = [
        (np.abs(4.0 * value - 2.0) + a) / (1.0 + a)
        for value, a in zip(x.values(), G_WEIGHTS, strict=True)
    ]
    return np.prod(factors, axis=0)


def cantilever(w: Array, t: Array, X: Array, Y: Array, E: Array) -> Array:
    """Return the tip's displacement in inches of a beam of 100 inches under loads in lbf."""
    return 4e6 / (E * w * t) * np.hypot(Y / t**2, X / w**2)


def kink(x1: Array, x2: Array) -> Array:
    """Return abs(x1 - 0.3) + x2."""
    return np.abs(x1 - 0.3) + x2


def resonance(stiffness: Array, damping: Array, mass: Array, frequency: Array) -> Array:
    """Return the amplitude of a damped oscillator for a force of one."""
    apart = stiffness - mass * frequency**2
    return 1.0 / np.hypot(apart, damping * frequency)


_ANGLE = Uniform(0.0, 2.0 * np.pi)
_SHARE = Uniform(0.0, 1.0)
_WAVE = Uniform(-np.pi, np.pi)

FUNCTIONS = (
    Function(
        "Ishigami",
        "Ishigami and Homma, ISUMA 1990",
        ishigami,
        {"x1": _WAVE, "x2": _WAVE, "x3": _WAVE},
        ("x1", "x2"),
        tuned=True,
    ),
    Function(
        "borehole",
        "Harper and Gupta, BMI/ONWI-516, 1983",
        borehole,
        {
            "rw": Uniform(0.05, 0.15),
            "L": Uniform(1120.0, 1680.0),
            "r": Uniform(100.0, 50000.0),
            "Tu": Uniform(63070.0, 115600.0),
            "Hu": Uniform(990.0, 1110.0),
            "Tl": Uniform(63.1, 116.0),
            "Hl": Uniform(700.0, 820.0),
            "Kw": Uniform(9855.0, 12045.0),
        },
        ("rw", "L"),
        tuned=True,
    ),
    Function(
        "OTL circuit",
        "Ben-Ari and Steinberg, Quality Engineering 19, 2007; 14 inputs without effect added",
        otl_circuit,
        {
            "Rb1": Uniform(50.0, 150.0),
            "Rb2": Uniform(25.0, 70.0),
            "Rf": Uniform(0.5, 3.0),
            "Rc1": Uniform(1.2, 2.5),
            "Rc2": Uniform(0.25, 1.2),
            "beta": Uniform(50.0, 300.0),
            **{f"inert{k}": _SHARE for k in range(7, 21)},
        },
        ("Rb1", "Rb2"),
        tuned=True,
    ),
    Function(
        "piston",
        "Kenett and Zacks, Modern Industrial Statistics, 1998",
        piston,
        {
            "S": Uniform(0.005, 0.02),
            "k": Uniform(1000.0, 5000.0),
            "M": Uniform(30.0, 60.0),
            "V0": Uniform(0.002, 0.01),
            "P0": Uniform(90000.0, 110000.0),
            "Ta": Uniform(290.0, 296.0),
            "T0": Uniform(340.0, 360.0),
        },
        ("S", "k"),
        tuned=True,
    ),
    Function(
        "wing weight",
        "Forrester, Sobester and Keane, Engineering Design via Surrogate Modelling, 2008",
        wing_weight,
        {
            "Sw": Uniform(150.0, 200.0),
            "A": Uniform(6.0, 10.0),
            "Wfw": Uniform(220.0, 300.0),
            "sweep": Uniform(-10.0, 10.0),
            "q": Uniform(16.0, 45.0),
            "taper": Uniform(0.5, 1.0),
            "tc": Uniform(0.08, 0.18),
            "Nz": Uniform(2.5, 6.0),
            "Wdg": Uniform(1700.0, 2500.0),
            "Wp": Uniform(0.025, 0.08),
        },
        ("Sw", "A"),
        tuned=True,
    ),
    Function(
        "cantilever",
        "Wu, Shin, Sues and Cesare, AIAA 2001-1650",
        cantilever,
        {
            "w": Uniform(2.0, 4.0),
            "t": Uniform(2.0, 4.0),
            "X": Normal(500.0, 100.0),
            "Y": Normal(1000.0, 100.0),
            "E": Normal(2.9e7, 1.45e6),
        },
        ("w", "t"),
        tuned=True,
    ),
    Function(
        "robot arm",
        "An and Owen, Journal of Complexity 17, 2001",
        robot_arm,
        {
            **{f"L{k}": _SHARE for k in range(1, 5)},
            **{f"t{k}": _ANGLE for k in range(1, 5)},
        },
        ("L1", "L2"),
    ),
    Function(
        "G-function",
        "Saltelli and Sobol 1995; weights of Sudret, Reliability Eng. System Safety 93, 2008",
        g_function,
        {f"x{k}": _SHARE for k in range(1, 9)},
        ("x1", "x2"),
    ),
    Function(
        "kink",
        "chosen here: a kink under a smooth scatter",
        kink,
        {"x1": _SHARE, "x2": _SHARE},
        ("x1", "x2"),
        normal_deviation=0.1,
    ),
    Function(
        "resonance",
        "a damped oscillator, ranges chosen here",
        resonance,
        {
            "stiffness": Uniform(0.6, 1.4),
            "damping": Uniform(0.1, 0.3),
            "mass": Uniform(0.95, 1.05),
            "frequency": Uniform(0.9, 1.1),
        },
        ("stiffness", "damping"),
    ),
)
BY_NAME = {function.name: function for function in FUNCTIONS}
