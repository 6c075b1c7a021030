"""A first file for a folder of logs: written whole or not at all, and never over another."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pymoo_hdte._io.whole_file import write_new
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._records.campaign_keys import CAMPAIGN_FILE
from pymoo_hdte.discrepancy._records.drafts.campaign_draft import campaign_text, is_bench
from pymoo_hdte.discrepancy._records.drafts.column_roles import Roles, find_roles
from pymoo_hdte.discrepancy._records.drafts.log_folder import LogFolder, read_log_folder
from pymoo_hdte.discrepancy._records.drafts.rig_draft import EDIT, rig_text
from pymoo_hdte.discrepancy._records.rig_files import RIG_FILE


@dataclass(frozen=True, eq=False)
class Draft:
    """A file that describes the logs of a folder, as far as they tell.

    Attributes
    ----------
    file : str
        `RIG_FILE` or `CAMPAIGN_FILE`.
    text : str
        TOML with comments.
    logs : LogFolder
    roles : Roles
    """

    file: str
    text: str
    logs: LogFolder
    roles: Roles

    @property
    def document(self) -> dict[str, Any]:
        """What was guessed, for a terminal and for scripts."""
        roles = self.roles
        guesses = [*([roles.time] if roles.time else []), *roles.coordinates, *roles.forces]
        path = self.logs.folder / self.file
        edits = [
            number
            for number, line in enumerate(self.text.splitlines(), 1)
            if EDIT in line and number > 2
        ]
        records = self.text.count("[[record")
        said = "1 record" if records == 1 else f"{records} records"
        sentences = [f"Wrote {path}, with {said} of the files of the folder."]
        sentences += [
            f"{guess.sure}: {guess.column!r} is the {guess.quantity}, in {guess.unit}"
            f"{'' if guess.unit_sure else ' (assumed)'}"
            for guess in guesses
        ]
        if edits:
            lines = ", ".join(map(str, edits))
            sentences.append(f"Correct or confirm what is marked {EDIT}: line {lines}.")
        sentences.append(
            f"Then: pymoo-hdte discrepancy {self.logs.folder} --out {self.logs.folder / 'report'}"
        )
        columns = [
            {
                "column": guess.column,
                "quantity": guess.quantity,
                "unit": guess.unit,
                "sure": guess.sure,
                "unit_known": guess.unit_sure,
                "why": list(guess.why),
            }
            for guess in guesses
        ]
        return {"file": str(path), "columns": columns, "edits": edits, "sentences": sentences}


def draft_of(folder: Path) -> Draft:
    """Return a file that describes the logs of a folder.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    InvalidInput
        If it is no folder, has no table that can be read, or none with a column that moves.
    OSError
        If it cannot be read.
    """
    if not folder.is_dir():
        raise InvalidInput("FOLDER", str(folder), "a folder with logs")
    logs = read_log_folder(folder)
    roles = find_roles(logs.log)
    if not roles.coordinates:
        titles = [logs.log.label(name) for name in logs.log.tables[0].columns]
        allowed = "columns among which a position or a speed varies"
        raise InvalidInput(f"columns of {logs.tables[0].path.name}", titles, allowed)
    if is_bench(logs, roles):
        return Draft(CAMPAIGN_FILE, campaign_text(logs, roles), logs, roles)
    moving = logs.moving(roles.coordinates[-1].column)
    if moving is not logs:
        logs, roles = moving, find_roles(moving.log)
    return Draft(RIG_FILE, rig_text(logs, roles), logs, roles)


def write_draft(folder: Path) -> Draft:
    """Write a file that describes the logs of a folder, in one step.

    Parameters
    ----------
    folder : Path
        Without `RIG_FILE` and `CAMPAIGN_FILE`.

    Raises
    ------
    InvalidInput
        As `draft_of`, or if there is such a file already.
    OSError
        If it cannot be written.
    """
    for file in (RIG_FILE, CAMPAIGN_FILE):
        _refuse(folder / file)
    draft = draft_of(folder)
    path = folder / draft.file
    try:
        write_new(path, draft.text.encode())
    except FileExistsError:
        _refuse(path)
        raise
    return draft


def _refuse(path: Path) -> None:
    if path.exists() or path.is_symlink():
        raise InvalidInput("file to be written", str(path), "none that is there already")
