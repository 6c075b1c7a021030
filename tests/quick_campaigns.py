"""Virtual campaigns that are simulated and analysed in a second or two."""

import numpy as np
from virtual_rig_cases import BELIEVED, RIG

from pymoo_hdte.discrepancy import Campaign
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


def quick_campaign(seed: int, *effects) -> Campaign:
    """Return a campaign on a drawn rig, with planted effects or clean."""
    rng = np.random.default_rng(seed)
    rig = draw_rig(BELIEVED, effects, rng)
    return run_campaign(rig, BELIEVED, RIG, rng, CONDITIONS)
