"""One call from measurements to a verdict, with location, validation, next test and report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy.campaign.campaign import Campaign
from pymoo_hdte.discrepancy.drive.analysis import examine_drive
from pymoo_hdte.discrepancy.drive_analysis import DriveAnalysis
from pymoo_hdte.discrepancy.engine.rules import RULES, Rules
from pymoo_hdte.discrepancy.joint.analysis import examine_joint
from pymoo_hdte.discrepancy.joint.halves import joint_of
from pymoo_hdte.discrepancy.mechanism.analysis import examine_mechanism
from pymoo_hdte.discrepancy.mechanism.files import MeasuredMechanism
from pymoo_hdte.discrepancy.mechanism.held_out import Progress
from pymoo_hdte.discrepancy.mechanism_analysis import JointAnalysis, MechanismAnalysis
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.one_thread import ONE_THREAD


@overload
def analyse(
    measured: Campaign,
    effects: Sequence[Effect] = (),
    rules: Rules = RULES,
    progress: Progress | None = None,
) -> DriveAnalysis: ...
@overload
def analyse(
    measured: MeasuredMechanism,
    effects: Sequence[Effect] = (),
    rules: Rules = RULES,
    progress: Progress | None = None,
) -> MechanismAnalysis: ...
@ONE_THREAD
def analyse(
    measured: Campaign | MeasuredMechanism,
    effects: Sequence[Effect] = (),
    rules: Rules = RULES,
    progress: Progress | None = None,
) -> DriveAnalysis | MechanismAnalysis:
    """Return which effects the believed model lacks, by comparison with measurements.

    The believed model is fitted within its tolerances; if that is not enough, candidate effects are
    compared by the Bayesian information criterion (Schwarz, Annals of Statistics 6, 1978). A
    mechanism is judged by inverse dynamics, for which every coordinate has to be measured (of
    robots: Janot, Vandanjon and Gautier, IEEE Trans. Control Systems Technology 22, 2014).

    Parameters
    ----------
    measured : Campaign or MeasuredMechanism
        From `read_campaign`, of a harmonic drive; from `read_rig` or made in Python, of any other
        machine.
    effects : sequence of Effect, optional
        Effects of your own that may be missing, beside those of the library. They are registered
        if they are not yet, so that reports and model files know them.
    rules : Rules, optional
        Thresholds of the verdict.
    progress : callable, optional
        Of a mechanism, is told how many windows of the held-out records have been simulated, and
        how many there are.

    Returns
    -------
    DriveAnalysis or MechanismAnalysis

    Raises
    ------
    InvalidInput
        If there are too few records to fit, or they cannot determine the believed model: for a
        drive, a line of its static error; for a mechanism, a channel, motion, or the scale. For an
        effect with the name of another one.

    Examples
    --------
    >>> analysis = analyse(read_campaign("campaign"))  # doctest: +SKIP
    >>> analysis.verdict.status  # doctest: +SKIP
    'named'
    >>> [effect.label for effect in analysis.verdict.chosen.candidates]  # doctest: +SKIP
    ['torque_ripple:input@2']
    >>> problem = RobustDTE(model=analysis.revised_model())  # doctest: +SKIP
    """
    if not isinstance(measured, Campaign | MeasuredMechanism):
        raise InvalidInput("measured", type(measured).__name__, "a Campaign or a MeasuredMechanism")
    for effect in effects:
        register(effect)
    if isinstance(measured, Campaign):
        return DriveAnalysis(examine_drive(measured, rules))
    believed = measured.records, measured.cutoff, measured.effects
    joint = joint_of(measured.mechanism)
    if joint is not None:
        return JointAnalysis(measured, examine_joint(joint, *believed, rules, progress))
    return MechanismAnalysis(
        measured, examine_mechanism(measured.mechanism, *believed, rules, progress)
    )
