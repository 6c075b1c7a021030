"""Evaluate a robust problem from its specification, with nothing but Python.

python read_specification.py resonant.json
"""

import json
import math
import sys
from itertools import product


def chebyshev(t, degree):
    """Return T_0 ... T_degree at t."""
    values = [1.0, t]
    while len(values) <= degree:
        values.append(2.0 * t * values[-1] - values[-2])
    return values


def series(coefficients, degrees, cube):
    """Return the sum of coefficients times products of Chebyshev's polynomials."""
    polynomials = [chebyshev(t, degree) for t, degree in zip(cube, degrees, strict=True)]
    return math.fsum(
        c * math.prod(p) for c, p in zip(coefficients, product(*polynomials), strict=True)
    )


def evaluate(problem, design):
    """Return mean and standard deviation of a design."""
    box = zip(design, problem["lower"], problem["upper"], strict=True)
    cube = [(2.0 * x - lower - upper) / (upper - lower) for x, lower, upper in box]
    mean, variance = (
        series(problem[name], problem[f"{name}_degrees"], cube) for name in ("mean", "variance")
    )
    return mean, math.sqrt(max(variance, 0.0))


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as file:
        problem = json.load(file)
    n, designs = len(problem["variables"]), problem["check_designs"]
    for row in range(0, len(designs), n):
        print(*evaluate(problem, designs[row : row + n]))
