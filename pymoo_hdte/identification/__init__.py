"""From measurements to parameters: error statistics of prototypes, stiffness and damping.

Knows the drive's units and data sheet, nothing of surrogates or of pymoo. `records` says which CSV
files a user can bring; `experiments.paper.bench` makes records with known truth.
"""

from pymoo_hdte.identification.damping import NoLoadRun, bearing_damping, mesh_damping
from pymoo_hdte.identification.error_samples import (
    ErrorStatistics,
    detectable_correlation,
    error_statistics,
)
from pymoo_hdte.identification.joint_sampling import draw_errors
from pymoo_hdte.identification.linear_fit import LinearFit, fit_line
from pymoo_hdte.identification.outliers import find_outliers, largest_deviation
from pymoo_hdte.identification.prototypes import NormalSample, Series, series
from pymoo_hdte.identification.records import (
    read_error_measurements,
    read_no_load_runs,
    read_torsion_loops,
)
from pymoo_hdte.identification.torsion import (
    TorsionLoop,
    hysteresis_width,
    loop_branches,
    lost_energy,
    stiffness,
    stiffness_between,
)

__all__ = [
    "ErrorStatistics",
    "LinearFit",
    "NoLoadRun",
    "NormalSample",
    "Series",
    "TorsionLoop",
    "bearing_damping",
    "detectable_correlation",
    "draw_errors",
    "error_statistics",
    "find_outliers",
    "fit_line",
    "hysteresis_width",
    "largest_deviation",
    "loop_branches",
    "lost_energy",
    "mesh_damping",
    "read_error_measurements",
    "read_no_load_runs",
    "read_torsion_loops",
    "series",
    "stiffness",
    "stiffness_between",
]
