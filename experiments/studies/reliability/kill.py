"""kill -9 at any moment, then the same command again: the bytes of an undisturbed run.

Moments are either random, from the start of the interpreter to the last file, or one of the steps
in which a file is written: in the midst of its bytes, or just before it gets its name.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from pymoo_hdte._io import whole_file
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte._runner.store import TIMES

SEED = 20261123
ROOT = Path(__file__).parents[3]
EXPERIMENT = ("table7", "--seeds", "1")
"""Six jobs, five tables and two figures in a few seconds."""
STEPS = 48
"""About the number of steps of the undisturbed run: two for each of its files."""
PATIENCE = 300.0
"""Seconds after which a run hangs."""
COUNTS = ("kills", "finished", "partial", "different", "failed", "orphaned")


@dataclass(frozen=True)
class Reference:
    """Files of an undisturbed run, by their path, and how long it took."""

    files: dict[str, bytes]
    seconds: float


@dataclass(frozen=True)
class KillJob:
    """Kills of one run after the other, each in the folder that the one before left behind."""

    block: int
    kills: int
    workers: int

    @property
    def key(self) -> str:
        """All fields in one name."""
        return f"kill_{self.block}_{self.kills}_workers{self.workers}_seed{SEED}"

    def execute(self) -> Run:
        """Count kills, runs that came to their end, and what must not happen."""
        rng = np.random.default_rng([SEED, self.block])
        begin, counts = time.perf_counter(), dict.fromkeys(COUNTS, 0)
        with tempfile.TemporaryDirectory(prefix="kill-") as top:
            folder = Path(top) / "0"
            # A run that fails whenever it is resumed must not keep us here for ever.
            while counts["kills"] + counts["failed"] + counts["orphaned"] < self.kills:
                if rng.random() < 0.5:
                    moment = rng.uniform(0.0, 1.1 * reference().seconds)
                    ended = self._killed(folder, str(STEPS**2), moment)
                else:
                    ended = self._killed(folder, str(rng.integers(1, STEPS + 1)), PATIENCE)
                judge(folder, ended, counts)
                if ended == 0:
                    folder = Path(top) / str(counts["finished"])
            judge(folder, self._killed(folder, str(STEPS**2), PATIENCE), counts)
        values = np.array([list(counts.values())], dtype=float)
        return Run(COUNTS, values, time.perf_counter() - begin)

    def _killed(self, folder: Path, step: str, moment: float) -> int | None:
        options = ("--workers", str(self.workers), "--out", str(folder))
        return run_until(
            ["experiments.studies.reliability.kill", step, *EXPERIMENT, *options], moment
        )


def run_until(module: list[str], moment: float) -> int | None:
    """Run a module and kill it at a moment in s; return its exit code, None if others outlive it.

    Its pipe ends with the last process that holds it, its own or that of a worker.
    """
    with subprocess.Popen(
        [sys.executable, "-m", *module], cwd=ROOT, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    ) as process:  # fmt: skip
        try:
            process.communicate(timeout=moment)
        except subprocess.TimeoutExpired:
            process.kill()
            try:
                process.communicate(timeout=PATIENCE)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                return None
    return process.returncode


def judge(folder: Path, ended: int | None, counts: dict[str, int]) -> None:
    """Add to the counts what a run that has ended left in its folder."""
    files, expected = steady(folder), reference().files
    counts["partial"] += sum(not whole(path) for path in visible(folder))
    counts["different"] += sum(expected.get(name) != content for name, content in files.items())
    counts["kills"] += ended == -signal.SIGKILL
    counts["orphaned"] += ended is None
    if ended == 0:
        counts["finished"] += 1
        counts["different"] += len(expected.keys() - files.keys())
    counts["failed"] += ended not in (0, -signal.SIGKILL, None)


@cache
def reference() -> Reference:
    """Return the files of the undisturbed run, made once per process."""
    with tempfile.TemporaryDirectory(prefix="kill-") as top:
        begin = time.perf_counter()
        options = ["--workers", "1", "--out", top]
        subprocess.run(
            [sys.executable, "-m", "experiments", *EXPERIMENT, *options],
            cwd=ROOT, check=True, capture_output=True,
        )  # fmt: skip
        return Reference(steady(Path(top)), time.perf_counter() - begin)


def visible(folder: Path) -> list[Path]:
    """Return the files that are not temporary ones."""
    return [p for p in folder.rglob("*") if p.is_file() and not p.name.startswith(".")]


def steady(folder: Path) -> dict[str, bytes]:
    """Return the visible files that are the same in every run: neither times nor the page."""
    names = {path: str(path.relative_to(folder)) for path in visible(folder)}
    return {
        name: path.read_bytes()
        for path, name in names.items()
        if not name.startswith(TIMES) and path.suffix != ".html"
    }


def whole(path: Path) -> bool:
    """Whether a file is complete, by what ends a file of its type."""
    text = path.read_bytes()
    try:
        if path.suffix == ".json":
            json.loads(text)
        if path.suffix == ".txt":
            [float(line) for line in text.decode().split()]
        if path.suffix == ".npy":
            np.load(path, allow_pickle=False)
            return True
    except (ValueError, EOFError):
        return False
    ends = {".png": b"IEND\xaeB`\x82", ".html": b"</html>"}
    return text.endswith(ends.get(path.suffix, b"\n"))


def _die_at(step: int) -> None:
    """Have this process killed in one of the steps in which `write_atomically` writes files."""
    write, replace, left = whole_file.write_all, os.replace, iter(range(step - 1, -1, -1))

    def half_written(descriptor: int, content: bytes) -> None:
        if next(left, None) == 0:
            write(descriptor, content[: len(content) // 2])
            os.kill(os.getpid(), signal.SIGKILL)
        write(descriptor, content)

    def not_named(source: Path, target: Path) -> None:
        if next(left, None) == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        replace(source, target)

    whole_file.write_all, os.replace = half_written, not_named  # type: ignore[assignment]


if __name__ == "__main__":
    from experiments.command_line import main

    _die_at(int(sys.argv[1]))
    sys.exit(main(sys.argv[2:]))
