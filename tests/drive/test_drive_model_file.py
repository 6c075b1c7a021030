"""Drive models on file: bit for bit the same back, whatever their effects; the rest is refused."""

from dataclasses import dataclass, fields, replace
from fractions import Fraction
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from law_cases import LAWS
from places import STORED
from stored_samples import MODEL

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import (
    DampingReference,
    DataSheet,
    DriveModel,
    Eccentricity,
    KinematicError,
    KinematicErrorLine,
    KinematicReaction,
    LawAtPort,
    LoadDependentError,
    LoadInertia,
    MeshStiffnessVariation,
    NewZero,
    ThermalDrift,
)
from pymoo_hdte.drive._effects import drive_effects
from pymoo_hdte.drive.datasheet import ERROR_CLASSES, MEMBERS, ErrorSource, Mesh, Nominal
from pymoo_hdte.effects.bouc_wen import BoucWen
from pymoo_hdte.effects.effect import place_of

any_size = st.floats(allow_nan=False, allow_infinity=False)
at_least_0 = st.floats(min_value=0.0, allow_infinity=False)
above_0 = st.floats(min_value=0.0, exclude_min=True, allow_infinity=False)
# Between the bounds of every law's every field.
share = st.floats(min_value=0.0, max_value=1.0, exclude_max=True)
AT_LEAST_1 = (
    "sharpness",
    "thinning",
    "order",
    "torsion",
    "spread",
    "fading",
    "exponent",
    "reference",
)
OF_LOOPS = {"exponent": st.floats(0.5, 8.0), "share": st.floats(0.0, 2.0, exclude_min=True)}
"""Of a loop that forgets, which has limits of its own."""
texts = st.text(min_size=1).filter(str.strip)


def laws():
    def of(name, port):
        kind = LAWS[name].law
        values = {
            field.name: st.floats(min_value=1.0, allow_infinity=False)
            if field.name in AT_LEAST_1
            else share
            for field in fields(kind)
            if field.init and field.name != "locked"
        }
        values |= OF_LOOPS if kind is BoucWen else {}
        # A time constant, where a law has one, is above zero.
        values |= {"time": above_0} if "time" in values else {}
        return st.builds(LawAtPort, st.just(name), st.just(port), st.builds(kind, **values))

    return st.one_of(*(of(name, port) for name, effect in LAWS.items() for port in effect.ports))


effects = st.one_of(
    st.builds(LoadInertia, at_least_0),
    st.builds(DampingReference, above_0),
    st.builds(MeshStiffnessVariation, share, any_size, above_0),
    st.builds(KinematicErrorLine, above_0, any_size, any_size),
    st.builds(KinematicReaction, any_size),
    st.builds(LoadDependentError, above_0, any_size, any_size, above_0),
    st.builds(Eccentricity, any_size, any_size, above_0),
    st.builds(ThermalDrift, any_size, st.one_of(above_0, st.just(np.inf))),
    st.builds(NewZero, any_size, any_size),
    laws(),
)

sheets = st.builds(
    DataSheet,
    texts,
    texts,
    # Even numbers differ by an even number, as they must.
    st.integers(1, 100).map(lambda half: 2 * half),
    st.integers(101, 2**69).map(lambda half: 2 * half),
    st.sampled_from(MEMBERS),
    above_0,
    at_least_0,
    st.builds(Nominal, *[above_0] * 7),
    st.builds(Mesh, above_0, st.integers(1, 2**70), above_0, share),
    st.lists(
        st.builds(
            ErrorSource,
            texts,
            texts,
            texts,
            st.sampled_from(ERROR_CLASSES),
            at_least_0,
            at_least_0,
        ),
        min_size=1,
        max_size=3,
        unique_by=lambda source: source.symbol,
    ).map(tuple),
    st.sampled_from((None, *MEMBERS)),
)
errors = st.integers(1, 4).flatmap(
    lambda n: st.builds(
        KinematicError,
        *(st.tuples(*[size] * n) for size in (above_0, above_0, any_size)),
        st.sampled_from(("peak_to_peak", "semi_amplitude")),
        above_0,
    )
)
models = st.builds(
    DriveModel,
    texts,
    texts,
    texts,
    sheets,
    errors,
    st.lists(effects, max_size=6, unique_by=place_of).map(tuple),
)


