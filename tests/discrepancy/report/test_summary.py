"""The ten lines of a verdict say what its document says."""

import json
import re

import numpy as np
import pytest
from measured_oscillator import cubic_analysis
from quick_campaigns import ripple_analysis_and_report

from pymoo_hdte.discrepancy._report.summary import MOST_LINES, summary


def numbers(line):
    """Return the numbers of a line, as a reader parses them."""
    text = line.replace("\N{MINUS SIGN}", "-")
    text = re.sub(
        r"·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)",
        lambda power: "e" + power[1].translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")),
        text,
    )
    return [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", text)]


def effect(name, value, half, unit="N.m", **further):
    parameter = {"value": value, "interval95": [value - half, value + half], "unit": unit}
    return {"name": name, "port": "input", "parameters": {"level": parameter | further}}


def mechanism(effects, held_out=(), limits=()):
    return {
        "status": "named",
        "sentence": "Something is missing.",
        "effects": list(effects),
        "held_out": list(held_out),
        "location": {"sentence": "At the joint."},
        "limits": list(limits),
        "next_experiment": {"description": "Repeat it."},
    }


def error(kind, record, before, after):
    sizes = {"before": before, "after": after, "unit": "rad"}
    return sizes | {"kind": kind, "record": record, "quantity": "joint"}


@pytest.mark.parametrize("report", [ripple_analysis_and_report, cubic_analysis])
def test_every_effect_of_a_verdict_stands_in_its_summary(report):
    document = json.loads(report()[1]["verdict.json"])
    text = summary(document, "report.html")
    assert len(text.splitlines()) <= MOST_LINES
    for effect in document["effects"]:
        (line,) = (
            line for line in text.splitlines() if line.startswith(effect["name"].replace("_", " "))
        )
        shown = numbers(line)
        for name, parameter in effect["parameters"].items():
            if name.endswith("phase") or parameter["unit"] == "rad":
                continue
            for size in (parameter["value"], *parameter["interval95"]):
                width = np.ptp(parameter["interval95"])
                assert min(abs(size - number) for number in shown) <= 0.1 * width + 1e-12


@pytest.mark.parametrize("sizes", [(0.25, 0.01), (-3.0, 0.4), (4.5e-7, 1e-8)])
def test_value_interval_and_unit_are_those_of_the_document(sizes):
    value, half = sizes
    text = summary(mechanism([effect("coulomb_friction", value, half)]), "report.html")
    (line,) = (line for line in text.splitlines() if line.startswith("coulomb friction"))
    assert line.endswith("N.m")
    shown = numbers(line.partition("level")[2].replace("95 %", ""))
    assert shown == pytest.approx([value, value - half, value + half], abs=0.06 * half)


def test_errors_are_root_mean_squares_by_balance_and_by_simulation():
    records = [
        error("balance", "a", 3.0, 0.3),
        error("balance", "b", 4.0, 0.4),
        error("simulation", "a", 1.0, None),
    ]
    lines = summary(mechanism([], records), "report.html").splitlines()
    (balance,) = (line for line in lines if "balance" in line)
    (simulated,) = (line for line in lines if "simulation" in line)
    assert numbers(balance) == pytest.approx([12.5**0.5, 0.125**0.5], rel=5e-3)
    assert numbers(simulated) == [1.0]
    assert "diverges" in simulated


@pytest.mark.parametrize("count", [0, 1, 5, 30])
def test_ten_lines_are_never_exceeded_and_end_with_what_to_do(count):
    effects = [effect(f"effect_{number}", 1.0, 0.1) for number in range(count)]
    document = mechanism(effects, [error("balance", "a", 1.0, 0.5)], ["A limit."] * count)
    lines = summary(document, "out/report.html").splitlines()
    assert len(lines) <= MOST_LINES
    assert lines[-2:] == ["Next: Repeat it.", "Report: out/report.html"]
    shown = sum(line.startswith("effect ") for line in lines)
    assert shown >= min(count, 4)
