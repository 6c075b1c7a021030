"""Bars on the terminal while a large campaign is read and held-out records are simulated."""

from __future__ import annotations

from typing import Any, ClassVar

from tqdm import tqdm

MANY_BYTES = 20_000_000
"""Bytes below which records are read within a few seconds, without a bar."""


class _Bar:
    """A bar of progress, hidden if quiet or without a terminal.

    Parameters
    ----------
    quiet : bool
    """

    looks: ClassVar[dict[str, Any]]
    least: ClassVar[int] = 1

    def __init__(self, quiet: bool) -> None:
        # Without a terminal tqdm disables itself.
        self._silent = True if quiet else None
        self._bar: tqdm | None = None

    def __call__(self, done: int, total: int) -> None:
        """Move on to ``done`` of ``total``."""
        if total < self.least:
            return
        if self._bar is None:
            self._bar = tqdm(total=total, leave=False, disable=self._silent, **self.looks)
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        """Remove the bar."""
        if self._bar is not None:
            self._bar.close()


class ReadingBar(_Bar):
    """A bar for the bytes that are read, hidden for few bytes."""

    looks: ClassVar[dict[str, Any]] = {"unit": "B", "unit_scale": True}
    least: ClassVar[int] = MANY_BYTES


class SimulationBar(_Bar):
    """A bar for the windows of held-out records that are simulated."""

    looks: ClassVar[dict[str, Any]] = {"unit": "window", "desc": "simulating"}
