from pymoo_hdte.mechanism.believed import BelievedValue
from pymoo_hdte.mechanism.error_line import ErrorLine
from pymoo_hdte.mechanism.gear import Gear
from pymoo_hdte.mechanism.mechanism import Mechanism
from pymoo_hdte.mechanism.parts import Input, LawAt, Loop, Port
from pymoo_hdte.mechanism.records import Record
from pymoo_hdte.mechanism.simulation import SimulatedCourse, simulate_mechanism

__all__ = [
    "BelievedValue",
    "ErrorLine",
    "Gear",
    "Input",
    "LawAt",
    "Loop",
    "Mechanism",
    "Port",
    "Record",
    "SimulatedCourse",
    "simulate_mechanism",
]
