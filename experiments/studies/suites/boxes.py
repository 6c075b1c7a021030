"""Ideal and nadir points of the problems whose fronts have no closed form.

``python -m experiments.studies.suites.boxes`` finds them anew, in some minutes: the front of what
NSGA-II and the compact swarm find together in long runs. They fix units and the reference point of
the hypervolume, and are no fronts.
"""

from __future__ import annotations

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize

from experiments.runner.committed import DATA, table_with_origin
from experiments.studies.suites.problems import BOXES, PROBLEMS
from pymoo_hdte._comparing.indicators import front_among
from pymoo_hdte._runner.store import write_atomically
from pymoo_hdte.algorithms import CompactSwarm

EVALUATIONS, SEED = 20_000, 101


def main() -> None:
    """Write the table."""
    rows = []
    for member in PROBLEMS.values():
        if member.front is None:
            problem = member.make()
            algorithms = CompactSwarm(), NSGA2(pop_size=100)
            runs = [minimize(problem, a, ("n_eval", EVALUATIONS), seed=SEED) for a in algorithms]
            fronts = [np.atleast_2d(run.F) for run in runs if run.F is not None]
            front = front_among(np.concatenate(fronts))
            ends = zip(front.min(axis=0), front.max(axis=0), strict=True)
            rows += [
                [member.name, 1 + number, f"{low:.6g}", f"{high:.6g}"]
                for number, (low, high) in enumerate(ends)
            ]
    facts = {"command": "python -m experiments.studies.suites.boxes", "evaluations": EVALUATIONS}
    text = table_with_origin(["problem", "objective", "ideal", "nadir"], rows, **facts)
    write_atomically(DATA / f"{BOXES}.csv", text.encode())


if __name__ == "__main__":
    main()
