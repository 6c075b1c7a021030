"""The campaign of a case and its twin, as the workflow reads them from a folder."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.studies.blind.cases import Case
from experiments.studies.blind.rig.campaign import Shown, made_visible, shown
from experiments.studies.blind.rig.files import write_campaign_folder
from experiments.studies.blind.rig.hidden import Drawn
from experiments.studies.blind.rig.machine import Matrix
from experiments.studies.blind.rig.session import Circumstances, draw_circumstances
from experiments.studies.blind.stresses import stressed, true_noise, with_faults
from pymoo_hdte.discrepancy import Campaign, read_campaign


@dataclass(frozen=True, eq=False)
class Hiding:
    """The session of a case.

    Attributes
    ----------
    case : Case
    about : Circumstances
        Under the stress of the case.
    effects : tuple of Drawn
        At the sizes that are hidden.
    session, twin : Shown
        What sensors without noise show with the effects and without them.
    """

    case: Case
    about: Circumstances
    effects: tuple[Drawn, ...]
    session: Shown
    twin: Shown

    @property
    def quantities(self) -> Mapping[tuple[str, str], float]:
        """True values by name of the effect and of the unknown, SI."""
        return {
            (one.name, name): value
            for one in self.effects
            for name, value in one.hidden.quantities.items()
        }


def hiding(case: Case) -> Hiding:
    """Run the session of a case: each effect at a size at which it alone is visible."""
    about = draw_circumstances(case.generator("session"))
    about = stressed(about, case.stress, case.generator("stress"))
    twin = shown(about, ())
    rng, effects, session = case.generator("sizes"), [], twin
    for drawn in case.drawn:
        effect, session = made_visible(about, drawn, twin, rng)
        effects.append(effect)
    if len(effects) > 1:
        session = shown(about, effects)
    return Hiding(case, about, tuple(effects), session, twin)


def rows_of(hidden: Hiding, session: Shown) -> tuple[list[Matrix], Matrix]:
    """Return rows (4, n) of the records and (2, k) of the sweep, with the noise of the case."""
    about, case = hidden.about, hidden.case
    sensors = true_noise(about.sensors, case.stress, case.generator("misstated"))
    rng = case.generator("noise")
    rows = [
        sensors.sampled(one, about.machine.ratio, condition.averaged, rng)
        for one, condition in zip(session.records, about.conditions, strict=True)
    ]
    noise = np.array([sensors.torsion_noise, sensors.output_noise])
    torsion = session.torsion + noise[:, None] * rng.standard_normal(session.torsion.shape)
    return with_faults(rows, case.stress, case.generator("faults")), torsion


def campaign_of(hidden: Hiding, session: Shown) -> Campaign:
    """Write the campaign of a session into a folder of its own, and read it."""
    rows, torsion = rows_of(hidden, session)
    with tempfile.TemporaryDirectory() as folder:
        title = f"blind case {hidden.case.kind} {hidden.case.number}"
        write_campaign_folder(Path(folder), title, hidden.about, rows, torsion)
        return read_campaign(folder)
