"""One record from several files, whose clocks are the same."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

from pymoo_hdte._io.even_steps import STEP_SPREAD
from pymoo_hdte._io.layout import TableLayout
from pymoo_hdte._io.parts import Part
from pymoo_hdte._io.tables import FEWEST_ROWS, Table, read_table, read_unbroken_tables
from pymoo_hdte._io.text_lines import Seen
from pymoo_hdte.checks import InvalidInput

_SAME = 1e-3
"""Moments that differ by less than this, in steps, are the same."""
_RATES = STEP_SPREAD / 2.0
"""Largest relative difference of equal rates; a step may deviate by twice as much."""
_LENGTHS = 0.01
"""Largest relative difference in length of files without a column of time."""


def read_joined(
    files: Mapping[str, Path],
    layout: TableLayout,
    seen: Seen | None = None,
    part: Part | None = None,
) -> Table:
    """Read a record whose channels stand in one file or in several.

    Parameters
    ----------
    files : mapping of str to Path
        The file of each channel of the layout.
    layout : TableLayout
        Its column of time is in each of the files, which have one rate: between the rows of a
        coarser one nothing was measured. With a sampling rate instead, equal rows of the files
        belong together.
    seen : callable, optional
        Called with the number of further bytes read.
    part : Part, optional
        The part to be read of each file.

    Returns
    -------
    Table
        At the steps of the finest file, while all files were recording.

    Raises
    ------
    InvalidInput
        As `read_table`, and if the files do not belong together.
    OSError
        If a file cannot be read.
    """
    paths = list(dict.fromkeys(files[name] for name in layout.channels))
    tables = [
        read_table(
            path,
            replace(
                layout,
                channels={n: channel for n, channel in layout.channels.items() if files[n] == path},
            ),
            seen,
            part,
        )
        for path in paths
    ]
    if len(tables) == 1:
        return tables[0]
    if layout.time is None:
        lengths = {path.name: len(table.time) for path, table in zip(paths, tables, strict=True)}
        if max(lengths.values()) - min(lengths.values()) > _LENGTHS * max(lengths.values()):
            allowed = "as many in each file, because a sample_rate stands for their times"
            raise InvalidInput("rows of the files", lengths, allowed)
    return _at_the_finest(paths, tables)


def read_unbroken(
    files: Mapping[str, Path],
    layout: TableLayout,
    seen: Seen | None = None,
    part: Part | None = None,
) -> list[Table]:
    """Read a record as `read_joined` does; a gap in the time of a single file divides it.

    Returns
    -------
    list of Table
        At least one, as `read_unbroken_tables` has it.
    """
    paths = {files[name] for name in layout.channels}
    if len(paths) > 1:
        return [read_joined(files, layout, seen, part)]
    return read_unbroken_tables(paths.pop(), layout, seen, part)


def _at_the_finest(paths: Sequence[Path], tables: Sequence[Table]) -> Table:
    finest = min(tables, key=_step)
    if _step(max(tables, key=_step)) > (1.0 + _RATES) * _step(finest):
        rates = {path.name: 1.0 / _step(table) for path, table in zip(paths, tables, strict=True)}
        raise InvalidInput(
            "rates of the files, Hz",
            {name: float(f"{rate:.6g}") for name, rate in rates.items()},
            f"the same within {100.0 * _RATES:g} %: take every row of the finer ones that "
            "belongs to one of the coarsest",
        )
    step = _step(finest)
    begin = max(table.time[0] for table in tables) - _SAME * step
    end = min(table.time[-1] for table in tables) + _SAME * step
    time = finest.time[(finest.time >= begin) & (finest.time <= end)]
    names = ", ".join(path.name for path in paths)
    if len(time) < FEWEST_ROWS:
        allowed = f"at least {FEWEST_ROWS}, recorded while the other files were"
        raise InvalidInput(f"rows of the finest of {names}", len(time), allowed)
    channels, moved = {}, False
    for table in tables:
        places = np.searchsorted(table.time, time - _SAME * step)
        same = places[-1] < len(table.time) and bool(
            np.all(np.abs(table.time[places] - time) <= _SAME * step)
        )
        moved = moved or not same
        for name, signal in table.channels.items():
            channels[name] = (
                signal[places] if same else make_interp_spline(table.time, signal)(time)
            )
    remarks = [table.remark for table in tables]
    if moved:
        remarks.append(f"The signals of {names} are taken at the steps of the finest file.")
    return Table(
        time,
        channels,
        sum(table.dropped for table in tables),
        " ".join(filter(None, remarks)),
        moved or any(table.interpolated for table in tables),
    )


def _step(table: Table) -> float:
    return float(np.mean(np.diff(table.time)))
