"""Virtual campaigns and a design study that are made and analysed in a few seconds."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from kept_results import files_in, kept
from virtual_rig_cases import BELIEVED, RIG, effect

from experiments.studies.virtual_rig.own_effects import with_effects
from experiments.studies.virtual_rig.rig import draw_rig, run_campaign
from experiments.studies.virtual_rig.runs import Condition
from pymoo_hdte.cli import optimum_report
from pymoo_hdte.cli.design_study import DesignStudy, Settings, run_design_study
from pymoo_hdte.discrepancy import (
    Campaign,
    DriveAnalysis,
    analyse,
    read_campaign,
    write_campaign,
)
from pymoo_hdte.drive import preset

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


@kept
def quick_campaign(seed: int, *effects) -> Campaign:
    """Return a campaign on a drawn rig, with planted effects or clean."""
    rng = np.random.default_rng(seed)
    rig = draw_rig(BELIEVED, effects, rng)
    return run_campaign(rig, BELIEVED, RIG, rng, CONDITIONS)


def campaign_with(*effects) -> Campaign:
    """Return a campaign on a clean rig to whose drive effects of the library are added."""
    rng = np.random.default_rng(5)
    rig = draw_rig(BELIEVED, (), rng)
    return with_effects(run_campaign(rig, BELIEVED, RIG, rng, CONDITIONS), rig, effects)


@kept
def quick_analysis(seed: int, *effects) -> DriveAnalysis:
    """Return what is found in `quick_campaign`."""
    return analyse(quick_campaign(seed, *effects))


@kept
def ripple_campaign() -> Campaign:
    """Return a campaign on a rig whose motor torque has a ripple, as its files have it."""
    ripple = effect("input", ripple=0.02, ripple_order=3.0)
    with TemporaryDirectory() as top:
        write_campaign(quick_campaign(5, ripple), Path(top) / "rig")
        return read_campaign(Path(top) / "rig")


@kept
def ripple_analysis_and_report() -> tuple[DriveAnalysis, dict[str, bytes]]:
    """Return what is found in `ripple_campaign`, and the files of its report by name."""
    analysis = analyse(ripple_campaign())
    with TemporaryDirectory() as top:
        analysis.report(Path(top) / "report")
        files = files_in(Path(top) / "report")
    return analysis, files


BOX = 0.03
"""Half-width of a box in which the front of the drive is found at once."""
SETTINGS = Settings(0.05, BOX, None, 60, 1)


@kept
def study_and_report() -> tuple[DesignStudy, dict[str, bytes]]:
    """Return a study of the preset drive, and the files of its report by name."""
    study = run_design_study(preset("calibrated"), "balanced", SETTINGS)
    with TemporaryDirectory() as top:
        optimum_report.write_optimum_report(study, (), Path(top) / "report")
        files = files_in(Path(top) / "report")
    return study, files
