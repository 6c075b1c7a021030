"""The blind cases: what each hides, from which seed, under which stress.

The list is interleaved: any prefix of it has the same mix of kinds, effects, forms and stresses. A
case draws what it hides, its session, the noise and the stress from generators of their own, so
that its twin, the same session and noise without what is hidden, can be run too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from experiments.studies.blind.rig.forms import FORMS, LISTED, UNLISTED, draw_effect
from experiments.studies.blind.rig.hidden import Clash, Drawn, equipped
from experiments.studies.blind.rig.session import draw_circumstances
from pymoo_hdte.discrepancy import BelievedDrive, Rig
from pymoo_hdte.units import ARCSEC

SCORING_SEED = 20261123

BLOCK = (
    "single", "pair", "stressed", "single", "none", "single", "unlisted", "single",
    "stressed", "pair", "single", "none", "single", "triple", "stressed", "single",
    "pair", "unlisted", "single", "none", "single", "stressed", "pair", "single",
)  # fmt: skip
"""Kinds of 24 cases in a row."""
BLOCKS = 200
"""The first 100 were the whole list until 2026-11-27, when all but their last 36 cases had run."""
STRESSES = ("noise", "outliers", "one_load", "half", "parameters", "amplitudes")
"""Noise other than stated, faulty rows, one load only, half of the records; base parameters, or
amplitudes of the static error, far beyond their tolerance."""
HIDES_NOTHING = {"noise": 2, "outliers": 2}
"""Every which case hides nothing: half of those where an alarm would be a false one; else 4."""
OUT_OF_TOLERANCE = ("parameters", "amplitudes")
"""Stresses that are something to be named themselves."""

BELIEVED = BelievedDrive(
    ratio=101.0,
    stiffness=2.583e4,
    damping=4.5,
    input_inertia=1.97e-4,
    input_damping=1.7e-4,
    output_damping=5.022e-4,
    output_inertia=8.505e-4,
    load_inertia=0.08,
    error_orders=(1.0, 2.0, 2.02),
    error_amplitudes=(4.0 * ARCSEC, 9.0 * ARCSEC, 5.0 * ARCSEC),
)
"""The HS-20-100, and below the rig, of the shared campaigns."""
RIG = Rig(
    proportional=0.02,
    integral=0.5,
    angle_noise=0.7 * ARCSEC,
    input_torque_noise=0.003,
    output_torque_noise=0.2,
    repeatability=0.3 * ARCSEC,
    torsion_angle_noise=0.204 * ARCSEC,
)


@dataclass(frozen=True)
class Case:
    """One campaign with a hidden truth.

    Attributes
    ----------
    kind : str
        "none", "single", "unlisted", "pair", "triple" or "stressed".
    number : int
        Counts the cases of a kind.
    root : int
        Seed of the whole list.
    """

    kind: str
    number: int
    root: int = SCORING_SEED

    @property
    def key(self) -> str:
        """All fields in one name."""
        return f"{self.kind}_{self.number:04d}_seed{self.root}"

    @property
    def stress(self) -> str:
        """One of `STRESSES`, or nothing."""
        return STRESSES[self.number % len(STRESSES)] if self.kind == "stressed" else ""

    @property
    def drawn(self) -> tuple[Drawn, ...]:
        """What is hidden, at the sizes that are drawn before they are made visible."""
        return _drawn(self)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the hidden effects."""
        return tuple(effect.name for effect in self.drawn)

    @property
    def truth(self) -> str:
        """What is hidden, in one word: effects, and the stress where that is to be named too."""
        further = (f"{self.stress}_off",) if self.stress in OUT_OF_TOLERANCE else ()
        return "+".join((*self.names, *further)) or "none"

    @property
    def forms(self) -> str:
        """Forms of the hidden effects, in words."""
        return "; ".join(effect.form for effect in self.drawn)

    def generator(self, purpose: str) -> np.random.Generator:
        """Return the generator for one purpose; those of two purposes are independent."""
        words = tuple(f"{self.kind} {self.number} {purpose}".encode())
        return np.random.default_rng(np.random.SeedSequence(self.root, spawn_key=words))


def all_cases(root: int = SCORING_SEED) -> list[Case]:
    """Return all cases of a root seed, in the order in which they are run."""
    counts: dict[str, int] = {}
    cases = []
    for kind in BLOCK * BLOCKS:
        number = counts.get(kind, 0)
        counts[kind] = number + 1
        cases.append(Case(kind, number, root))
    return cases


def _several(rng: np.random.Generator, count: int) -> tuple[Drawn, ...]:
    """Draw different effects until a bench can have all of them."""
    bench = draw_circumstances(np.random.default_rng(0))
    while True:
        names = rng.choice(list(LISTED), count, replace=False).tolist()
        effects = tuple(draw_effect(name, int(rng.integers(FORMS[name])), rng) for name in names)
        try:
            equipped(bench.machine, bench.sensors, tuple(effect.hidden for effect in effects))
        except Clash:
            continue
        return effects


@cache
def _drawn(case: Case) -> tuple[Drawn, ...]:
    """Draw what a case hides; kept here, as what is drawn cannot go with a case to a worker."""
    rng, number = case.generator("effects"), case.number
    if case.kind == "none":
        return ()
    if case.kind == "unlisted":
        return (draw_effect(UNLISTED[number % len(UNLISTED)], 0, rng),)
    if case.kind in ("pair", "triple"):
        return _several(rng, 2 if case.kind == "pair" else 3)
    if case.kind == "stressed":
        turn, stress = divmod(number, len(STRESSES))
        every = HIDES_NOTHING.get(case.stress, 4)
        if (turn + stress + turn // len(LISTED)) % every == every - 1:
            return ()
        # Each stress begins elsewhere in the list of effects.
        number = turn + 5 * stress
    turn, place = divmod(number, len(LISTED))
    name = LISTED[place]
    return (draw_effect(name, turn % FORMS[name], rng),)
