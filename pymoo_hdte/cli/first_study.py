"""A first study of ``pymoo-hdte robust``, which runs as it is and is there to be changed."""

from __future__ import annotations

import errno
import os
from pathlib import Path

from pymoo_hdte.checks import InvalidInput

SIMULATOR_FILE = "beam.py"

STUDY = """\
# A cantilever of a rectangular section: as light as possible, and steady under a load that varies.
title = "Cantilever"

[simulator]
function = "beam:beam"   # MODULE:FUNCTION; the module stands beside this file or is installed
# Or a program, which no shell is asked to start. ${study} is the folder of this file:
# command = ["python3", "${study}/beam.py", "${width}", "${height}", "${load}"]
# responses = ["mass", "stress"]   # the program prints lines such as mass = 9.4
# time_limit_s = 60
# workers = 2

[design.width]           # m
lower = 0.02
upper = 0.06
tolerance = 0.02         # built parts are within 2 %, evenly

[design.height]
lower = 0.04
upper = 0.12
deviation = { distribution = "normal", mean = 0, std = 0.0005 }

[noise.load]             # N
distribution = "normal"
mean = 2000
std = 200

[[objective]]
statistic = "mean"
response = "mass"

[[objective]]
statistic = "std"
response = "stress"

[[constraint]]
statistic = "quantile"
p = 0.99
response = "stress"
at_most = 80e6           # Pa

[surrogate]
accuracy = 0.05          # of mean and standard deviation, as a share of the scatter
budget = 300             # runs at most

[search]
algorithm = "ElitistSwarm"
population = 40
generations = 50
seed = 1
"""

SIMULATOR = '''\
"""A cantilever of steel, 1 m long, with a load at its tip; lengths in m, load in N."""

import sys


def beam(width, height, load):
    """Return mass in kg and largest stress in Pa."""
    return {"mass": 7850.0 * width * height, "stress": 6.0 * load / (width * height**2)}


if __name__ == "__main__":
    for name, value in beam(*map(float, sys.argv[1:])).items():
        print(name, "=", value)
'''


def write_first_study(path: Path) -> tuple[Path, ...]:
    """Write a study and its simulator, replacing nothing; return both paths.

    Raises
    ------
    InvalidInput
        If the study's name does not end in .toml.
    OSError
        If one of them is there, or they cannot be written.
    """
    if path.suffix != ".toml":
        raise InvalidInput("STUDY", str(path), "a file name that ends in .toml")
    files = {path: STUDY, path.with_name(SIMULATOR_FILE): SIMULATOR}
    for file in files:
        if os.path.lexists(file):
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(file))
    for file, text in files.items():
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text)
    return tuple(files)
