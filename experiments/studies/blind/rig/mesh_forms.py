"""Hidden effects of the mesh that the library has too, in forms of their own and in its own.

Every function draws one effect in the form of a number, 0 being that of the library. Sizes are our
choice within the usual range of such drives.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from experiments.studies.blind.rig import elements as el
from experiments.studies.blind.rig.elements import element
from experiments.studies.blind.rig.hidden import Drawn, Hidden
from experiments.studies.blind.rig.session import ARCSEC, SHEET

Generator = np.random.Generator
K, WINDUP = SHEET.stiffness, SHEET.windup
RATED_SPEED = 2000.0 * math.pi / 30.0


def phase(rng: Generator) -> float:
    """Draw a phase, rad."""
    return float(rng.uniform(0.0, 2.0 * math.pi))


def hardening_stiffness(rng: Generator, form: int) -> Drawn:
    """Draw a cubic, a hyperbolic sine or a second spring: 4 to 12 % more torque at rated load."""
    corner = rng.uniform(0.3, 0.6) * WINDUP

    def build(share: float) -> Hidden:
        if form == 0:
            row = element(el.CUBIC, share * K / WINDUP**2)
            return Hidden((row,), quantities={"coefficient": share * K / WINDUP**2})
        if form == 1:
            reach = brentq(lambda x: math.sinh(x) / x - 1.0 - share, 1e-6, 20.0)
            return Hidden((element(el.SINH, K, reach / WINDUP),))
        spring = share * K * WINDUP / (WINDUP - corner)
        return Hidden((element(el.OVERLOAD, spring, corner, 0.05 * WINDUP),))

    words = ("cubic", "hyperbolic sine", "second spring beyond a torsion")
    return Drawn("hardening_stiffness", "mesh", words[form], rng.uniform(0.04, 0.12), 0.4, build)


def soft_windup(rng: Generator, form: int) -> Drawn:
    """Draw a mesh softer by 15 to 40 % near zero, wound up at 10 to 35 % of rated torsion."""
    wound = rng.uniform(0.1, 0.35) * WINDUP
    kinds = (el.SOFT_ROOT, el.SOFT_PIECES, el.SOFT_EXPONENTIAL, el.SOFT_ARCTANGENT)
    words = ("root", "straight pieces", "exponential", "arc tangent")

    def build(share: float) -> Hidden:
        return Hidden((element(kinds[form], share * K, wound),))

    return Drawn("soft_windup", "mesh", words[form], rng.uniform(0.15, 0.4), 0.8, build)


def hysteresis(rng: Generator, form: int) -> Drawn:
    """Draw 0.5 to 2.5 N.m that lag: springs that slip, few or many, or Bouc and Wen's law."""
    longest = rng.uniform(0.1, 0.4) * WINDUP
    exponent, beta = float(rng.integers(1, 3)), float(rng.uniform(0.5, 0.8))
    spread = rng.exponential(1.0, 12)
    yields = WINDUP * np.exp(rng.uniform(math.log(0.02), math.log(0.4), 12))

    def build(torque: float) -> Hidden:
        if form == 1:
            row = element(el.BOUC_WEN, torque, 0.4 * longest, exponent, beta)
            return Hidden((row,), quantities={"force": torque})
        shares, slips = spread / spread.sum(), yields
        if form == 0:
            shares, slips = np.full(4, 0.25), np.asarray(longest * np.arange(1, 5) / 4.0)
        rows = [
            element(el.SLIP, share * torque / slip, share * torque)
            for share, slip in zip(shares, slips, strict=True)
        ]
        return Hidden(tuple(rows), quantities={"force": torque})

    words = ("four springs that slip", "Bouc-Wen", "twelve uneven springs that slip")
    return Drawn("hysteresis", "mesh", words[form], rng.uniform(0.5, 2.5), 8.0, build)


CONTACTS = ("sharp", "soft skin", "round contact")


def backlash(rng: Generator, form: int) -> Drawn:
    """Draw a gap of 2 to 8 arcsec on each side: sharp, with soft skin or round contact."""

    def build(half_width: float) -> Hidden:
        row = element(el.PLAY, half_width, 0.0, 1.0, 0.0, form)
        return Hidden((row,), quantities={"half_width": half_width} if form == 0 else {})

    size = rng.uniform(2.0, 8.0) * ARCSEC
    return Drawn("backlash", "mesh", CONTACTS[form], size, 30.0 * ARCSEC, build)


