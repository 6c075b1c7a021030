"""What the analysis of a harmonic drive's campaign can tell: verdict, proof, next test, report."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

from pymoo_hdte.discrepancy.campaign.campaign import Campaign
from pymoo_hdte.discrepancy.drive.finding import DriveFinding
from pymoo_hdte.discrepancy.drive.misfit.location import Location, locate
from pymoo_hdte.discrepancy.drive.next_test import Proposal, next_experiment
from pymoo_hdte.discrepancy.drive.proof import Proof, prove
from pymoo_hdte.discrepancy.drive.revision import revised_model
from pymoo_hdte.discrepancy.engine.verdict import Verdict
from pymoo_hdte.discrepancy.report.folder import check_report_folder
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.one_thread import ONE_THREAD


class DriveAnalysis:
    """The analysis of a campaign of a harmonic drive; made by `analyse`.

    Each result is computed when it is first used.

    Attributes
    ----------
    finding : DriveFinding
        Campaign, features of its records and verdict.

    Examples
    --------
    >>> analysis = analyse(read_campaign("campaign"))  # doctest: +SKIP
    >>> analysis.verdict.status, analysis.locate().sentence  # doctest: +SKIP
    >>> analysis.report("report")  # doctest: +SKIP
    """

    def __init__(self, finding: DriveFinding) -> None:
        self.finding = finding

    @property
    def campaign(self) -> Campaign:
        """The campaign with the believed model."""
        return self.finding.campaign

    @property
    def verdict(self) -> Verdict:
        """What is missing: ``status``, the ``chosen`` effects, and ``alternatives``."""
        return self.finding.verdict

    def locate(self) -> Location:
        """Return where the believed model is wrong: by record, channel and order, and in words."""
        return self._location

    def prove(self) -> Proof | None:
        """Return the gap on the held-out records before and after; None without such records."""
        return self._proof

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
        # Plotting and optimisation are slow to import, and only a report needs them.
        from pymoo_hdte.discrepancy.report.write import write_report
        from pymoo_hdte.discrepancy.robust_optimum import optimum_shift

        check_report_folder(out)
        found = self.locate(), self.prove(), self.next_experiment()
        return write_report(self.finding, *found, optimum_shift, out)

    @cached_property
    @ONE_THREAD
    def _location(self) -> Location:
        return locate(self.finding)

    @cached_property
    @ONE_THREAD
    def _proof(self) -> Proof | None:
        return prove(self.finding)

    @cached_property
    @ONE_THREAD
    def _proposal(self) -> Proposal:
        return next_experiment(self.finding)
