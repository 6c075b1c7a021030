"""Virtual campaigns that are simulated and analysed in a second or two."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from kept_results import kept
from virtual_rig_cases import BELIEVED, RIG, effect

from pymoo_hdte.cli import __main__ as cli
from pymoo_hdte.discrepancy import Campaign, DriveAnalysis, analyse, write_campaign
from pymoo_hdte.virtual.rig import draw_rig, run_campaign
from pymoo_hdte.virtual.runs import Condition

CONDITIONS = tuple(
    Condition(speed, load, 500.0 if speed < 1000.0 else 1000.0, 2 if speed < 1000.0 else 1, role)
    for speed, load, role in (
        (600.0, 0.0, "train"),
        (600.0, 20.0, "train"),
        (1000.0, 10.0, "train"),
        (1000.0, 40.0, "train"),
        (1400.0, 20.0, "train"),
        (2000.0, 0.0, "train"),
        (2000.0, 40.0, "train"),
        (600.0, 40.0, "held_out"),
        (1400.0, 40.0, "held_out"),
        (2000.0, 10.0, "held_out"),
    )
)
RIPPLING = (5, effect("input", ripple=0.02, ripple_order=3.0))
"""Seed and effect of a quick campaign on a rig whose motor torque has a ripple."""


@kept
def quick_campaign(seed: int, *effects) -> Campaign:
    """Return a campaign on a drawn rig, with planted effects or clean."""
    rng = np.random.default_rng(seed)
    rig = draw_rig(BELIEVED, effects, rng)
    return run_campaign(rig, BELIEVED, RIG, rng, CONDITIONS)


@kept
def quick_analysis(seed: int, *effects) -> DriveAnalysis:
    """Return what is found in `quick_campaign`."""
    return analyse(quick_campaign(seed, *effects))


def write_ripple_campaign(folder: Path) -> None:
    """Write a campaign on a rig whose motor torque has a ripple."""
    ripple = effect("input", ripple=0.015, ripple_order=6.0, ripple_phase=0.7)
    write_campaign(quick_campaign(4, ripple), folder)


@kept
def ripple_report() -> dict[str, bytes]:
    """Return the files of the command's report on the campaign with a ripple, by name."""
    with TemporaryDirectory() as name:
        top = Path(name)
        write_ripple_campaign(top / "rig")
        assert (
            cli.main(["discrepancy", str(top / "rig"), "--out", str(top / "out"), "--quiet"]) == 0
        )
        return {path.name: path.read_bytes() for path in (top / "out").iterdir()}
