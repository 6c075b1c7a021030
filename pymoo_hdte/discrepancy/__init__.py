"""Where simulation and measurement disagree: campaigns, their records and order lines."""

from pymoo_hdte.discrepancy.campaign.campaign import (
    Believed,
    Campaign,
    Rig,
    RunningRecord,
    TorsionRecord,
)
from pymoo_hdte.discrepancy.campaign.files import read_campaign, write_campaign
from pymoo_hdte.discrepancy.campaign.order_lines import OrderLines, order_lines, residual_spectrum

__all__ = [
    "Believed",
    "Campaign",
    "OrderLines",
    "Rig",
    "RunningRecord",
    "TorsionRecord",
    "order_lines",
    "read_campaign",
    "residual_spectrum",
    "write_campaign",
]
