"""Results on disk: JSON for the report, CSV and PNG for other uses."""

from __future__ import annotations

import io
import json
import math
import re
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte._io.whole_file import write_whole
from pymoo_hdte._runner.provenance import environment, fingerprint
from pymoo_hdte._runner.result import Column, Finding, Picture, Result, Table, significant

RESULT = "result.json"
TIMES = "times"
"""Folder of wall times: the only results that differ from run to run."""
_SENTENCES = re.compile(r"(?<=[^.]\.)(?<!\bNo\.)(?<!\bFig\.) (?=[A-Z0-9])")
_INFINITE = {significant(value, 1): value for value in (math.inf, -math.inf)}


@dataclass(frozen=True)
class StoredPicture:
    """A figure of a stored result: the name of its PNG file and its caption."""

    name: str
    caption: str
    leading: bool = False


@dataclass(frozen=True)
class StoredResult:
    """A result read back, with the versions and the fingerprint of the source that made it."""

    name: str
    title: str
    command: str
    question: str
    answer: str
    paragraphs: tuple[str, ...]
    models: dict[str, str]
    tables: tuple[Table, ...]
    pictures: tuple[StoredPicture, ...]
    notes: tuple[str, ...]
    first_page: dict[str, str]
    shown_first: str
    versions: dict[str, str]
    made_by: str

    @property
    def first_sentence(self) -> str:
        """The first sentence of the answer, which stands on the card."""
        return _SENTENCES.split(self.answer, maxsplit=1)[0]

    @property
    def further_sentences(self) -> str:
        """What the answer says beyond its first sentence."""
        return self.answer[len(self.first_sentence) :].strip()


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file as `write_whole` does, in a folder that is made if need be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, content)


def save(out: Path, name: str, result: Result, made_by: str | None = None) -> None:
    """Store ``result`` of the experiment ``name`` under ``out``.

    Tables go to CSV and figures to PNG in ``out/name``; tables of wall times to ``out/times/name``.
    ``result.json`` is written last, so it never names a file that is missing. ``made_by`` is the
    fingerprint of the source, by default that of the package.
    """
    timed = [table for table in result.tables if table.wall_times]
    steady = [table for table in result.tables if not table.wall_times]
    for folder, tables in ((out / name, steady), (out / TIMES / name, timed)):
        for table in tables:
            heading = [column.heading for column in table.columns]
            content = csv_text(heading, table.rows).encode()
            write_atomically(folder / f"{table.name}.csv", content)
    for picture in result.pictures:
        write_atomically(out / name / f"{picture.name}.png", png_bytes(picture))
    described = {
        "title": result.title,
        "command": result.command,
        "question": result.question,
        "answer": result.answer,
        "paragraphs": result.paragraphs,
        "models": dict(result.models),
        "tables": [asdict(table) for table in steady],
        "pictures": [
            {"name": p.name, "caption": p.caption, "leading": p.leading} for p in result.pictures
        ],
        "notes": result.notes,
        "first_page": dict(result.first_page),
        "shown_first": result.shown_first,
        "versions": environment(),
        "made_by": made_by or fingerprint(),
    }
    _write_json(out / TIMES / name / RESULT, [asdict(table) for table in timed])
    _write_json(out / name / RESULT, described)


def load(out: Path, name: str) -> StoredResult | None:
    """Read the stored result of the experiment ``name``.

    None if there is none, or one in the form of another version of this software.
    """
    described_in = out / name / RESULT
    if not described_in.is_file():
        return None
    described = json.loads(described_in.read_text())
    timed_in = out / TIMES / name / RESULT
    timed = json.loads(timed_in.read_text()) if timed_in.is_file() else []
    described |= {
        "paragraphs": tuple(described["paragraphs"]),
        "tables": tuple(_table(entry) for entry in described["tables"] + timed),
        "pictures": tuple(StoredPicture(**picture) for picture in described["pictures"]),
        "notes": tuple(described["notes"]),
    }
    try:
        return StoredResult(name=name, **described)
    except TypeError:
        # Another version of this software wrote it, with other fields.
        return None


def png_bytes(picture: Picture) -> bytes:
    """Draw the figure; the same figure gives the same bytes."""
    buffer = io.BytesIO()
    # Without this, the file would name the version of matplotlib that drew it.
    picture.figure.savefig(buffer, format="png", dpi=140, metadata={"Software": None})
    return buffer.getvalue()


def _write_json(path: Path, content: Any) -> None:
    text = json.dumps(_writable(content), indent=1, ensure_ascii=False, allow_nan=False)
    write_atomically(path, f"{text}\n".encode())


def _writable(content: Any) -> Any:
    """Return the content with None and "∞" in the place of what JSON cannot write."""
    if isinstance(content, dict):
        return {name: _writable(entry) for name, entry in content.items()}
    if isinstance(content, list | tuple):
        return [_writable(entry) for entry in content]
    if isinstance(content, float) and not math.isfinite(content):
        return None if math.isnan(content) else significant(content, 1)
    return content


def _table(entry: dict[str, Any]) -> Table:
    return Table(
        **entry
        | {
            "columns": tuple(Column(**column) for column in entry["columns"]),
            "rows": tuple(
                tuple(_INFINITE.get(cell, cell) for cell in row) for row in entry["rows"]
            ),
            "findings": tuple(Finding(**finding) for finding in entry["findings"]),
        }
    )
