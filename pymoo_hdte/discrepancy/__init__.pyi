from pymoo_hdte.discrepancy.analysis import analyse
from pymoo_hdte.discrepancy.campaign.believed_model import read_drive_model
from pymoo_hdte.discrepancy.campaign.campaign import (
    BelievedDrive,
    Campaign,
    Rig,
    RunningRecord,
    TorsionRecord,
)
from pymoo_hdte.discrepancy.campaign.files import read_campaign, write_campaign
from pymoo_hdte.discrepancy.campaign.line_fit import OrderLines, order_lines
from pymoo_hdte.discrepancy.campaign.residual_spectrum import residual_spectrum
from pymoo_hdte.discrepancy.drive.plan.limits import PlanLimits, read_limits
from pymoo_hdte.discrepancy.drive.plan.plan import Plan, plan_tests
from pymoo_hdte.discrepancy.drive_analysis import DriveAnalysis
from pymoo_hdte.discrepancy.mechanism.files import MeasuredMechanism, read_rig
from pymoo_hdte.discrepancy.mechanism.models import MechanismModel, read_mechanism_model
from pymoo_hdte.discrepancy.mechanism_analysis import JointAnalysis, MechanismAnalysis
from pymoo_hdte.discrepancy.report.folder import check_report_folder

__all__ = [
    "BelievedDrive",
    "Campaign",
    "DriveAnalysis",
    "JointAnalysis",
    "MeasuredMechanism",
    "MechanismAnalysis",
    "MechanismModel",
    "OrderLines",
    "Plan",
    "PlanLimits",
    "Rig",
    "RunningRecord",
    "TorsionRecord",
    "analyse",
    "check_report_folder",
    "order_lines",
    "plan_tests",
    "read_campaign",
    "read_drive_model",
    "read_limits",
    "read_mechanism_model",
    "read_rig",
    "residual_spectrum",
    "write_campaign",
]
