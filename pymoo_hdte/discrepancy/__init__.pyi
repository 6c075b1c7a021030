from pymoo_hdte.discrepancy._answers.revision_own_machine import RevisedValues, read_revised_values
from pymoo_hdte.discrepancy._evidence.own_machine import ModelEvidence
from pymoo_hdte.discrepancy._plan.limits import PlanLimits, read_limits
from pymoo_hdte.discrepancy._plan.plan import Plan, plan_tests
from pymoo_hdte.discrepancy._records.believed_model import read_drive_model
from pymoo_hdte.discrepancy._records.campaign import (
    BelievedDrive,
    Campaign,
    Rig,
    RunningRecord,
    TorsionRecord,
)
from pymoo_hdte.discrepancy._records.campaign_files import read_campaign, write_campaign
from pymoo_hdte.discrepancy._records.line_fit import OrderLines, order_lines
from pymoo_hdte.discrepancy._records.residual_spectrum import residual_spectrum
from pymoo_hdte.discrepancy._records.rig_files import MeasuredMechanism, read_rig
from pymoo_hdte.discrepancy._records.rig_model import MechanismModel, read_mechanism_model
from pymoo_hdte.discrepancy._report.folder import check_report_folder
from pymoo_hdte.discrepancy._verdicts.own_machine import Machine
from pymoo_hdte.discrepancy.analysis import (
    Analysis,
    DriveAnalysis,
    JointAnalysis,
    MachineAnalysis,
    MechanismAnalysis,
    analyse,
)

__all__ = [
    "Analysis",
    "BelievedDrive",
    "Campaign",
    "DriveAnalysis",
    "JointAnalysis",
    "Machine",
    "MachineAnalysis",
    "MeasuredMechanism",
    "MechanismAnalysis",
    "MechanismModel",
    "ModelEvidence",
    "OrderLines",
    "Plan",
    "PlanLimits",
    "RevisedValues",
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
    "read_revised_values",
    "read_rig",
    "residual_spectrum",
    "write_campaign",
]
