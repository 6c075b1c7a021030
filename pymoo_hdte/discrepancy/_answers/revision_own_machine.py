"""The revised model of a machine of any kind: its fitted values and effects, as a file too."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pymoo_hdte._io.toml import toml_text, toml_with_lines
from pymoo_hdte.discrepancy._verdicts.own_machine import MachineFinding
from pymoo_hdte.mechanism import LawAt
from pymoo_hdte.mechanism.effects import read_law, table_of

MODEL_FILE = "revised_model.toml"


@dataclass(frozen=True)
class RevisedValues:
    """What a revised model of a machine consists of.

    Attributes
    ----------
    title : str
    values : dict of str to float
        Of the base, fitted, SI.
    effects : tuple of LawAt
        Those that the model had, and those that are named.

    Examples
    --------
    >>> print(RevisedValues("ring-down tests", {"damping": 0.8}).to_toml())
    title = "ring-down tests"
    <BLANKLINE>
    [values]
    damping = 0.8
    <BLANKLINE>
    """

    title: str
    values: dict[str, float]
    effects: tuple[LawAt, ...] = ()

    def to_toml(self) -> str:
        """Return the text that `read_revised_values` reads back exactly."""
        top: dict[str, Any] = {"title": self.title, "values": self.values}
        rows = [table_of(effect) for effect in self.effects]
        return toml_text(top | ({"effects": rows} if rows else {}))


def read_revised_values(path: str | Path) -> RevisedValues:
    """Read the revised model of a machine of any kind.

    Parameters
    ----------
    path : str or Path
        ``revised_model.toml`` of a report.

    Raises
    ------
    InvalidInput
        With file and line, for a wrong or missing field or an effect that is not registered.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> from pathlib import Path
    >>> text = RevisedValues("ring-down tests", {"damping": 0.8}).to_toml()
    >>> _ = Path("revised_model.toml").write_text(text)
    >>> read_revised_values("revised_model.toml").values
    {'damping': 0.8}
    """
    with toml_with_lines(Path(path)) as top:
        title, table = top.text("title"), top.table("values")
        values = {name: table.number(name) for name in table.names()}
        rows = top.tables("effects") if top.has("effects") else []
        effects = tuple(read_law(row, f"effects[{index}]") for index, row in enumerate(rows))
        top.finish()
    return RevisedValues(title, values, effects)


def revised_values(finding: MachineFinding) -> RevisedValues:
    """Return the fitted values, and the effects that the machine has with those named."""
    accepted = finding.verdict.accepted
    names = [parameter.name for parameter in accepted.parameters[: accepted.n_base]]
    values = dict(zip(names, accepted.values[: accepted.n_base].tolist(), strict=True))
    effects = (*finding.data.model.known, *accepted.effects)
    return RevisedValues(f"{finding.title}, revised", values, effects)
