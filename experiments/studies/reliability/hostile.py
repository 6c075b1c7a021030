"""Files of a stranger: bombs, links, devices, encodings and damaged lines, through whole commands.

``python -m experiments.studies.reliability.hostile`` tries all of them and tells what went wrong.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import warnings
import zipfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from experiments.studies.reliability.kill import PATIENCE, ROOT
from pymoo_hdte.problems import Design, robust_problem

MOST_MEMORY = 2**29
"""Bytes of a process that refuses a file: those of the libraries, and a few blocks of text."""
MOST_SECONDS = 60.0
"""Of processor time; expanding all of a bomb to its limit takes ten."""
EXPANDED = 3 * 2**29
"""Bytes of a bomb, above the budget of any file."""


def bombs() -> Iterator[bool]:
    """Read small files that expand to more than the budget, or have a line without end."""
    texts = {
        "rows": b"t,q\n" + b"0,1\n" * 2**18,
        "one line": b"1" * 2**20,
        "blank lines": b"t,q\n" + b"\n" * 2**20,
        "zeros": bytes(2**20),
        "open quote": b't,q\n"' + b"1,2\n" * 2**18,
    }
    with tempfile.TemporaryDirectory(prefix="bombs-") as top:
        for content in texts.values():
            path = Path(top) / "t.csv.gz"
            path.write_bytes(_repeated(content, 31))
            yield _refused(path)
        path = Path(top) / "t.mat"
        path.write_bytes(_matlab_bomb())
        yield _refused(path)
        path = Path(top) / "t.npz"
        np.savez_compressed(path, q=np.zeros(2**27, np.uint8))
        yield _refused(path)
        _stating(path, b"(134217728,)", b"(134217728000,)")
        yield _refused(path)
        path = Path(top) / "rig.toml"
        path.write_bytes(b"a." * 40_000 + b"a = 1")
        yield _refused(path)


def links() -> Iterator[bool]:
    """Put links, devices and pipes where files are read and where they are written."""
    with tempfile.TemporaryDirectory(prefix="links-") as top:
        folder = Path(top)
        for name in ("t.csv", "t.mat", "rig.toml"):
            (folder / name).symlink_to("/dev/zero")
            yield _refused(folder / name)
            (folder / name).unlink()
            os.mkfifo(folder / name)
            yield _refused(folder / name)
            (folder / name).unlink()
        thesis = folder / "thesis.txt"
        thesis.write_text("years of work")
        (folder / ".out.in-use").symlink_to(thesis)
        command = ["-m", "pymoo_hdte.cli", "simulate", "hs_20_100", "--out", str(folder / "out")]
        done = _run(command)
        refused = done.returncode == 2 and "Traceback" not in done.stderr
        yield refused and thesis.read_text() == "years of work" and not (folder / "out").exists()


def encodings() -> Iterator[bool]:
    """Read a table with German titles in every encoding: as its numbers are, or refused by name."""
    text = "Zeit;Winkel [\u00b0]\n" + "".join(f"0,{row:03d};{row},5\n" for row in range(100))
    with tempfile.TemporaryDirectory(prefix="encodings-") as top:
        path = Path(top) / "t.csv"
        for encoding in (
            "utf-8",
            "utf-8-sig",
            "cp1252",
            "latin-1",
            "utf-16",
            "utf-16-le",
            "utf-32",
        ):
            path.write_bytes(text.encode(encoding))
            script = (
                "from pathlib import Path\n"
                "from pymoo_hdte._io.tables import Channel, TableLayout, read_columns\n"
                "title = 'Winkel [\\u00b0]'\n"
                "layout = TableLayout('csv', {'q': Channel(title, 'deg')}, None, 100.0, 0)\n"
                f"raw = read_columns(Path({str(path)!r}), layout).raw[title]\n"
                "assert raw.tolist() == [row + 0.5 for row in range(100)]\n"
            )
            done = _run(["-c", script])
            named = "InvalidInput: t.csv" in done.stderr
            yield done.returncode == 0 or (named and not encoding.startswith("utf-8"))


def damaged_lines() -> Iterator[bool]:
    """Damage each line of a file of runs in turn: the study ends as if it had not been."""
    kinds = (
        b"3",
        b"[" * 100_000,
        b'{"at": 1}',
        b'{"at": ["0x1p0"], "gave": [null]}',
        b"\xff\xfe",
        b"{",
    )
    with tempfile.TemporaryDirectory(prefix="damaged-") as top:
        runs, problem = Path(top) / "runs.jsonl", Path(top) / "problem.npz"
        _study(runs, problem)
        lines, expected = runs.read_bytes().split(b"\n"), problem.read_bytes()
        for number in range(1, len(lines) - 1):
            damaged = kinds[number % len(kinds)]
            runs.write_bytes(b"\n".join([*lines[:number], damaged, *lines[number + 1 :]]))
            with warnings.catch_warnings(record=True) as told:
                warnings.simplefilter("always")
                _study(runs, problem)
            words = f"line {number + 1} "
            heard = any(words in str(warning.message) for warning in told)
            yield heard and problem.read_bytes() == expected


HOSTILE: dict[str, Callable[[], Iterator[bool]]] = {
    "files that expand": bombs,
    "links and devices": links,
    "encodings": encodings,
    "damaged lines of runs": damaged_lines,
}


def _study(runs: Path, problem: Path) -> None:
    designs = {"x": Design(1.0, 2.0, deviation=0.1)}
    robust_problem(_square, designs, cache=runs, progress=False).save(problem)


def _square(x: float) -> float:
    return x * x


def _repeated(content: bytes, window: int) -> bytes:
    """Return a compressed stream of `EXPANDED` bytes of repeated content."""
    packing = zlib.compressobj(9, zlib.DEFLATED, window)
    parts = [packing.compress(content) for _ in range(-(-EXPANDED // len(content)))]
    return b"".join([*parts, packing.flush()])


def _matlab_bomb() -> bytes:
    """Return a file whose array states as many zeros as it expands to."""
    count = EXPANDED // 8
    sizes = [np.array([14, 48 + 8 * count], "<u4"), np.array([6, 8, 6, 0], "<u4")]
    sizes += [np.array([5, 8, 1, count], "<u4"), np.array([1 + (1 << 16), ord("q")], "<u4")]
    head = b"".join([*map(np.ndarray.tobytes, sizes), np.array([9, 8 * count], "<u4").tobytes()])
    packing = zlib.compressobj(9)
    parts = [packing.compress(head)]
    parts += [packing.compress(bytes(2**20)) for _ in range(EXPANDED // 2**20)]
    packed = b"".join([*parts, packing.flush()])
    tag = np.array([15, len(packed)], "<u4").tobytes()
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\1IM" + tag + packed


def _stating(path: Path, shape: bytes, second: bytes) -> None:
    """Let the array of an npz file state another shape in its head, which has room for it."""
    with zipfile.ZipFile(path) as packed:
        content = packed.read("q.npy")
    spare = b" " * (len(second) - len(shape))
    content = content.replace(shape + b", }" + spare, second + b", }", 1)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("q.npy", content)


def _refused(path: Path) -> bool:
    """Tell whether a file is refused by name, in little memory and time."""
    if path.suffix == ".toml":
        read = f"from pymoo_hdte._io.toml import read_toml; read_toml(Path({str(path)!r}))"
    else:
        read = (
            "from pymoo_hdte._io.tables import Channel, TableLayout, read_table\n"
            "layout = TableLayout('csv', {'q': Channel('q', 'm')}, None, 100.0, 0)\n"
            f"read_table(Path({str(path)!r}), layout)"
        )
    errors = path.parent / "errors.txt"
    with errors.open("wb") as file:
        command = [sys.executable, "-c", f"from pathlib import Path\n{read}"]
        process = subprocess.Popen(command, cwd=ROOT, stderr=file)
        _, status, usage = os.wait4(process.pid, 0)
    refused = f"InvalidInput: {path.name}" in errors.read_text(encoding="utf-8") or (
        path.suffix == ".toml" and "InvalidInput" in errors.read_text(encoding="utf-8")
    )
    ended = os.waitstatus_to_exitcode(status) == 1
    # Linux counts kB.
    little = 1024 * usage.ru_maxrss < MOST_MEMORY and usage.ru_utime < MOST_SECONDS
    return refused and ended and little


def _run(arguments: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=ROOT, timeout=PATIENCE, check=False, capture_output=True, text=True,
    )  # fmt: skip


def main() -> int:
    """Try all of them; 0 if nothing went wrong."""
    failed = {}
    for name, trial in HOSTILE.items():
        verdicts = list(trial())
        failed[name] = [number for number, good in enumerate(verdicts) if not good]
        print(f"{name}: {len(verdicts)} trials, failed: {failed[name] or 'none'}", flush=True)
    return int(any(failed.values()))


if __name__ == "__main__":
    sys.exit(main())
