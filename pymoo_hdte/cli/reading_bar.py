"""A bar on the terminal while the records of a large campaign are read."""

from __future__ import annotations

from tqdm import tqdm

MANY_BYTES = 20_000_000
"""Smaller records are read within a few seconds."""


class ReadingBar:
    """Follows the bytes that are read; none if quiet, without a terminal or for few bytes.

    Parameters
    ----------
    quiet : bool
    """

    def __init__(self, quiet: bool) -> None:
        # Without a terminal tqdm disables itself.
        self._silent = True if quiet else None
        self._bar: tqdm | None = None

    def __call__(self, done: int, total: int) -> None:
        """Move on to ``done`` of ``total`` bytes."""
        if total < MANY_BYTES:
            return
        if self._bar is None:
            self._bar = tqdm(
                total=total, unit="B", unit_scale=True, leave=False, disable=self._silent
            )
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.close()
