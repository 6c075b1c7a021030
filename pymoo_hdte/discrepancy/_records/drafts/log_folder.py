"""The logs of a folder that nobody has described: which files belong together."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pymoo_hdte._io.unstated import ENDINGS, UnstatedTable, read_unstated
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._records.drafts.column_roles import STILL, Log, Name, Values

_LENGTHS = 0.01
"""By which the rows of files that hold one record may differ, relative."""
_FEWEST = 16


@dataclass(frozen=True, eq=False)
class LogFolder:
    """Files of one layout, and what is to be said of the others.

    Attributes
    ----------
    folder : Path
    log : Log
        Of all files that belong together.
    tables : tuple of UnstatedTable
        Each a record of its own.
    sources : dict of str to (str, str or int)
        File and column of each column, where one record stands in several files; else empty.
    others : tuple of UnstatedTable
        With other columns.
    refused : tuple of str
        A sentence on each file that cannot be read.
    """

    folder: Path
    log: Log
    tables: tuple[UnstatedTable, ...]
    sources: Mapping[Name, tuple[str, Name]]
    others: tuple[UnstatedTable, ...]
    refused: tuple[str, ...]

    def left_out(self, used: Collection[UnstatedTable] = ()) -> list[str]:
        """Return a sentence on each file that is not used.

        Parameters
        ----------
        used : collection of UnstatedTable
            Those of the others that are used all the same.
        """
        names = [table.path for table in used]
        others = [
            f"{table.path.name} is not used: its columns are others ({_shown(table)})"
            for table in self.others
            if table.path not in names
        ]
        return [*others, *self.refused]

    def without(self, tables: Collection[UnstatedTable], why: str) -> LogFolder:
        """Return the folder without some files, and why they are not used.

        Parameters
        ----------
        tables : collection of UnstatedTable
            Not all of them.
        why : str
            The end of a sentence.
        """
        names = [table.path for table in tables]
        remaining = tuple(table for table in self.tables if table.path not in names)
        said = [f"{path.name} is not used: {why}" for path in names]
        return replace(self, log=Log(remaining), tables=remaining, refused=(*self.refused, *said))

    def moving(self, column: Name) -> LogFolder:
        """Return the folder without files in which a column stands still.

        Parameters
        ----------
        column : str or int
        """
        spans = {
            table.path: float(np.ptp(table.columns[column][np.isfinite(table.columns[column])]))
            for table in self.tables
        }
        still = [table for table in self.tables if spans[table.path] < STILL * max(spans.values())]
        return (
            self.without(still, f"{self.log.label(column)} stands still in it") if still else self
        )


def read_log_folder(folder: Path) -> LogFolder:
    """Read the data files of a folder, and choose those that most rows have in common.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    InvalidInput
        If no file of it can be read as a table; the message has the reason of each.
    OSError
        If the folder cannot be read.
    """
    tables, refused = [], []
    paths = sorted(path for path in folder.iterdir() if path.name.lower().endswith(ENDINGS))
    for path in paths:
        if path.name.startswith(".") or not path.is_file():
            continue
        try:
            table = read_unstated(path)
            if table.rows < _FEWEST:
                raise InvalidInput(f"{path.name}: rows", table.rows, f"at least {_FEWEST}")
            tables.append(table)
        except InvalidInput as error:
            refused.append(f"{path.name} is not used: {error}")
    if not tables:
        allowed = f"a folder with tables of numbers, in files that end in {', '.join(ENDINGS)}"
        raise InvalidInput("FOLDER", "; ".join(refused) or str(folder), allowed)
    joined = _joined(tables)
    if joined is not None:
        table, sources = joined
        return LogFolder(folder, Log([table]), (table,), sources, (), tuple(refused))
    chosen = _alike(tables)
    used = {table.path for table in chosen}
    others = tuple(table for table in tables if table.path not in used)
    return LogFolder(folder, Log(chosen), tuple(chosen), {}, others, tuple(refused))


def _shown(table: UnstatedTable) -> str:
    names = [str(name) for name in table.columns]
    return ", ".join(names[:5]) + (" ..." if len(names) > 5 else "")


def _alike(tables: Sequence[UnstatedTable]) -> list[UnstatedTable]:
    """Return files that can be read in one way, with the columns that all of them have.

    Of all such choices it is the one with most numbers: a column that few files have goes, and so
    do files that lack many.
    """
    best: list[UnstatedTable] = []
    for reference in tables:
        titled = not any(isinstance(name, int) for name in reference.columns)
        group = [
            replace(table, columns={name: table.columns[name] for name in reference.columns})
            for table in tables
            if (reference.format, reference.delimiter, reference.decimal, reference.skip_rows)
            == (table.format, table.delimiter, table.decimal, table.skip_rows)
            and set(reference.columns) <= set(table.columns)
            and (titled or len(reference.columns) == len(table.columns))
        ]
        if _numbers(group) > _numbers(best):
            best = group
    return best


def _numbers(group: Sequence[UnstatedTable]) -> int:
    return sum(table.rows * len(table.columns) for table in group)


def _joined(
    tables: Sequence[UnstatedTable],
) -> tuple[UnstatedTable, dict[Name, tuple[str, Name]]] | None:
    """Return one record of files that have one signal each, as long as each other."""
    reference = tables[0]
    signals: dict[Name, tuple[str, Name]] = {}
    columns: dict[Name, Values] = {}
    titles: dict[Name, str] = {}
    units: dict[Name, str] = {}
    time: Name | None = None
    for table in tables:
        log = Log([table])
        same = (table.format, table.delimiter, table.decimal) == (
            *(reference.format, reference.delimiter, reference.decimal),
        )
        stamps = None if log.time is None else log.time.column
        as_long = abs(table.rows - reference.rows) <= _LENGTHS * reference.rows
        if (
            len(log.signals) != 1
            or not same
            or not as_long
            or (table is not reference and stamps != time)
        ):
            return None
        time = stamps
        (column,) = log.signals
        stem = table.path.name.split(".")[0]
        signals[stem] = table.path.name, column
        columns[stem] = table.columns[column][: min(table.rows for table in tables)]
        title = str(table.titles.get(column, ""))
        titles[stem] = f"{stem} {title}".strip()
        units[stem] = table.units.get(column, "")
    if len(signals) < 2 or len(signals) < len(tables):
        return None
    if time is not None:
        columns[time] = reference.columns[time][: min(table.rows for table in tables)]
        titles[time] = reference.titles.get(time, "")
    return replace(reference, columns=columns, titles=titles, units=units), signals
