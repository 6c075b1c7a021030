"""Ten thousand wrong inputs: each is refused clearly or read rightly, and nothing else happens.

Input ``number`` of a kind is a pure function of both; ``python -m
experiments.studies.reliability.fuzz "duty cycle" 1234`` repeats it with all details. A block of
inputs runs in a process of its own, so that what hangs or crashes the interpreter is seen from
outside and the block goes on behind it.
"""

from __future__ import annotations

import os
import re
import resource
import select
import subprocess
import sys
import tempfile
import time
import traceback
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.studies.reliability.inputs import KINDS
from experiments.studies.reliability.mutations import mutated, put
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte.checks import InvalidInput, SeveralComplaints

SEED = 20261122
REFUSED, ACCEPTED, FAILED, HUNG, CRASHED = range(5)
OUTCOMES = ("refused", "accepted", "failed", "hung", "crashed")
LONGEST_MESSAGE = 1000
"""Most characters that an error may have."""
MOST_MEMORY = 8 * 2**30
"""Address space of the reading process, so that it cannot exhaust the machine."""
START_SECONDS = 120.0
"""Seconds for imports and to make the original."""
READY = "ready"
OUTCOME_LINE = rb"(?m)^outcome (\d+)\n"
ROOT = Path(__file__).parents[3]


@dataclass(frozen=True)
class FuzzJob:
    """Inputs ``first`` to ``first + count - 1`` of a kind."""

    kind: str
    first: int
    count: int

    @property
    def key(self) -> str:
        """All fields in one name."""
        return f"fuzz_{self.kind.replace(' ', '_')}_{self.first}_{self.count}_seed{SEED}"

    def execute(self) -> Run:
        """Return number and outcome of every input."""
        begin = time.perf_counter()
        outcomes: list[int] = []
        end = self.first + self.count
        while len(outcomes) < self.count:
            block = (self.kind, str(self.first + len(outcomes)), str(end))
            outcomes += outcomes_of_process(
                [sys.executable, "-m", __name__, *block],
                self.count - len(outcomes),
                KINDS[self.kind].seconds,
            )
        numbers = np.arange(self.first, self.first + self.count)
        values = np.column_stack([numbers, outcomes]).astype(float)
        return Run(("number", "outcome"), values, time.perf_counter() - begin)


def outcome(kind: str, number: int) -> tuple[int, str]:
    """Read one input; return its outcome and what was said."""
    rng = np.random.default_rng([SEED, zlib.crc32(kind.encode()), number])
    files, changes = mutated(KINDS[kind].original(), rng)
    with tempfile.TemporaryDirectory(prefix="fuzz-") as top:
        folder = Path(top) / "input"
        put(files, folder)
        outcome_of, words = _read(kind, folder)
    return outcome_of, f"{'; '.join(changes)}: {words}"


def _read(kind: str, folder: Path) -> tuple[int, str]:
    try:
        KINDS[kind].read(folder)
    except InvalidInput as error:
        complaints = error.complaints if isinstance(error, SeveralComplaints) else (error,)
        return (REFUSED if all(map(_is_clear, complaints)) else FAILED), str(error)
    except OSError as error:
        return REFUSED, repr(error)
    except Exception:
        return FAILED, traceback.format_exc()
    return ACCEPTED, "read"


def _is_clear(complaint: InvalidInput) -> bool:
    """Tell whether a complaint names its field and what is allowed, in one line of some length."""
    words = str(complaint)
    named = bool(complaint.field and complaint.allowed)
    return named and "\n" not in words and len(words) <= LONGEST_MESSAGE


def outcomes_of_process(command: list[str], count: int, seconds: float) -> list[int]:
    """Return the outcomes that a process prints, at least one, until it ends by itself or by us.

    It prints a line when it is ready, then a line ``outcome N`` for each of ``count`` inputs, each
    within so many seconds; the input at which it does not is `HUNG` or `CRASHED`, and the last one
    returned.
    """
    outcomes: list[int] = []
    with _process(command) as output:
        limit, text = START_SECONDS, b""
        while True:
            ready, _, _ = select.select([output], [], [], limit)
            if not ready:
                return [*outcomes, HUNG]
            part = os.read(output, 65536)
            if not part:
                return outcomes if len(outcomes) == count else [*outcomes, CRASHED]
            text += part
            # A line that is half here is counted when its end comes; libraries print lines too.
            outcomes = [int(outcome_of) for outcome_of in re.findall(OUTCOME_LINE, text)]
            limit = seconds


@contextmanager
def _process(command: list[str]) -> Iterator[int]:
    """Give the file descriptor of the output of a process, which is killed in the end."""
    reading, writing = os.pipe()
    with subprocess.Popen(command, cwd=ROOT, stdout=writing, stderr=subprocess.DEVNULL) as process:
        os.close(writing)
        try:
            yield reading
        finally:
            process.kill()
            os.close(reading)


def _serve(kind: str, first: int, end: int) -> None:
    """Print a line for every input as soon as its outcome is known."""
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    KINDS[kind].original()
    print(READY, flush=True)
    for number in range(first, end):
        print(f"outcome {outcome(kind, number)[0]}", flush=True)


if __name__ == "__main__":
    if len(sys.argv) == 4:
        _serve(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
    else:
        result, words = outcome(sys.argv[1], int(sys.argv[2]))
        print(f"{OUTCOMES[result]}: {words}")
