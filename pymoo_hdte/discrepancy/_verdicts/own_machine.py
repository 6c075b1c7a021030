"""From records of a machine of any kind to a verdict, with its errors on held-out records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np

from pymoo_hdte.checks import InvalidInput, one_of
from pymoo_hdte.discrepancy._evidence.own_errors import RecordErrors
from pymoo_hdte.discrepancy._evidence.own_machine import ModelEvidence
from pymoo_hdte.discrepancy._evidence.own_records import PredictedRecords
from pymoo_hdte.discrepancy._selection.decided import verdict_of
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.growth import Growth
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.discrepancy._verdicts.prediction_error import DEVIATIONS, PredictionError

_ROLES = ("train", "held_out")


@runtime_checkable
class Machine(Protocol):
    """A kind of machine of your own: its records, and how they are compared with its model.

    Where it has a ``title``, reports begin with it.

    Examples
    --------
    >>> class Oscillator:
    ...     records = ()
    ...     def evidence(self, records): ...
    >>> isinstance(Oscillator(), Machine)
    True
    """

    @property
    def records(self) -> Sequence[Any]:
        """All records, each with a ``name`` and a ``role``, ``"train"`` or ``"held_out"``."""
        ...

    def evidence(self, records: Sequence[Any]) -> ModelEvidence:
        """Return some of the records beside the predictions of the model.

        Parameters
        ----------
        records : sequence
            Of `records`, those of one role, or all.

        Returns
        -------
        ModelEvidence
        """
        ...


@dataclass(frozen=True, eq=False)
class MachineFinding:
    """The result of the analysis of the records of a machine.

    Attributes
    ----------
    title : str
    names, held_out_names : tuple of str
        Of the training records, and of those that were held out.
    data : PredictedRecords
        Training records; those held out are its ``held_out``.
    verdict : Verdict
    """

    title: str
    names: tuple[str, ...]
    held_out_names: tuple[str, ...]
    data: PredictedRecords
    verdict: Verdict


@dataclass(frozen=True)
class HeldOutErrors:
    """Errors of prediction on held-out records, before and after the correction.

    Attributes
    ----------
    parts, records : dict of str to PredictionError
        By channel, and by record.
    overall : PredictionError
    """

    parts: dict[str, PredictionError]
    records: dict[str, PredictionError]
    overall: PredictionError

    @property
    def worse(self) -> tuple[str, ...]:
        """What the correction made worse: channels and records by their name."""
        together = {**self.parts, **self.records}
        return tuple(name for name, error in together.items() if error.worse)

    def as_dict(self) -> dict[str, Any]:
        """Return them as plain values."""
        return {
            **self.overall.as_dict(),
            "channels": {name: error.as_dict() for name, error in self.parts.items()},
            "records": {name: error.as_dict() for name, error in self.records.items()},
        }


def examine_machine(machine: Machine, rules: Rules = RULES) -> MachineFinding:
    """Return the verdict on the records of a machine.

    Parameters
    ----------
    machine : Machine
    rules : Rules
        Thresholds of the verdict.

    Raises
    ------
    InvalidInput
        If no record is to be fitted, a role is unknown, or the evidence has no finite residuals.
    """
    roles = [one_of(f"role of {record.name}", record.role, _ROLES) for record in machine.records]
    train, held_out = (
        [record for record, role in zip(machine.records, roles, strict=True) if role == wanted]
        for wanted in _ROLES
    )
    if not train:
        raise InvalidInput("number of train records", 0, "at least 1")
    kept_out = PredictedRecords(machine.evidence(held_out), rules=rules) if held_out else None
    data = PredictedRecords(machine.evidence(train), kept_out, rules)
    base = fit(data)
    # Those kept out of fits count by their predictive density, with the same coefficients.
    every = PredictedRecords(machine.evidence(machine.records), rules=rules) if held_out else data
    of_every = fit(every, start=base.values)
    # A machine of one's own has no bench whose nuisances would be told apart from effects.
    candidates = [replace(effect, nuisance=False) for effect in data.model.candidates(base)]
    growth = Growth(every, of_every, candidates, RecordErrors(every, of_every))
    growth.grow()
    verdict = verdict_of(data, *growth.decide(), base)
    title = str(getattr(machine, "title", type(machine).__name__))
    names, held_out_names = (
        tuple(record.name for record in records) for records in (train, held_out)
    )
    return MachineFinding(title, names, held_out_names, data, verdict)


def held_out_errors(finding: MachineFinding) -> HeldOutErrors | None:
    """Return the errors on held-out records before and after; None without such records."""
    data, verdict = finding.data.held_out, finding.verdict
    if data is None:
        return None
    before, after = (data.left_by(fitted) for fitted in (verdict.base, verdict.accepted))
    misfit, (record, part) = verdict.accepted.misfit, data.layout
    among = len(data.parts) + len(finding.held_out_names)

    def error(rows: Any, count: int) -> PredictionError:
        size, corrected = (
            float(np.sqrt(np.mean(residuals[rows] ** 2))) for residuals in (before, after)
        )
        moved = (after - before)[rows]
        chance = 2.0 * float(np.linalg.norm(moved)) * misfit**0.5 / moved.size
        return PredictionError(size, corrected, 1.0, DEVIATIONS, verdict.rules, chance, count)

    return HeldOutErrors(
        {name: error(part == place, among) for place, name in enumerate(data.parts)},
        {name: error(record == place, among) for place, name in enumerate(finding.held_out_names)},
        error(slice(None), 1),
    )