def clearance_variation(rng: Generator, form: int) -> Drawn:
    """Draw a gap whose width varies by 50 to 100 % once or twice in an input turn.

    Both flanks move, or one does. A gap that moves as a whole is not drawn: under load it is a
    backlash and a line of the static error, and nothing else.
    """
    order, at, share = float(rng.integers(1, 3)), phase(rng), rng.uniform(0.5, 1.0)
    moves = (0.0, 0.5, 0.0)[form]
    shape = (0.0, 0.0, 1.0)[form]

    def build(half_width: float) -> Hidden:
        row = element(el.PLAY, half_width, share * half_width, order, at, form, moves, shape)
        return Hidden((row,))

    def steady(half_width: float) -> Hidden:
        return Hidden((element(el.PLAY, half_width, 0.0, order, at, form),))

    words = f"{CONTACTS[form]}, {('both flanks', 'one flank', 'with a harmonic')[form]}"
    size = rng.uniform(2.0, 8.0) * ARCSEC
    return Drawn("clearance_variation", "mesh", words, size, 30.0 * ARCSEC, build, simpler=steady)


def mesh_stiffness_variation(rng: Generator, form: int) -> Drawn:
    """Draw a stiffness that varies twice in an input turn, by 1 to 5 %."""
    at = phase(rng)

    def build(depth: float) -> Hidden:
        if form == 2:
            return Hidden((element(el.COMPLIANCE_WAVE, depth, 2.0, at),))
        row = element(el.STIFFNESS_WAVE, depth, 2.0, at, (0.0, 2.0, 0.0, 3.0)[form])
        return Hidden((row,), quantities={"depth": depth} if form == 0 else {})

    words = ("cosine", "trapezoid", "cosine of the compliance", "crest")
    return Drawn("mesh_stiffness_variation", "mesh", words[form], rng.uniform(0.01, 0.05), 0.2,
                 build)  # fmt: skip


def damping_reference(rng: Generator, form: int) -> Drawn:
    """Draw mesh damping 3 to 10 times the believed one, steady or growing with a speed."""

    def build(further: float) -> Hidden:
        grown = (0.0, 0.3 / RATED_SPEED, 0.0)[form], (0.0, 0.0, 20.0)[form]
        return Hidden((element(el.DAMPING, further * SHEET.damping, *grown),))

    words = ("steady", "grows with the speed", "grows with the torsion's rate")
    return Drawn("damping_reference", "mesh", words[form], rng.uniform(2.0, 9.0), 25.0, build)


def kinematic_error(rng: Generator, form: int) -> Drawn:
    """Draw a line of 1 to 4 arcsec of order 3, 4 or 5, or 5 to 60 times in an output turn."""
    fast = rng.random() < 0.5
    order = float(rng.integers(3, 6)) if fast else float(rng.integers(5, 61)) / 101.0
    at = phase(rng)

    def build(amplitude: float) -> Hidden:
        row = element(el.ERROR_WAVE, amplitude, order, at, (0.0, 1.0, 3.0)[form])
        return Hidden((row,), quantities={"amplitude": amplitude} if form < 2 else {})

    words = ("sine", "with a harmonic", "crest")
    size = rng.uniform(1.0, 4.0) * ARCSEC
    return Drawn("kinematic_error", "mesh", words[form], size, 15.0 * ARCSEC, build)


def kinematic_reaction(rng: Generator, form: int) -> Drawn:
    """Return what the mesh torque does on the input through the slope of the static error.

    Its size is that of the principle of virtual work. Foreign forms: the spring alone reacts, or
    the whole with a lag of 0.3 to 1 ms, as through a wave generator that gives way.
    """
    lag = rng.uniform(3e-4, 1e-3)

    def build(share: float) -> Hidden:
        return Hidden((element(el.REACTION, share, float(form == 1), lag if form == 2 else 0.0),))

    words = ("whole", "of the spring alone", "with a lag")
    return Drawn("kinematic_reaction", "input", words[form], 1.0, 1.0, build, scales=False)
