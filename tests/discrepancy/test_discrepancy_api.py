"""The calls that users make: one analysis from the measurement to the report, of any machine."""

import json
import subprocess
import sys
from dataclasses import replace

import pytest
from kept_results import put_files
from measured_oscillator import OSCILLATOR, cubic, cubic_analysis, record_of
from quick_campaigns import ripple_analysis_and_report, ripple_campaign

import pymoo_hdte.discrepancy
from pymoo_hdte._lazy import lazy_names
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import (
    MeasuredMechanism,
    analyse,
    read_drive_model,
    read_mechanism_model,
)
from pymoo_hdte.discrepancy import analysis as drive_analysis
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.drive import load_datasheet, load_model
from pymoo_hdte.effects import Effect, effect_named, registered
from pymoo_hdte.effects.friction import CoulombFriction


@pytest.fixture(scope="module")
def campaign():
    return ripple_campaign()


@pytest.fixture(scope="module")
def analysis():
    return ripple_analysis_and_report()[0]


@pytest.fixture(scope="module")
def reported(tmp_path_factory):
    out = tmp_path_factory.mktemp("reported") / "report"
    put_files(ripple_analysis_and_report()[1], out)
    return out, json.loads((out / "verdict.json").read_text())


# --- names --------------------------------------------------------------------------------------


def test_every_name_of_a_stub_is_there_and_no_other():
    assert {"analyse", "read_campaign", "read_rig"} <= set(pymoo_hdte.discrepancy.__all__)
    for name in pymoo_hdte.discrepancy.__all__:
        assert getattr(pymoo_hdte.discrepancy, name).__name__ == name
    assert set(pymoo_hdte.discrepancy.__all__) < set(dir(pymoo_hdte.discrepancy))
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = pymoo_hdte.discrepancy.nonsense


def test_lazy_names_come_from_the_stub(tmp_path, monkeypatch):
    (tmp_path / "lazily").mkdir()
    (tmp_path / "lazily" / "__init__.py").write_text("")
    stub = "from math import (\n    pi,\n    tau,\n)\nfrom fractions import Fraction\n"
    (tmp_path / "lazily" / "__init__.pyi").write_text(stub)
    monkeypatch.syspath_prepend(tmp_path)
    import lazily

    get, names, public = lazy_names("lazily", lazily.__file__)
    assert public == ["Fraction", "pi", "tau"]
    assert not hasattr(lazily, "pi")
    assert get("tau") == 2.0 * get("pi") == 2.0 * lazily.pi
    assert {"__name__", "Fraction", "pi"} <= set(names())


def test_the_package_imports_nothing_before_a_name_is_used():
    code = "import sys, pymoo_hdte.discrepancy; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert not {"numpy", "scipy", "pymoo_hdte.drive"} & set(done.stdout.split())


# --- one analysis -------------------------------------------------------------------------------


def as_written(part):
    """Return a part of a document as a file has it, with lists for tuples."""
    return json.loads(json.dumps(part))


def test_a_drive_from_verdict_to_report(analysis, reported):
    out, document = reported
    assert analysis.verdict.status == document["status"] == "named"
    assert document["location"] == as_written(analysis.locate().summary())
    assert document["held_out"] == as_written(analysis.validate().as_dict())
    assert document["next_experiment"] == as_written(analysis.next_experiment().as_dict())
    assert next(iter(document.items())) == ("schema_version", 1)
    sheet = load_datasheet(out / "revised_model_sheet.toml")
    assert load_model(out / "revised_model.toml", sheet) == analysis.revised_model()
    assert read_drive_model(out / "revised_model.toml") == analysis.revised_model()


@pytest.mark.nightly
def test_a_mechanism_from_verdict_to_report(tmp_path):
    of_mechanism, _ = cubic_analysis()
    document = of_mechanism.report(tmp_path / "report")
    assert of_mechanism.verdict.status == document["status"] == "named"
    assert document["location"] == of_mechanism.locate().summary()
    assert document["held_out"] == [error.as_dict() for error in of_mechanism.validate()]
    assert document["next_experiment"] == of_mechanism.next_experiment().as_dict()
    assert next(iter(document.items())) == ("schema_version", 1)
    written = read_mechanism_model(tmp_path / "report" / "revised_model.toml")
    assert written == of_mechanism.revised_model()


def test_nothing_is_worked_out_twice(analysis, reported, monkeypatch):
    def again(*_):
        raise AssertionError("worked out twice")

    for name in ("locate", "validate_drive", "next_experiment"):
        monkeypatch.setattr(drive_analysis, name, again)
    assert analysis.locate() is analysis.locate()
    assert analysis.validate() is analysis.validate()
    assert analysis.next_experiment() is analysis.next_experiment()


def test_other_things_are_not_analysed():
    with pytest.raises(InvalidInput, match="measured is 'str', allowed: a Campaign, a"):
        analyse("campaign")


class OwnFriction(CoulombFriction):
    """A law of the user's."""


@pytest.mark.nightly
def test_effects_of_the_user_are_looked_for_and_known_from_then_on(campaign):
    asked = []

    def guess(sizes):
        asked.append(sizes)
        return []

    # What the verdict is, is not asked for: it need not be searched for.
    rules = replace(RULES, most_fitted=1, most_effects=1)
    own = Effect("own_effect", OwnFriction, ("input",), {"level": "torque"}, "Own.", guess)
    with registered():
        analyse(replace(campaign, running=campaign.running[:4], torsion=()), [own], rules)
        (of_drive,) = {one.stiffness for one in asked}
        assert of_drive == campaign.believed.stiffness
        asked.clear()
        analyse(MeasuredMechanism(OSCILLATOR, [record_of(cubic)]), [own], rules)
        assert {one.stiffness for one in asked} == {OSCILLATOR.ports[0].stiffness.value}
        assert effect_named("own_effect") is own
    with pytest.raises(InvalidInput, match=r"effect\.name is 'own_effect'"):
        effect_named("own_effect")
