"""A session with what is hidden, and without it; sizes at which effects are visible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from experiments.studies.blind.rig import elements as el
from experiments.studies.blind.rig.hidden import Drawn, equipped
from experiments.studies.blind.rig.machine import Matrix
from experiments.studies.blind.rig.session import Circumstances, running, sweep
from experiments.studies.blind.rig.visible import LEAST, features, orders_seen, visibility


@dataclass(frozen=True, eq=False)
class Shown:
    """What sensors without noise show in a session: raw samples of each record, and the sweep."""

    records: tuple[Matrix, ...]
    torsion: Matrix


def shown(about: Circumstances, effects: Sequence[Drawn]) -> Shown:
    """Run a session with hidden effects."""
    machine, sensors = equipped(
        about.machine, about.sensors, tuple(effect.hidden for effect in effects)
    )
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
    session = shown(about, [effect])
    seen = seen_of(about, effect, session, clean)
    while seen < LEAST and effect.scales and effect.size < effect.largest:
        # What the tolerances can imitate makes the visibility grow faster than the size.
        effect = effect.times(min(max(rng.uniform(1.0, 2.0) * LEAST / seen, 1.2), 2.0))
        session = shown(about, [effect])
        seen = seen_of(about, effect, session, clean)
    return effect, session


def seen_of(about: Circumstances, effect: Drawn, session: Shown, clean: Shown) -> float:
    """Return the visibility of an effect: its session beside the same without it.

    Where it has a simpler special case, beside that, in the records under load alone: a gap that
    varies is else a gap, and without load its flanks rattle; where in its turn the input was locked
    for the sweep is not known.
    """
    rows = [row for row in effect.hidden.elements if row[0] in (el.ERROR_WAVE, el.LOAD_RIPPLE)]
    ratios = {el.ERROR_WAVE: 1.0, el.LOAD_RIPPLE: about.machine.ratio}
    orders = orders_seen(about.machine.ratio, [row[2] / ratios[int(row[0])] for row in rows])
    bend = session.torsion[0] - clean.torsion[0]
    if effect.simpler is not None:
        simpler = replace(effect, build=effect.simpler)
        clean, bend = shown(about, [simpler]), np.zeros_like(bend)
    changes = {
        place: features(about, place, session.records[place] - clean.records[place], orders)
        for place, condition in enumerate(about.conditions)
        if condition.role == "train" and (effect.simpler is None or condition.load != 0.0)
    }
    return visibility(about, changes, orders, bend)


def restricted(about: Circumstances, conditions: Sequence[int]) -> Circumstances:
    """Return a session with some of its records only."""
    rows = list(conditions)
    return replace(
        about,
        conditions=tuple(about.conditions[row] for row in rows),
        loads=about.loads[rows],
        starts=about.starts[rows],
        clocks=about.clocks[rows],
        unrepeated=about.unrepeated[rows],
        offsets=about.offsets[rows],
    )
