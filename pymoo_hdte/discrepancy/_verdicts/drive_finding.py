"""What is known of a campaign once its verdict is given."""

from __future__ import annotations

from dataclasses import dataclass, field

from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.cleaning.findings import RowFindings
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.verdict import Verdict


@dataclass(frozen=True, eq=False)
class DriveFinding:
    """A campaign and the result of its analysis.

    Attributes
    ----------
    campaign : Campaign
        Without the faulty rows, and with the noise that was found.
    data : Data
        Features of the training records.
    verdict : Verdict
    unexpected : tuple of float
        Orders beyond the expected ones with significant lines.
    rows : RowFindings
        Faulty rows, and the noise of the records beside the stated one.
    """

    campaign: Campaign
    data: Data
    verdict: Verdict
    unexpected: tuple[float, ...]
    rows: RowFindings = field(default_factory=RowFindings)

    @property
    def nuisances(self) -> list[tuple[Candidate, slice]]:
        """Nuisances of the bench that the accepted fit shows, with the places of their values."""
        return self.data.bench.shown(self.verdict.accepted, self.verdict.rules)

    @property
    def held_out(self) -> Data | None:
        """Features of the held-out records: see `Data.held_out`."""
        return self.data.held_out
