"""Draw docs/beam.png, the first picture of the README: the front of its first example."""

import re
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, ScalarFormatter

PICTURE = Path(__file__).with_name("beam.png")
README = Path(__file__).parents[1] / "README.md"


def draw(target: Path = PICTURE) -> None:
    """Run the first example of the README and draw its front and the beams on it."""
    example = re.search(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    found: dict = {}
    exec(compile(example[1], "README.md", "exec"), found)
    problem, result = found["problem"], found["result"]
    F, band = problem.evaluate(result.X, return_values_of=["F", "F_band"])
    rows = F[:, 0].argsort()
    mass, deflection, error = F[rows, 0], 1e3 * F[rows, 1], 1e3 * band[rows, 1]
    figure = Figure(figsize=(9.6, 3.0), layout="constrained")
    front, designs = figure.subplots(1, 2)
    known = f"robust designs, each known to {(error / deflection).max():.1%}"
    front.plot(mass, deflection, ".", color="#0072B2", markersize=4, label=known)
    front.set(xlabel="mean mass [kg]", ylabel="deflection, mean + 3 std [mm]", yscale="log")
    front.yaxis.set_major_formatter(ScalarFormatter())
    front.yaxis.set_minor_formatter(NullFormatter())
    front.set_yticks([2, 5, 10, 20, 50])
    front.legend(frameon=False, fontsize=9)
    for place, name in enumerate(problem.var_names):
        designs.plot(mass, 1e3 * result.X[rows, place], ".", markersize=4, label=name)
    designs.set(xlabel="mean mass [kg]", ylabel="size [mm]")
    designs.legend(frameon=False, fontsize=9)
    figure.savefig(target, dpi=100, metadata={"Software": None})


if __name__ == "__main__":
    draw()
