"""The revised model of a mechanism: fitted values with the effects that it has."""

from __future__ import annotations

from pymoo_hdte.discrepancy.mechanism.analysis import MechanismFinding
from pymoo_hdte.discrepancy.mechanism.models import MechanismModel
from pymoo_hdte.discrepancy.mechanism.proof import fitted_mechanism, laws_of

MODEL_FILE = "revised_model.toml"


def revised_mechanism(title: str, finding: MechanismFinding) -> MechanismModel:
    """Return the mechanism with fitted values, believed effects, and those that are named.

    Parameters
    ----------
    title : str
        Of the records.
    finding : MechanismFinding
    """
    accepted = finding.accepted
    return MechanismModel(
        f"{title}, revised",
        fitted_mechanism(finding.mechanism, accepted),
        (*finding.data.known, *laws_of(accepted.effects)),
        finding.cutoff,
    )
