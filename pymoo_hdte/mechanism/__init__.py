"""Lumped mechanisms of any kind: what they are, how they move, and what force balances miss."""

from pymoo_hdte.mechanism.mechanism import (
    BelievedValue,
    ErrorLine,
    Input,
    LawAt,
    Loop,
    Mechanism,
    Port,
)
from pymoo_hdte.mechanism.records import Record

__all__ = [
    "BelievedValue",
    "ErrorLine",
    "Input",
    "LawAt",
    "Loop",
    "Mechanism",
    "Port",
    "Record",
]