def bits(value):
    """Return a value with floats as their bits: equality holds -0.0 and 0.0 for the same."""
    if hasattr(value, "__dataclass_fields__"):
        return type(value), [bits(getattr(value, field.name)) for field in fields(value)]
    if isinstance(value, tuple):
        return [bits(one) for one in value]
    return value.hex() if isinstance(value, float) else value


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(model=models)
def test_a_round_trip_changes_no_bit(model, tmp_path):
    model.save(tmp_path / "model.npz")
    loaded = DriveModel.load(tmp_path / "model.npz")
    assert loaded == model
    assert bits(loaded) == bits(model)


def test_a_file_of_version_1_still_holds_its_model():
    loaded = DriveModel.load(STORED / "drive_model_version_1.npz")
    assert bits(loaded) == bits(MODEL)
    later = {
        "load_dependent_friction",
        "temperature_dependent_friction",
        "new_zero",
        "presliding_friction",
        "coupled_inertia",
        "load_dependent_error",
        "load_dependent_damping",
        "shear_thinning_drag",
        "bouc_wen_hysteresis",
        "gravity",
        "changed_static_error",
        "uneven_load_sharing",
    }
    known = {one.name for one in drive_effects() if not one.is_of_bench}
    assert {effect.name for effect in loaded.effects} == known - later
    linear = replace(loaded, effects=loaded.effects[:3])
    assert linear.dte_arcsec(linear.nominal[None]) == pytest.approx([84.94011189669799], rel=1e-9)


def test_presets_answer_alike_when_loaded(model, tmp_path):
    model.save(str(tmp_path / "no_suffix"))
    assert [file.name for file in tmp_path.iterdir()] == ["no_suffix"]
    loaded = DriveModel.load(tmp_path / "no_suffix")
    assert loaded == model
    designs = model.nominal * np.array([[1.0], [0.9]])
    assert loaded.dte_arcsec(designs).tobytes() == model.dte_arcsec(designs).tobytes()


def test_numbers_of_other_libraries_become_python_s(tmp_path):
    sheet = replace(MODEL.sheet, circular_spline_teeth=np.int64(162), load_torque=Fraction(1, 4))
    odd = replace(MODEL, sheet=sheet, effects=[LoadInertia(np.float32(0.1))])
    odd.save(tmp_path / "model.npz")
    loaded = DriveModel.load(tmp_path / "model.npz")
    assert loaded.sheet == sheet
    assert type(loaded.sheet.load_torque) is float
    assert loaded.effects == (LoadInertia(float(np.float32(0.1))),)


class Heavier(LoadInertia):
    pass


@dataclass(frozen=True)
class Wobble:
    name: ClassVar[str] = "wobble"

    def apply(self, coefficients):
        return coefficients

    def to_dict(self):
        return {"name": self.name}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"effects": (Wobble(),)}, "name is 'wobble', allowed: one of '"),
        ({"effects": (Heavier(0.1),)}, "effects is .*Heavier"),
        ({"provenance": ""}, "model.provenance is '', allowed: a non-empty string"),
        ({"description": 7}, "model.description is 7"),
        ({"sheet": replace(MODEL.sheet, error_sources=())}, "data_sheet.error_source is"),
        ({"description": "long" * 2**16}, "at most 262144 characters"),
    ],
)
def test_what_a_file_cannot_give_back_is_not_written(tmp_path, changes, message):
    MODEL.save(tmp_path / "model.npz")
    before = (tmp_path / "model.npz").read_bytes()
    with pytest.raises(InvalidInput, match=message):
        replace(MODEL, **changes).save(tmp_path / "model.npz")
    assert (tmp_path / "model.npz").read_bytes() == before
