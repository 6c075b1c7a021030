from pymoo_hdte.virtual.hidden_forms import HiddenEffect, draw_effect
from pymoo_hdte.virtual.rig import TrueRig, draw_rig, run_campaign
from pymoo_hdte.virtual.runs import Condition

__all__ = [
    "Condition",
    "HiddenEffect",
    "TrueRig",
    "draw_effect",
    "draw_rig",
    "run_campaign",
]
