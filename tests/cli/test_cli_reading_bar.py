"""The bar while records are read: on a terminal, for many bytes, unless quiet."""

import io
import sys
import time
from contextlib import closing

import pytest

from pymoo_hdte.cli.reading_bar import MANY_BYTES, ReadingBar, SimulationBar


class Screen(io.StringIO):
    def __init__(self, terminal):
        super().__init__()
        self.terminal = terminal

    def isatty(self):
        return self.terminal


@pytest.mark.parametrize(
    ("terminal", "quiet", "total", "shown"),
    [
        (True, False, MANY_BYTES, True),
        (True, True, MANY_BYTES, False),
        (False, False, MANY_BYTES, False),
        (True, False, MANY_BYTES - 1, False),
    ],
)
def test_a_bar_is_shown_where_somebody_waits(terminal, quiet, total, shown, monkeypatch):
    screen = Screen(terminal)
    monkeypatch.setattr(sys, "stderr", screen)
    with closing(ReadingBar(quiet)) as bar:
        bar(0, total)
        # A bar is drawn again after a tenth of a second.
        time.sleep(0.15)
        bar(total // 4, total)
    assert bool(screen.getvalue()) == shown
    assert ("25%" in screen.getvalue()) == shown


def test_a_bar_is_shown_while_held_out_records_are_simulated(monkeypatch):
    screen = Screen(True)
    monkeypatch.setattr(sys, "stderr", screen)
    with closing(SimulationBar(False)) as bar:
        bar(1, 4)
        time.sleep(0.15)
        bar(3, 4)
    assert "simulating" in screen.getvalue()
    assert "75%" in screen.getvalue()
