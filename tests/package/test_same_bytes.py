"""`.ci/same_bytes` tells words from numbers: its projection, and what it says of two folders."""

import importlib.util
import json
from importlib.machinery import SourceFileLoader

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from places import ROOT

LOADER = SourceFileLoader("same_bytes", str(ROOT / ".ci" / "same_bytes"))
same_bytes = importlib.util.module_from_spec(importlib.util.spec_from_loader("same_bytes", LOADER))
LOADER.exec_module(same_bytes)

VERDICT = {
    "status": "named",
    "sentence": "A ripple at the input.",
    "effects": [{"name": "torque_ripple", "amplitude": {"value": 0.015, "unit": "N.m"}}],
    "shown": True,
    "reason": None,
}


def folder(verdict, **texts):
    files = {"verdict.json": json.dumps(verdict)} | {
        name.replace("_", "."): text for name, text in texts.items()
    }
    return {name: text.encode() for name, text in files.items()}


def test_equal_folders_have_the_same_bytes():
    assert same_bytes.compared(folder(VERDICT), folder(VERDICT)) == "same bytes"


def test_other_words_are_the_same_numbers():
    reworded = VERDICT | {"sentence": "The input torque ripples.", "doubts": ["none"]}
    said = same_bytes.compared(folder(VERDICT), folder(dict(reversed(reworded.items()))))
    assert said.startswith("same numbers")
    assert "verdict.json" in said


@pytest.mark.parametrize(
    ("changed", "key"),
    [
        ({"effects": [{**VERDICT["effects"][0], "amplitude": {"value": 0.016, "unit": "N.m"}}]},
         "effects[0].amplitude.value: 0.015 -> 0.016"),
        ({"effects": [{**VERDICT["effects"][0], "name": "coulomb_friction"}]}, "effects[0].name"),
        ({"effects": []}, "effects[0].amplitude.value: 0.015 -> absent"),
        ({"status": "class"}, "status: 'named' -> 'class'"),
        ({"shown": 1}, "shown: True -> 1"),
        ({"probability": 0.9}, "probability: absent -> 0.9"),
        ({"reason": 0}, "reason: None -> 0"),
    ],
)  # fmt: skip
def test_a_number_or_a_code_that_changed_is_told_by_its_key(changed, key):
    said = same_bytes.compared(folder(VERDICT), folder(VERDICT | changed))
    assert said.startswith("differs")
    assert f"verdict.json {key}" in said or f"; verdict.json {key}" in said


def test_the_largest_change_of_a_number_is_told():
    said = same_bytes.compared(folder({"a": 2.0, "b": 1}), folder({"a": 2.0 + 2e-12, "b": 1}))
    assert said.startswith("differs (numbers by up to 1e-12 of themselves)")
    assert "by up to inf" in same_bytes.compared(folder({"a": 2.0}), folder({"a": None}))
    assert "by up to inf" in same_bytes.compared(folder({"a": 2.0}), folder({"a": float("nan")}))
    assert "by up to 1 " in same_bytes.compared(folder({"a": 0.0}), folder({"a": 1e-30}))


@given(st.floats(allow_infinity=False), st.floats(allow_infinity=False))
@example(0.0, -0.0)
def test_numbers_are_the_same_if_they_are_written_alike(one, other):
    said = same_bytes.compared(folder({"a": one, "b": ""}), folder({"a": other, "b": "x"}))
    assert said.startswith("same numbers") == (repr(one) == repr(other))


def test_all_kinds_of_files_are_compared():
    page = "<p>{} 7</p><table><tr><td>{}</td><td>0.5 [0.4, {}]</td></tr></table>"
    before = folder(
        VERDICT, model_toml="K = 2.0\nname = 'revised'", table_csv="a,b\n1,x\n2,y",
        report_html=page.format("Old", "a", 0.6), picture_svg="<svg/>",
    )  # fmt: skip
    reworded = folder(
        VERDICT, model_toml="name = 'revised'\nK = 2.0 # N.m", table_csv="a,b\n1,xx\n2,yy",
        report_html=page.format("New", "b", 0.6), picture_svg="<svg> </svg>",
    )  # fmt: skip
    assert same_bytes.compared(before, reworded).startswith("same numbers")
    for name, text, key in (
        ("model.toml", "K = 3.0\nname = 'revised'", "K: 2.0 -> 3.0"),
        ("table.csv", "a,b\n1,x\n3,y", "row 1, column 0: 2.0 -> 3.0"),
        ("report.html", page.format("Old", "a", 0.7), "table 0, row 0, cell 1"),
    ):
        said = same_bytes.compared(before, before | {name: text.encode()})
        assert said.startswith("differs")
        assert f": {name} {key}" in said
    del reworded["picture.svg"]
    assert "picture.svg is in one only" in same_bytes.compared(before, reworded)


def test_a_second_table_has_numbers_of_its_own():
    page = (
        b"<table><tr><td>1</td></tr></table><table><tr><td>2</td></tr><tr><td>3</td></tr></table>"
    )
    assert same_bytes.numbers("report.html", page) == {
        "table 0, row 0, cell 0": "1",
        "table 1, row 0, cell 0": "2",
        "table 1, row 1, cell 0": "3",
    }


def test_only_parts_and_cases_that_are_there_can_be_asked_for():
    assert same_bytes.chosen(["swarms/MOPSO", "table7"]) == [
        ("table7", "quick"),
        ("swarms", "MOPSO"),
    ]
    with pytest.raises(SystemExit, match="swarms/none"):
        same_bytes.chosen(["swarms/none"])
    assert len(same_bytes.chosen(["blind"])) == 24
