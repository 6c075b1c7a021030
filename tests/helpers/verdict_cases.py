"""Campaigns on which the verdict was once wrong, and mends of it that can be taken out again.

The truth of the campaigns stands beside the data. Functions that take out a mend get a
``MonkeyPatch``, whose end puts it back.
"""

from dataclasses import replace

import numpy as np
import pytest
from places import SHARED
from quick_campaigns import CONDITIONS
from virtual_rig_cases import BELIEVED, RIG, true_rig

from experiments.studies.virtual_rig.rig import run_campaign
from pymoo_hdte.discrepancy import read_campaign
from pymoo_hdte.discrepancy._answers.where import location
from pymoo_hdte.discrepancy._evidence.order_lines import evidence
from pymoo_hdte.discrepancy._records.cleaning.findings import RowFindings
from pymoo_hdte.discrepancy._selection import fitting
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._verdicts import drive as analysis


def case_campaign(name):
    """Read a campaign from beside the project, or make the one that is not there.

    In ``amplitude-off`` the amplitude of order 2 of the static error is 60 % larger than believed.
    """
    if name == "amplitude-off":
        first, second, third = BELIEVED.error_amplitudes
        rig = true_rig(error_amplitudes=(first, 1.6 * second, third))
        return run_campaign(rig, BELIEVED, RIG, np.random.default_rng(8), CONDITIONS)
    folder = SHARED / ("rig" if name.startswith("rig") else "cases/campaigns") / name
    if not folder.is_dir():
        pytest.skip(f"needs {folder}, which is no part of the project")
    return read_campaign(folder)


def one_step(patch):
    """Fits end after one step, converged or not."""
    minimum = fitting.minimum

    def unfinished(problem, start, steps, settled=0.0, known=(), hopeless=0.0):
        return minimum(problem, start, 1, settled)

    patch.setattr(fitting, "minimum", unfinished)


def rows_are_believed(patch):
    """Rows and stated noise are taken on faith."""
    patch.setattr(
        analysis, "cleaned_rows", lambda campaign, expected, rules: (campaign, RowFindings())
    )


def one_effect_at_a_port(patch):
    """A second effect at the same port is barred."""
    patch.setattr(Candidate, "goes_with", lambda self, other: self.port != other.port)


def amplitudes_are_never_wrong(patch):
    """Amplitudes of the believed static error cannot be out of tolerance."""
    names = evidence.out_of_tolerance

    def without_lines(base, at_bounds, *further):
        bounds = [name for name in at_bounds if not name.startswith("error_amplitude")]
        return names(base, bounds, *further)

    patch.setattr(evidence, "out_of_tolerance", without_lines)


def quadratic_drag_only(patch):
    """Drag grows with the square of the speed."""

    def quadratic(one):
        if one.name != "nonlinear_drag":
            return one
        level, exponent = one.parameters
        exponent = replace(exponent, lower=2.0 - 1e-6, upper=2.0 + 1e-6, start=2.0)
        return replace(one, parameters=(level, exponent), starts=((level.start, 2.0),))

    _with_library(patch, lambda found: [quadratic(one) for one in found if not one.form])


def no_friction_that_grows_with_load(patch):
    """Friction in proportion to the load is in no list."""
    name = "load_dependent_friction"
    _with_library(patch, lambda found: [one for one in found if one.name != name])


def freed_values_are_believed(patch):
    """What a fit freed of its tolerance counts as believed where the misfit is located."""
    patch.setattr(location, "within_tolerance", lambda data, values: values[: len(data.base)])


def _with_library(patch, change):
    library = analysis.drive_candidates
    patch.setattr(analysis, "drive_candidates", lambda *given: change(library(*given)))
