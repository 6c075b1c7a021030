"""Very many designs, block after block on all cores: the same bytes for any number of them."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

ENOUGH_FOR_THREADS = 4096
"""Least number of designs for which threads pay."""
ENOUGH_TO_COMPILE = 1000
"""Least number of designs for which machine code that is made once an installation pays.

It takes some seconds to make and a tenth of one to load; numpy takes up to 50 ms for as many.
"""
_SHARES = 4
"""Shares of the work for each core: one that is kept busy by others then holds up less."""


def usable_cores() -> int:
    """Return how many cores this process may use."""
    # A scheduler or taskset may leave this process fewer cores than the machine has.
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def in_blocks(work: Callable[[slice], None], n: int, step: int) -> None:
    """Call ``work`` with 0..step, step..2 step, up to n, on as many threads as there are cores.

    The blocks do not depend on the number of threads; ``work`` must not depend on their order.
    """
    blocks = [slice(start, min(start + step, n)) for start in range(0, n, step)]
    cores = usable_cores()
    if cores == 1 or len(blocks) == 1:
        for block in blocks:
            work(block)
        return
    count = min(_SHARES * cores, len(blocks))

    def share(offset: int) -> None:
        for block in blocks[offset::count]:
            work(block)

    with ThreadPoolExecutor(cores) as threads:
        # Asking for the results passes on what was raised.
        list(threads.map(share, range(count)))
