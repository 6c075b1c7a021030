"""One call from measurements to a verdict, with location, validation, next test and report."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, cast, overload

from pymoo_hdte._one_thread import ONE_THREAD
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._answers.descriptive_model import DescriptiveModel, descriptive_model
from pymoo_hdte.discrepancy._answers.next_test_drive import Proposal, next_experiment
from pymoo_hdte.discrepancy._answers.next_test_mechanism import NextTest, next_test
from pymoo_hdte.discrepancy._answers.next_test_own_machine import Repetition, next_repetition
from pymoo_hdte.discrepancy._answers.revision_drive import revised_model
from pymoo_hdte.discrepancy._answers.revision_mechanism import revised_mechanism
from pymoo_hdte.discrepancy._answers.revision_own_machine import RevisedValues, revised_values
from pymoo_hdte.discrepancy._answers.where.balances import MechanismLocation, locate_in_mechanism
from pymoo_hdte.discrepancy._answers.where.location import Location, locate
from pymoo_hdte.discrepancy._answers.where.parts import PartLocation, locate_in_parts
from pymoo_hdte.discrepancy._evidence.force_balances.joint_halves import joint_of
from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.rig_files import MeasuredMechanism
from pymoo_hdte.discrepancy._records.rig_model import MechanismModel
from pymoo_hdte.discrepancy._report.folder import check_report_folder
from pymoo_hdte.discrepancy._report.words import caveats
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.discrepancy._verdicts.drive import examine_drive
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.discrepancy._verdicts.joint import JointFinding, examine_joint, revised_joint
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.discrepancy._verdicts.mechanism_simulation import Progress
from pymoo_hdte.discrepancy._verdicts.own_machine import (
    HeldOutErrors,
    Machine,
    MachineFinding,
    examine_machine,
    held_out_errors,
)
from pymoo_hdte.discrepancy._verdicts.validation_drive import Validation, validate_drive
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import (
    MechanismPredictionError,
    validate_mechanism,
)
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.effects.effect import Effect, register


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
@overload
def analyse(
    measured: Machine,
    effects: Sequence[Effect] = (),
    rules: Rules = RULES,
    progress: Progress | None = None,
) -> MachineAnalysis: ...
@ONE_THREAD
def analyse(
    measured: Campaign | MeasuredMechanism | Machine,
    effects: Sequence[Effect] = (),
    rules: Rules = RULES,
    progress: Progress | None = None,
) -> Analysis:
    """Return which effects the believed model lacks, by comparison with measurements.

    The believed model is fitted within its tolerances; if that is not enough, candidate effects are
    compared by the Bayesian information criterion (Schwarz, Annals of Statistics 6, 1978). A
    mechanism is judged by inverse dynamics, for which every coordinate has to be measured (of
    robots: Janot, Vandanjon and Gautier, IEEE Trans. Control Systems Technology 22, 2014).

    Parameters
    ----------
    measured : Campaign, MeasuredMechanism or Machine
        From `read_campaign`, of a harmonic drive; from `read_rig` or made in Python, of a
        mechanism; or of a kind of machine of your own: any object with ``records`` and
        ``evidence``, see `Machine`.
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
    Analysis
        A `DriveAnalysis`, `MechanismAnalysis`, `JointAnalysis` or `MachineAnalysis`.

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
    if not isinstance(measured, Campaign | MeasuredMechanism | Machine):
        allowed = "a Campaign, a MeasuredMechanism or an object with records and evidence"
        raise InvalidInput("measured", type(measured).__name__, allowed)
    for effect in effects:
        register(effect)
    if isinstance(measured, Campaign):
        return DriveAnalysis(examine_drive(measured, rules))
    if not isinstance(measured, MeasuredMechanism):
        return MachineAnalysis(measured, examine_machine(measured, rules))
    believed = measured.records, measured.cutoff, measured.effects
    joint = joint_of(measured.mechanism)
    if joint is not None:
        return JointAnalysis(measured, examine_joint(joint, *believed, rules, progress))
    return MechanismAnalysis(
        measured, examine_mechanism(measured.mechanism, *believed, rules, progress)
    )


