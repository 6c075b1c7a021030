"""Runs that lack disk space, write permission, memory or a folder of their own."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.studies.reliability.inputs import KINDS
from experiments.studies.reliability.kill import (
    EXPERIMENT,
    PATIENCE,
    ROOT,
    reference,
    steady,
    visible,
    whole,
)
from experiments.studies.reliability.mutations import put
from pymoo_hdte._runner.campaign import Run

SIZES = (0, 4, 8, 16, 32, 64, 128, 256, 512)
"""Sizes of the full disks, kB."""
PLENTY = "64m"


@dataclass(frozen=True)
class LimitJob:
    """One of `LIMITS`."""

    name: str

    @property
    def key(self) -> str:
        """The name, as a file may have it."""
        return f"limit_{self.name.replace(' ', '_').replace(',', '')}"

    def execute(self) -> Run:
        """Return the number of trials and of those that went wrong; no trial where denied."""
        verdicts = list(LIMITS[self.name]())
        values = np.array([[len(verdicts), verdicts.count(False)]], dtype=float)
        return Run(("trials", "failed"), values, 0.0)


@dataclass(frozen=True)
class MemoryJob:
    """An experiment in a process of its own, with its peak of resident memory in its parts."""

    name: str
    options: tuple[str, ...]

    @property
    def key(self) -> str:
        """All fields in one name."""
        return f"memory_{self.name}_{'_'.join(self.options).replace('--', '')}".rstrip("_")

    def execute(self) -> Run:
        """Return the exit code; in the parts, which differ from run to run, the peak in bytes."""
        with tempfile.TemporaryDirectory(prefix="memory-") as top:
            arguments = [self.name, *self.options, "--workers", "1", "--out", top]
            process = _started(_experiment(*arguments))
            _, status, usage = os.wait4(process.pid, 0)
        code = os.waitstatus_to_exitcode(status)
        values = np.array([[float(code)]])
        # Linux counts kB.
        return Run(("code",), values, usage.ru_utime, (1024.0 * usage.ru_maxrss,))


def full_disk_of_experiments() -> Iterator[bool]:
    """Run the experiment on disks that are too small, then again on ones that are not."""
    for size in SIZES:
        with _disk() as disk:
            if disk is None:
                return
            _resize(disk, f"{size}k")
            command = _experiment(*EXPERIMENT, "--workers", "1", "--out", str(disk / "out"))
            crowded = _run(command)
            clear = crowded.returncode in (1, 2) and _one_error(crowded.stderr)
            paths = list(visible(disk))
            untorn = all(whole(path) for path in paths) and not _hidden(disk)
            _resize(disk, PLENTY)
            again = _run(command)
            same = again.returncode == 0 and steady(disk / "out") == reference().files
            yield clear and untorn and same


def full_disk_of_reports() -> Iterator[bool]:
    """Write the report of an oscillator to disks that are too small."""
    with _oscillator() as folder:
        for size in SIZES:
            with _disk() as disk:
                if disk is None:
                    return
                _resize(disk, f"{size}k")
                done = _run(_report(folder, disk / "out"))
                fits = done.returncode == 0 and (disk / "out" / "report.html").is_file()
                refused = done.returncode == 2 and _one_error(done.stderr)
                yield fits or (refused and not list(disk.iterdir()))


def read_only() -> Iterator[bool]:
    """Ask for results in a folder in which one must not write: refused before anything is run."""
    with _oscillator() as folder, _read_only() as top:
        if top is None:
            return
        for command in (
            _experiment(*EXPERIMENT, "--out", str(top)),
            _experiment(*EXPERIMENT, "--out", str(top / "out")),
            _report(folder, top),
            _report(folder, top / "out"),
        ):
            done = _run(command)
            yield done.returncode == 2 and _one_error(done.stderr) and not list(top.iterdir())


def two_at_once() -> Iterator[bool]:
    """Run the same experiment twice at once into one folder: one of them may be refused."""
    for _ in range(3):
        with tempfile.TemporaryDirectory(prefix="twice-") as top:
            command = _experiment(*EXPERIMENT, "--workers", "1", "--out", top)
            processes = [_started(command) for _ in range(2)]
            codes = sorted(process.wait(PATIENCE) for process in processes)
            yield codes in ([0, 0], [0, 2]) and steady(Path(top)) == reference().files


def two_reports_at_once() -> Iterator[bool]:
    """Write the same report twice at once: one of them may be refused, the report is whole."""
    with _oscillator() as folder:
        for _ in range(3):
            with tempfile.TemporaryDirectory(prefix="twice-") as top:
                processes = [_started(_report(folder, Path(top) / "out")) for _ in range(2)]
                codes = sorted(process.wait(PATIENCE) for process in processes)
                names = [path.name for path in Path(top).iterdir()]
                whole_report = all(whole(path) for path in visible(Path(top) / "out"))
                yield codes in ([0, 0], [0, 2]) and names == ["out"] and whole_report


LIMITS: dict[str, Callable[[], Iterator[bool]]] = {
    "full disk, experiments": full_disk_of_experiments,
    "full disk, report": full_disk_of_reports,
    "read-only folder": read_only,
    "two experiments at once": two_at_once,
    "two reports at once": two_reports_at_once,
}


def _started(command: list[str]) -> subprocess.Popen[bytes]:
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command, cwd=ROOT, stdout=quiet, stderr=quiet)


def _experiment(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "experiments", *arguments]


def _report(folder: Path, out: Path) -> list[str]:
    command = ["pymoo_hdte.cli.__main__", "discrepancy", str(folder), "--out", str(out), "--quiet"]
    return [sys.executable, "-m", *command]


def _run(command: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, cwd=ROOT, timeout=PATIENCE, check=False, capture_output=True, text=True
    )


def _one_error(errors: str) -> bool:
    return bool(errors.strip()) and "Traceback" not in errors


def _hidden(folder: Path) -> list[Path]:
    return [path for path in folder.rglob(".*") if path.is_file()]


@contextmanager
def _oscillator() -> Iterator[Path]:
    """Give the folder of a valid rig."""
    with tempfile.TemporaryDirectory(prefix="rig-") as top:
        put(KINDS["rig"].original(), Path(top) / "rig")
        yield Path(top) / "rig"


@contextmanager
def _disk() -> Iterator[Path | None]:
    """Give a disk of its own in memory; None where only the superuser may have one."""
    with tempfile.TemporaryDirectory(prefix="disk-") as top:
        mount = ["mount", "-t", "tmpfs", "-o", f"size={PLENTY}", "tmpfs", top]
        try:
            mounted = subprocess.run(mount, check=False, capture_output=True).returncode == 0
        except OSError:
            mounted = False
        try:
            yield Path(top) if mounted else None
        finally:
            if mounted:
                subprocess.run(["umount", top], check=True)


@contextmanager
def _read_only() -> Iterator[Path | None]:
    """Give a read-only folder; permissions do not bind the superuser."""
    if os.geteuid() == 0:
        with _disk() as disk:
            if disk is not None:
                subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
            yield disk
    else:
        with tempfile.TemporaryDirectory(prefix="read-only-") as top:
            os.chmod(top, 0o555)
            yield Path(top)


def _resize(disk: Path, size: str) -> None:
    # A tmpfs of no size at all has no limit.
    size = "1" if size == "0k" else size
    subprocess.run(["mount", "-o", f"remount,size={size}", str(disk)], check=True)
