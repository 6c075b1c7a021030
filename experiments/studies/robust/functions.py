"""Twenty functions of the literature of uncertainty quantification, with two designed inputs each.

Formulas and ranges are those of the sources, collected by Surjanovic and Bingham (Virtual Library
of Simulation Experiments, Simon Fraser University). Which two inputs are designed is chosen here.
The last ten are one of each kind that simulators of others are: peaks, waves, jumps, kinks, failing
regions, noise of a mesh, counts, systems, many inputs, and a field of values.
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
        Maps d arrays of shape (n,) to one, or to one of shape (n, r); NaN where it fails.
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


def corner_peak(**x: Array) -> Array:
    """Return (1 + 5 (x_1 + .. + x_d))^-(d + 1)."""
    return (1.0 + 5.0 * sum(x.values())) ** -(len(x) + 1.0)


def oscillatory(**x: Array) -> Array:
    """Return cos(pi + 5 (x_1 + .. + x_d))."""
    return np.cos(np.pi + 5.0 * sum(x.values()))


def jump(x1: Array, x2: Array, x3: Array) -> Array:
    """Return exp(5 (x1 + x2 + x3)) where x1 and x2 are below a half, else 0."""
    return np.where((x1 <= 0.5) & (x2 <= 0.5), np.exp(5.0 * (x1 + x2 + x3)), 0.0)


def two_kinks(x1: Array, x2: Array, x3: Array) -> Array:
    """Return abs(x1 - x2) + x1 abs(x3 - 0.4)."""
    return np.abs(x1 - x2) + x1 * np.abs(x3 - 0.4)


def failing(x1: Array, x2: Array, x3: Array) -> Array:
    """Return sqrt(x1 + x2 - 0.6) + x3, NaN where the root is none."""
    under = x1 + x2 - 0.6
    return np.where(under < 0.0, np.nan, np.sqrt(np.maximum(under, 0.0))) + x3


def mesh_noise(x1: Array, x2: Array, x3: Array) -> Array:
    """Return x1^2 x2 + exp(x3) and a noise of amplitude 0.01."""
    return x1**2 * x2 + np.exp(x3) + 0.01 * np.sin(1e5 * x1 + 7e4 * x2 + 3e4 * x3)


def spring(D: Array, d: Array, F: Array, n: Array) -> Array:
    """Return the deflection in m of a helical spring of steel with a whole number of coils."""
    return 8.0 * F * D**3 * np.round(n) / (79e9 * d**4)


def four_branches(x1: Array, x2: Array, u: Array, v: Array) -> Array:
    """Return the least of four margins, raised by x1, two of them bent by x2."""
    bowl, turn = 3.0 + (0.05 + 0.1 * x2) * (u - v) ** 2, (u + v) / 2.0**0.5
    lines = u - v + 7.0 / 2.0**0.5, v - u + 7.0 / 2.0**0.5
    return np.minimum.reduce([bowl - turn, bowl + turn, *lines]) + x1


def twenty_inputs(**x: Array) -> Array:
    """Return the function of Welch et al. of 20 inputs, two of which are without effect."""
    linear = {5: 1.0, 19: -5.0, 2: 0.05, 3: 0.08, 6: -0.03, 7: 0.03, 9: -0.09, 10: -0.01}
    linear |= {11: -0.07, 14: -0.04, 15: 0.06, 17: -0.01, 18: -0.03}
    curved = 5.0 * (x["x4"] - x["x20"]) ** 2 + 40.0 * x["x19"] ** 3 + 0.25 * x["x13"] ** 2
    return (
        5.0 * x["x12"] / (1.0 + x["x1"])
        + curved
        + sum(weight * x[f"x{k}"] for k, weight in linear.items())
    )


def decay(stiffness: Array, damping: Array, mass: Array, start: Array) -> Array:
    """Return where a damped oscillator is at 60 times after its start."""
    times = np.linspace(0.2, 12.0, 60)
    own = np.sqrt(stiffness / mass)[:, None]
    share = damping[:, None] / (2.0 * mass[:, None] * own)
    turn = own * np.sqrt(1.0 - share**2) * times
    late = np.exp(-share * own * times)
    return start[:, None] * late * (np.cos(turn) + share / np.sqrt(1.0 - share**2) * np.sin(turn))


_ANGLE = Uniform(0.0, 2.0 * np.pi)
_SHARE = Uniform(0.0, 1.0)
_WAVE = Uniform(-np.pi, np.pi)
_THREE = ("x1", "x2", "x3")

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
    Function(
        "corner peak",
        "Genz, Tools, Methods and Languages for Scientific Computation, 1984",
        corner_peak,
        {f"x{k}": _SHARE for k in range(1, 4)},
        ("x1", "x2"),
    ),
    Function(
        "oscillatory",
        "Genz 1984",
        oscillatory,
        {f"x{k}": _SHARE for k in range(1, 5)},
        ("x1", "x2"),
    ),
    Function("jump", "Genz 1984, discontinuous", jump, dict.fromkeys(_THREE, _SHARE), ("x1", "x2")),
    Function("two kinks", "chosen here", two_kinks, dict.fromkeys(_THREE, _SHARE), ("x1", "x2")),
    Function(
        "failing region",
        "chosen here",
        failing,
        {"x1": Uniform(0.2, 1.0), "x2": Uniform(0.1, 1.0), "x3": Uniform(0.0, 0.3)},
        ("x1", "x2"),
    ),
    Function(
        "mesh noise",
        "chosen here",
        mesh_noise,
        {"x1": Uniform(0.9, 2.1), "x2": _SHARE, "x3": Normal(0.0, 0.3)},
        ("x1", "x2"),
    ),
    Function(
        "spring",
        "the formula of textbooks of machine elements, ranges chosen here",
        spring,
        {
            "D": Uniform(0.03, 0.05),
            "d": Uniform(0.004, 0.006),
            "F": Normal(200.0, 20.0),
            "n": Uniform(7.5, 11.5),
        },
        ("D", "d"),
    ),
    Function(
        "four branches",
        "Waarts, Structural Reliability Using Finite Element Methods, 2000; x1 and x2 added",
        four_branches,
        {"x1": _SHARE, "x2": _SHARE, "u": Normal(0.0, 1.0), "v": Normal(0.0, 1.0)},
        ("x1", "x2"),
    ),
    Function(
        "twenty inputs",
        "Welch, Buck, Sacks, Wynn, Mitchell and Morris, Technometrics 34, 1992",
        twenty_inputs,
        {f"x{k}": Uniform(-0.5, 0.5) for k in (12, 1, *range(2, 12), *range(13, 21))},
        ("x12", "x1"),
    ),
    Function(
        "decay",
        "a damped oscillator after its start, 60 values, ranges chosen here",
        decay,
        {
            "stiffness": Uniform(0.6, 1.4),
            "damping": Uniform(0.1, 0.3),
            "mass": Uniform(0.95, 1.05),
            "start": Normal(1.0, 0.1),
        },
        ("stiffness", "damping"),
    ),
)
BY_NAME = {function.name: function for function in FUNCTIONS}
