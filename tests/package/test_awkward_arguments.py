"""Every public constructor of numbers, arrays and names: a clear refusal or an object, always."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from virtual_rig_cases import BELIEVED, RIG

from pymoo_hdte.algorithms import (
    AMOPSO,
    AMPMOPSO,
    MOPSO,
    MPMOPSO,
    CompactSwarm,
    ElitistSwarm,
)
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.decision import WeightedUtopia
from pymoo_hdte.discrepancy import BelievedDrive, Rig, RunningRecord, TorsionRecord
from pymoo_hdte.drive import KinematicError, hs_20_100, preset
from pymoo_hdte.identification import NoLoadRun, TorsionLoop
from pymoo_hdte.mechanism import BelievedValue, ErrorLine, Gear, Record
from pymoo_hdte.problems import Design, Quantile, RobustDTE
from pymoo_hdte.problems.operating_conditions import OperatingCondition
from pymoo_hdte.surrogate import Box

TIME = np.arange(20.0) / 100.0
WAVE = np.sin(TIME)
LOOP = np.sin(np.linspace(0.0, 2.0 * np.pi, 40))
RUNNING = {
    "name": "run",
    "role": "train",
    "input_speed": 200.0,
    "load_torque": 40.0,
    "sample_rate": 100.0,
    "samples_averaged": 1,
    "elapsed": 0.0,
    **{"time": TIME, "input_angle": WAVE, "output_angle": WAVE},
    **{"input_torque": WAVE, "output_torque": WAVE},
}
SHEET = hs_20_100()


def fields(thing):
    """The arguments of a dataclass that make an equal one."""
    return {one.name: getattr(thing, one.name) for one in dataclasses.fields(thing) if one.init}


VALID = {
    "Nominal": (type(SHEET.nominal), fields(SHEET.nominal)),
    "Mesh": (type(SHEET.mesh), fields(SHEET.mesh)),
    "ErrorSource": (type(SHEET.error_sources[0]), fields(SHEET.error_sources[0])),
    "KinematicError": (KinematicError, fields(preset("calibrated").kinematic_error)),
    "OperatingCondition": (
        OperatingCondition,
        {"input_speed": 1.0, "load_torque": 0.0, "weight": 1.0},
    ),
    "Box": (Box, {"names": ("a", "b"), "lower": (0.0, 1.0), "upper": (1.0, 2.0)}),
    "BelievedDrive": (BelievedDrive, fields(BELIEVED)),
    "Rig": (Rig, fields(RIG)),
    "RunningRecord": (RunningRecord, RUNNING),
    "TorsionRecord": (
        TorsionRecord,
        {one.name: RUNNING[one.name] for one in dataclasses.fields(TorsionRecord)},
    ),
    "TorsionLoop": (
        TorsionLoop,
        {"torque": 40.0 * LOOP, "torsion": 1e-3 * LOOP},
    ),
    "NoLoadRun": (NoLoadRun, {"speed": np.arange(1.0, 6.0), "torque": np.arange(5.0)}),
    "BelievedValue": (BelievedValue, {"value": 1.0, "tolerance": 0.1}),
    "Gear": (Gear, {"ratio": 101.0, "kind": "other", "pole_pairs": 7}),
    "ErrorLine": (ErrorLine, {"coordinate": "q", "order": 2.0, "amplitude": 1e-4, "phase": 0.0}),
    "Record": (
        Record,
        {"name": "a", "role": "train", "time": TIME, "channels": {"q": WAVE}}
        | {"noise": {"q": 1e-3}},
    ),
    "Design": (Design, {"lower": 1.0, "upper": 2.0, "tolerance": 0.1, "scale": "log"}),
    "Quantile": (Quantile, {"p": 0.5}),
    "WeightedUtopia": (WeightedUtopia, {"weights": (0.5, 0.5)}),
    **{
        kind.__name__: (kind, {"pop_size": 10, "archive_size": 10})
        for kind in (MOPSO, AMOPSO, MPMOPSO, AMPMOPSO)
    },
    "CompactSwarm": (CompactSwarm, {"pop_size": 10, "n_result": 20, "n_archive": 30}),
    "ElitistSwarm": (ElitistSwarm, {"pop_size": 10, "n_offsprings": 5}),
    "RobustDTE": (
        RobustDTE,
        {"order": 1, "moments": "exact", "n_samples": 10, "sample_seed": 1, "tolerance": 0.05}
        | {"box": 0.2, "model": "published"},
    ),
}

STRANGE = (np.empty(0), np.empty((0, 3)), np.zeros((20, 1)), np.array(1.0), object())
"""Values that cannot be compared or counted like ordinary ones."""

scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(max_value=5),
    st.sampled_from([10**400, -(10**5000), 2**63, np.int64(-3), np.float32(np.nan)]),
    st.floats(max_value=1e3),
    st.sampled_from([np.inf, 1e308, 1e-320]),
    st.complex_numbers(max_magnitude=10.0),
    st.text(max_size=5),
    st.binary(max_size=3),
)
values = st.one_of(
    scalars,
    st.lists(scalars, max_size=6),
    st.lists(st.lists(st.floats(), max_size=3), max_size=3),
    st.lists(st.floats(), min_size=20, max_size=20).map(np.array),
    st.sampled_from(STRANGE),
    st.dictionaries(st.text(max_size=2), scalars, max_size=2),
)


@pytest.mark.parametrize("name", VALID)
def test_valid_arguments_make_an_object(name):
    constructor, arguments = VALID[name]
    assert constructor(**arguments) is not None


@pytest.mark.parametrize("name", VALID)
@given(data=st.data())
@settings(max_examples=30)
def test_an_awkward_argument_is_refused_by_name_or_taken(name, data):
    field = data.draw(st.sampled_from(sorted(VALID[name][1])))
    assert_refused_or_taken(name, field, data.draw(values))


@pytest.mark.parametrize("name", VALID)
def test_a_strange_argument_is_refused_by_name_or_taken_everywhere(name):
    for field in VALID[name][1]:
        for value in STRANGE:
            assert_refused_or_taken(name, field, value)


def assert_refused_or_taken(name, field, value):
    constructor, arguments = VALID[name]
    refusal = None
    try:
        constructor(**arguments | {field: value})
    except InvalidInput as error:
        refusal = error
    if refusal is not None:
        assert isinstance(refusal.field, str)
        assert refusal.allowed
        assert len(str(refusal)) < 1000
