"""The revised model of a mechanism: fitted values with believed and named effects."""

from __future__ import annotations

from pymoo_hdte.discrepancy._evidence.force_balances.unexplained import fitted_values
from pymoo_hdte.discrepancy._records.rig_model import MechanismModel
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.discrepancy._verdicts.mechanism_simulation import laws_of

MODEL_FILE = "revised_model.toml"


def revised_mechanism(title: str, finding: MechanismFinding) -> MechanismModel:
    """Return the mechanism with fitted values, believed effects, and those that are named.

    Its values keep the believed relative tolerances: the same records have the same fit.

    Parameters
    ----------
    title : str
        Of the records.
    finding : MechanismFinding
    """
    accepted = finding.accepted
    values = fitted_values(finding.mechanism, accepted)
    return MechanismModel(
        f"{title}, revised",
        finding.mechanism.with_values(values, exactly=False),
        (*finding.believed, *laws_of(accepted.effects), *finding.ripples.laws),
        finding.cutoff,
    )