class Analysis(ABC):
    """What `analyse` returns, whatever the kind of machine.

    Each result is computed when it is first used.

    Attributes
    ----------
    finding
        The evidence and the verdict on it.

    Examples
    --------
    >>> issubclass(DriveAnalysis, Analysis), issubclass(MachineAnalysis, Analysis)
    (True, True)
    """

    finding: Any

    @property
    def verdict(self) -> Verdict:
        """What is missing: ``status``, the ``chosen`` effects, and ``alternatives``."""
        return cast(Verdict, self.finding.verdict)

    @property
    def caveats(self) -> tuple[str, ...]:
        """The reasons of the verdict in words: what forbids to name its effects plainly."""
        return tuple(caveats(self.verdict))

    @ONE_THREAD
    def report(self, out: str | Path) -> dict[str, Any]:
        """Write ``report.html``, ``verdict.json`` and the revised model; return the verdict.

        Parameters
        ----------
        out : str or Path
            A folder that is new, empty, or an earlier report, which is replaced.

        Returns
        -------
        dict
            What ``verdict.json`` holds.

        Raises
        ------
        InvalidInput
            If the folder holds anything else.
        OSError
            If it cannot be written.
        """
        check_report_folder(out)
        return self._write(out)

    @abstractmethod
    def locate(self) -> Any:
        """Return where the model is wrong, in words as well."""

    @abstractmethod
    def validate(self) -> Any:
        """Return the errors on held-out records before and after the correction."""

    @abstractmethod
    def next_experiment(self) -> Any:
        """Return the test that best resolves what is still uncertain."""

    @abstractmethod
    def revised_model(self) -> Any:
        """Return the model with fitted values and named effects."""

    @abstractmethod
    def _write(self, out: str | Path) -> dict[str, Any]:
        """Write the report; return the verdict's document."""


class DriveAnalysis(Analysis):
    """The analysis of a campaign of a harmonic drive.

    Attributes
    ----------
    finding : DriveFinding
        Campaign, features of its records and verdict.

    Examples
    --------
    >>> analysis = analyse(read_campaign("campaign"))  # doctest: +SKIP
    >>> problem = RobustDTE(model=analysis.revised_model())  # doctest: +SKIP
    """

    finding: DriveFinding

    def __init__(self, finding: DriveFinding) -> None:
        self.finding = finding

    @property
    def campaign(self) -> Campaign:
        """The campaign with the believed model."""
        return self.finding.campaign

    @property
    def caveats(self) -> tuple[str, ...]:
        """The reasons of the verdict in words, lines of the static error by their orders."""
        return tuple(caveats(self.verdict, self.campaign.believed.error_orders))

    def locate(self) -> Location:
        """Return where the believed model is wrong: by record, channel and order, and in words."""
        return self._location

    def validate(self) -> Validation | None:
        """Return the errors on the held-out records before and after; None without such records."""
        return self._validation

    def next_experiment(self) -> Proposal:
        """Return the test that best resolves what is still uncertain."""
        return self._proposal

    def revised_model(self) -> DriveModel:
        """Return the drive with fitted values and named effects, e.g. for `RobustDTE`.

        Raises
        ------
        InvalidInput
            If no drive model can hold it: its ratio is not one of whole tooth numbers.
        """
        return revised_model(self.finding)

    def _write(self, out: str | Path) -> dict[str, Any]:
        # Plotting and optimisation are slow to import, and only a report needs them.
        from pymoo_hdte.discrepancy._report.write import write_report
        from pymoo_hdte.discrepancy._robust_optimum import optimum_shift

        answers = self.locate(), self.validate(), self.next_experiment()
        return write_report(self.finding, *answers, optimum_shift, out)

    @cached_property
    @ONE_THREAD
    def _location(self) -> Location:
        return locate(self.finding)

    @cached_property
    @ONE_THREAD
    def _validation(self) -> Validation | None:
        return validate_drive(self.finding)

    @cached_property
    @ONE_THREAD
    def _proposal(self) -> Proposal:
        return next_experiment(self.finding)


