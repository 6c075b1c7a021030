"""A session with what is hidden, and without it; sizes at which effects are visible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from experiments.blind.rig import elements as el
from experiments.blind.rig.hidden import Drawn, equipped
from experiments.blind.rig.machine import Matrix
from experiments.blind.rig.session import Circumstances, running, sweep
from experiments.blind.rig.visible import LEAST, features, orders_seen, visibility


@dataclass(frozen=True, eq=False)
class Shown:
    """What sensors without noise show in a session: raw samples of each record, and the sweep."""

    records: tuple[Matrix, ...]
    torsion: Matrix


def shown(about: Circumstances, effects: Sequence[Drawn]) -> Shown:
    """Run a session with hidden effects."""
    machine, sensors = equipped(about.machine, about.sensors, tuple(one.hidden for one in effects))
    records = tuple(
        running(about, place, machine, sensors) for place in range(len(about.conditions))
    )
    return Shown(records, sweep(machine, sensors))


def made_visible(
    about: Circumstances, effect: Drawn, clean: Shown, rng: np.random.Generator
) -> tuple[Drawn, Shown]:
    """Return an effect at a size at which it is visible, if one is plausible: see `visible`.

    Its session beside it is that of the returned size.
    """
    factor = LEAST * rng.uniform(1.0, 2.0)
    session = shown(about, [effect])
    seen = seen_of(about, effect, session, clean)
    if seen >= LEAST or not effect.scales:
        return effect, session
    larger = effect.times(factor / seen if seen > 0.0 else np.inf)
    return larger, shown(about, [larger])


def seen_of(about: Circumstances, effect: Drawn, session: Shown, clean: Shown) -> float:
    """Return the visibility of an effect: its session beside the same without it."""
    further = [
        row[2] / (about.machine.ratio if row[0] == el.LOAD_RIPPLE else 1.0)
        for row in effect.hidden.elements
        if row[0] in (el.ERROR_WAVE, el.LOAD_RIPPLE)
    ]
    orders = orders_seen(about.machine.ratio, further)
    changes = [
        features(about, place, session.records[place] - clean.records[place], orders)
        for place, condition in enumerate(about.conditions)
        if condition.role == "train"
    ]
    return visibility(about, changes, orders, session.torsion[0] - clean.torsion[0])


def restricted(about: Circumstances, kept: Sequence[int]) -> Circumstances:
    """Return a session with some of its records only."""
    rows = list(kept)
    return replace(
        about,
        conditions=tuple(about.conditions[row] for row in rows),
        loads=about.loads[rows],
        starts=about.starts[rows],
        clocks=about.clocks[rows],
        unrepeated=about.unrepeated[rows],
        offsets=about.offsets[rows],
    )
