"""Draw the three pictures of the README: ``python docs/readme_pictures.py``, one minute.

The examples of the README are run, and each picture shows what its example found. Its description
holds what that run printed, which a test compares with the README and with a run of today.
"""

import contextlib
import io
import json
import re
import runpy
import shlex
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, ScalarFormatter

from pymoo_hdte.cli import command_line

DOCS = Path(__file__).parent
README = DOCS.parent / "README.md"
# Told apart without colour too; blue and orange are those of the reports.
BEFORE, AFTER, GREY = "#D55E00", "#0072B2", "0.65"
LOOKS = (("NSGA-II", "s", BEFORE), ("MOPSO", "^", "#009E73"), ("AMP-MOPSO", "D", "#CC79A7"),
         ("CompactSwarm", "o", AFTER))  # fmt: skip


def blocks(language: str) -> list[str]:
    """Return the blocks of the README in one language."""
    text = README.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)


def run_python(code: str) -> tuple[str, dict[str, Any]]:
    """Return what an example prints, and its names."""
    names: dict[str, Any] = {}
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(code, "README.md", "exec"), names)
    return printed.getvalue().strip(), names


def run_commands(lines: str) -> tuple[str, dict[str, Any]]:
    """Return what the commands of the verdict print in a new folder, and its ``verdict.json``."""
    printed = io.StringIO()
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        contextlib.redirect_stdout(printed),
    ):
        for program, *words in map(shlex.split, lines.splitlines()):
            if program == "python":
                kept, sys.argv = sys.argv, words
                try:
                    runpy.run_path(str(DOCS.parent / words[0]), run_name="__main__")
                finally:
                    sys.argv = kept
            elif command_line.main(words):
                raise SystemExit(f"{program} {shlex.join(words)} failed")
        verdict = json.loads(Path("report", "verdict.json").read_text(encoding="utf-8"))
    return printed.getvalue().strip(), verdict


def beams(names: Mapping[str, Any]) -> Figure:
    """Draw the deflection of the robust beams over their mass, with and without scatter."""
    designs, values = names["result"].X, names["result"].F
    rows = values[:, 0].argsort()
    width, height = designs[rows].T
    figure, axis = _panel()
    nominal = names["beam"](width, height, 500.0, 2.1e11)["deflection"]
    axis.plot(
        values[rows, 0],
        1e3 * nominal,
        color=GREY,
        linewidth=4,
        label="same beams, nothing scatters",
    )
    label = "robust designs: mean + 3 std"
    axis.plot(values[rows, 0], 1e3 * values[rows, 1], "o", color=AFTER, markersize=5, label=label)
    axis.set(xlabel="mass [kg]", ylabel="deflection [mm]", yscale="log")
    _plain(axis, (2, 5, 10, 20, 50))
    return figure


def fronts(names: Mapping[str, Any]) -> Figure:
    """Draw what each algorithm has after the fewest evaluations, over the true front."""
    figure, axis = _panel()
    axis.plot(*names["problem"].pareto_front().T, color=GREY, linewidth=7, label="true front")
    for (label, marker, colour), run in zip(LOOKS, names["runs"], strict=True):
        look = {"color": colour, "markersize": 6, "mfc": "none", "mew": 1.4}
        axis.plot(*run.F.T, marker, label=label, **look)
    low, high = (end(names["problem"].pareto_front(), axis=0) for end in (np.min, np.max))
    # Designs far from the front would press the rest into a corner.
    left, bottom = low - 0.1 * (high - low)
    right, top = high + 0.5 * (high - low)
    axis.set(xlim=(left, right), xlabel="mean DTE [arcsec]")
    axis.set(ylim=(bottom, top), ylabel="std of DTE [arcsec]")
    axis.legend(frameon=False, fontsize=13)
    return figure


def errors(verdict: Mapping[str, Any]) -> Figure:
    """Draw the error on held-out records before and after, by measured quantity."""
    held_out = verdict["held_out"]
    rows = {name.replace("_", " "): error for name, error in held_out["channels"].items()}
    rows["all together"] = held_out["overall"]
    before, after = (
        [error[name] / error["noise_floor"] for error in rows.values()]
        for name in ("before", "after")
    )
    figure, axis = _panel()
    places = range(len(rows))
    axis.axvline(1.0, color="black", linestyle=":", label="noise alone")
    axis.hlines(places, after, before, color=GREY, linewidth=4)
    axis.plot(before, places, "s", color=BEFORE, mfc="none", mew=2, markersize=11, label="model")
    axis.plot(after, places, "o", color=AFTER, markersize=9, label="corrected model")
    axis.set_yticks(places, [*rows], fontsize=14)
    axis.set(xscale="log", xlabel="prediction error / noise", ylim=(len(rows) - 0.5, -0.6))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.legend(frameon=False, fontsize=13, loc="upper right")
    return figure


def drawn(name: str) -> tuple[Figure, str]:
    """Run the example of a picture; return the picture and what was printed."""
    language, word, draw = PICTURES[name]
    (block,) = (block for block in blocks(language) if word in block)
    printed, found = run_python(block) if language == "python" else run_commands(block)
    return draw(found), printed


PICTURES: dict[str, tuple[str, str, Callable[[Mapping[str, Any]], Figure]]] = {
    "beam.png": ("python", "robust_problem(", beams),
    "fronts.png": ("python", "get_problem(", fronts),
    "verdict.png": ("sh", "discrepancy", errors),
}
"""For each picture the language of its example, a word of it, and what draws it."""


def save(figure: Figure, printed: str, target: Path | BinaryIO) -> None:
    """Write a picture with what its example printed."""
    figure.savefig(target, dpi=100, metadata={"Software": None, "Description": printed})


def _panel() -> tuple[Figure, Axes]:
    """Return one panel whose words can be read on a phone."""
    figure = Figure(figsize=(7.2, 3.8), layout="constrained")
    axis = figure.subplots()
    axis.xaxis.label.set_fontsize(14)
    axis.yaxis.label.set_fontsize(14)
    axis.tick_params(labelsize=13)
    axis.spines[["top", "right"]].set_visible(False)
    return figure, axis


def _plain(axis: Axes, ticks: tuple[float, ...]) -> None:
    axis.yaxis.set_major_formatter(ScalarFormatter())
    axis.yaxis.set_minor_formatter(NullFormatter())
    axis.set_yticks(ticks)
    axis.legend(frameon=False, fontsize=13)


if __name__ == "__main__":
    for name in PICTURES:
        save(*drawn(name), DOCS / name)