class MechanismAnalysis(Analysis):
    """The analysis of the records of a mechanism.

    Attributes
    ----------
    measured : MeasuredMechanism
        The mechanism as it is believed, and its records.
    finding : MechanismFinding
        Force balances of the records, verdict, and unexplained residual.

    Examples
    --------
    >>> analysis = analyse(read_rig("my_rig"))  # doctest: +SKIP
    >>> analysis.revised_model().effects  # doctest: +SKIP
    """

    finding: MechanismFinding

    def __init__(self, measured: MeasuredMechanism, finding: MechanismFinding) -> None:
        self.measured, self.finding = measured, finding

    def locate(self) -> MechanismLocation:
        """Return in which force balance the believed model is wrong, and by how much."""
        return locate_in_mechanism(self.finding)

    def validate(self) -> tuple[MechanismPredictionError, ...]:
        """Return the errors on the held-out records before and after; none without such records."""
        return self._errors

    def next_experiment(self) -> NextTest:
        """Return the repetition of a record that best resolves what is still uncertain."""
        return self._test

    def revised_model(self) -> MechanismModel:
        """Return the mechanism with fitted values, and the effects that it has."""
        return revised_mechanism(self.measured.title, self.finding)

    def descriptive_model(self) -> DescriptiveModel:
        """Return the model with all terms that predict the force balances better.

        There is one whatever the verdict. It describes, and does not diagnose. Of a joint with two
        encoders it is that of the balance of torques.
        """
        return self._descriptive

    def _write(self, out: str | Path) -> dict[str, Any]:
        # Plotting is slow to import, and only a report needs it.
        from pymoo_hdte.discrepancy._report.mechanism import write_mechanism_report

        answers = self.validate(), self.next_experiment()
        return write_mechanism_report(
            self.measured.title,
            self.finding,
            *answers,
            out,
            joint=self._beside,
            descriptive=self.descriptive_model(),
        )

    @property
    def _beside(self) -> JointFinding | None:
        """What a report tells besides."""
        return None

    @cached_property
    @ONE_THREAD
    def _errors(self) -> tuple[MechanismPredictionError, ...]:
        return validate_mechanism(self.finding)

    @cached_property
    @ONE_THREAD
    def _test(self) -> NextTest:
        return next_test(self.finding)

    @cached_property
    @ONE_THREAD
    def _descriptive(self) -> DescriptiveModel:
        return descriptive_model(self.measured.title, self.finding)


class JointAnalysis(MechanismAnalysis):
    """The analysis of a joint with two encoders; made by `analyse`.

    Its verdict, location, validation and next experiment are those of the balance of torques.

    Attributes
    ----------
    measured : MeasuredMechanism
        The joint as it is believed, and its records.
    joint : JointFinding
        With the verdict on the torsion beside that on the torques, and the ``status`` of both.

    Examples
    --------
    >>> analysis = analyse(read_rig("my_two_encoder_joint"))  # doctest: +SKIP
    >>> analysis.torsion.status  # doctest: +SKIP
    """

    def __init__(self, measured: MeasuredMechanism, joint: JointFinding) -> None:
        super().__init__(measured, joint.torque)
        self.joint = joint

    @property
    def torsion(self) -> Verdict:
        """What is missing in the torsion."""
        return self.joint.torsion.verdict

    def revised_model(self) -> MechanismModel:
        """Return the joint with fitted values, and the effects that it has."""
        return revised_joint(self.measured.title, self.joint)

    @property
    def _beside(self) -> JointFinding:
        return self.joint


class MachineAnalysis(Analysis):
    """The analysis of the records of a machine of your own kind.

    Attributes
    ----------
    machine : Machine
    finding : MachineFinding
        Evidence and verdict.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from pymoo_hdte.effects import unknown
    >>> class Pulls(ModelEvidence):
    ...     base = (unknown("stiffness", 90.0, 110.0, 100.0),)
    ...     def residuals(self, values, effects):
    ...         return [{"force": (values["stiffness"] - 98.0) * np.ones(8)}]
    ...     def sizes(self, fitted):
    ...         return {}
    >>> record = SimpleNamespace(name="pull", role="train")
    >>> machine = SimpleNamespace(records=[record], evidence=lambda records: Pulls())
    >>> analysis = analyse(machine)
    >>> analysis.verdict.status, round(analysis.revised_model().values["stiffness"], 1)
    ('adequate', 98.0)
    """

    finding: MachineFinding

    def __init__(self, machine: Machine, finding: MachineFinding) -> None:
        self.machine, self.finding = machine, finding

    def locate(self) -> PartLocation:
        """Return in which channels and records the model is wrong, and by how much."""
        return locate_in_parts(self.finding)

    def validate(self) -> HeldOutErrors | None:
        """Return the errors on the held-out records; None without such records."""
        return self._errors

    def next_experiment(self) -> Repetition:
        """Return the record whose repetition best separates what still competes."""
        return next_repetition(self.finding)

    def revised_model(self) -> RevisedValues:
        """Return the fitted values, and the effects that the machine has."""
        return revised_values(self.finding)

    def _write(self, out: str | Path) -> dict[str, Any]:
        from pymoo_hdte.discrepancy._report.own_machine import write_machine_report

        answers = self.locate(), self.validate(), self.next_experiment()
        return write_machine_report(self.finding, *answers, out)

    @cached_property
    def _errors(self) -> HeldOutErrors | None:
        return held_out_errors(self.finding)
