"""What the analysis of a mechanism's records can tell, and that of a joint with two encoders."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

from pymoo_hdte.discrepancy.engine.verdict import Verdict
from pymoo_hdte.discrepancy.joint.analysis import JointFinding, revised_joint
from pymoo_hdte.discrepancy.mechanism.files import MeasuredMechanism
from pymoo_hdte.discrepancy.mechanism.finding import MechanismFinding
from pymoo_hdte.discrepancy.mechanism.location import MechanismLocation, locate_in_mechanism
from pymoo_hdte.discrepancy.mechanism.models import MechanismModel
from pymoo_hdte.discrepancy.mechanism.next_tests import NextTest, next_test
from pymoo_hdte.discrepancy.mechanism.proof import MeasuredGap, prove_measured
from pymoo_hdte.discrepancy.mechanism.revision import revised_mechanism
from pymoo_hdte.discrepancy.report.folder import check_report_folder
from pymoo_hdte.one_thread import ONE_THREAD


class MechanismAnalysis:
    """The analysis of the records of a mechanism; made by `analyse`.

    Each result is computed when it is first used.

    Attributes
    ----------
    measured : MeasuredMechanism
        The mechanism as it is believed, and its records.
    finding : MechanismFinding
        Force balances of the records, verdict, and unexplained residual.

    Examples
    --------
    >>> analysis = analyse(read_rig("my_rig"))  # doctest: +SKIP
    >>> analysis.verdict.status, analysis.report("report")  # doctest: +SKIP
    """

    def __init__(self, measured: MeasuredMechanism, finding: MechanismFinding) -> None:
        self.measured, self.finding = measured, finding

    @property
    def verdict(self) -> Verdict:
        """What is missing: ``status``, the ``chosen`` effects, and ``alternatives``."""
        return self.finding.verdict

    def locate(self) -> MechanismLocation:
        """Return in which force balance the believed model is wrong, and by how much."""
        return locate_in_mechanism(self.finding)

    def prove(self) -> tuple[MeasuredGap, ...]:
        """Return the gaps on the held-out records before and after; none without such records."""
        return self._gaps

    def next_experiment(self) -> NextTest:
        """Return the repetition of a record that best resolves what is still uncertain."""
        return self._test

    def revised_model(self) -> MechanismModel:
        """Return the mechanism with fitted values, and the effects that it has."""
        return revised_mechanism(self.measured.title, self.finding)

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
        # Plotting is slow to import, and only a report needs it.
        from pymoo_hdte.discrepancy.report.mechanism import write_mechanism_report

        check_report_folder(out)
        found = self.prove(), self.next_experiment()
        return write_mechanism_report(
            self.measured.title, self.finding, *found, out, joint=self._beside
        )

    @property
    def _beside(self) -> JointFinding | None:
        """What a report tells besides."""
        return None

    @cached_property
    @ONE_THREAD
    def _gaps(self) -> tuple[MeasuredGap, ...]:
        return prove_measured(self.finding)

    @cached_property
    @ONE_THREAD
    def _test(self) -> NextTest:
        return next_test(self.finding)


class JointAnalysis(MechanismAnalysis):
    """The analysis of a joint with two encoders; made by `analyse`.

    Its verdict, location, proof and next experiment are those of the balance of torques.

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
