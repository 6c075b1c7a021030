"""CSV records: what is written is read back, and every fault is named with file and line."""

import numpy as np
import pytest

from experiments.paper.bench.rigs import INPUT_BEARING, TorsionBench
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.identification import read_error_measurements, read_no_load_runs, read_torsion_loops
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

TORQUES = [0, 10, 20, 30, 40, 30, 20, 10, 0, -10, -20, -30, -40, -30, -20, -10, 0]


def loop_lines(torques=TORQUES, header="prototype,repeat,time_s,torque_Nm,torsion_arcsec"):
    rows = [f"1,1,{time},{torque},{8 * torque}" for time, torque in enumerate(torques)]
    return [header, *rows]


def speed_lines(speeds=(200, 400, 600)):
    return ["prototype,repeat,speed_r_min,torque_Nm", *(f"1,1,{s},{s / 1e4}" for s in speeds)]


def error_lines():
    rows = [f"{p},{r},{p + r / 10},{p - r / 10}" for p in (1, 2) for r in (1, 2, 3)]
    return ["prototype,repeat,dFp1_um,e13_um", *rows]


def write(tmp_path, lines):
    path = tmp_path / "record.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_torsion_loops_come_back_as_written(tmp_path, rng):
    loops = {(p, r): TorsionBench().record(2.5e4, rng) for p in (1, 2) for r in (1, 2)}
    rows = ["torsion_arcsec,repeat,operator,prototype,torque_Nm"]
    for (prototype, repeat), loop in loops.items():
        for torque, torsion in zip(loop.torque.tolist(), loop.torsion.tolist(), strict=True):
            rows.append(f"{torsion / ARCSEC!r},{repeat},Ann,{prototype},{torque!r}")
    read = read_torsion_loops(write(tmp_path, rows))
    assert list(read) == list(loops)
    for key, loop in loops.items():
        np.testing.assert_array_equal(read[key].torque, loop.torque)
        np.testing.assert_allclose(read[key].torsion, loop.torsion, rtol=1e-15, atol=1e-20)


def test_no_load_runs_come_back_as_written(tmp_path, rng):
    run = INPUT_BEARING.record(1.7e-4, rng)
    rows = ["prototype,repeat,speed_r_min,torque_Nm"]
    for speed, torque in zip(run.speed.tolist(), run.torque.tolist(), strict=True):
        rows.append(f"3,1,{speed / REVOLUTION_PER_MINUTE!r},{torque!r}")
    (key, read), *rest = read_no_load_runs(write(tmp_path, rows)).items()
    assert key == (3, 1)
    assert not rest
    np.testing.assert_allclose(read.speed, run.speed, rtol=1e-15)
    np.testing.assert_array_equal(read.torque, run.torque)


def test_error_measurements_come_back_as_an_array(tmp_path):
    readings, symbols = read_error_measurements(write(tmp_path, error_lines()))
    assert symbols == ("dFp1", "e13")
    assert readings.shape == (2, 2, 3)
    assert readings[1].tolist() == [[2.1, 2.2, 2.3], [1.9, 1.8, 1.7]]


def replaced(lines, number, line):
    """The lines with one other at this line number; None leaves it out."""
    return [*lines[: number - 1], *([] if line is None else [line]), *lines[number:]]


BAD_LOOPS = {
    "missing column": (
        replaced(loop_lines(), 1, "prototype,repeat,time_s,torque,torsion_arcsec"),
        "line 1: columns",
        "torque_Nm",
    ),
    "doubled column": (
        replaced(loop_lines(), 1, "prototype,repeat,torque_Nm,torque_Nm,torsion_arcsec"),
        "line 1: columns",
        "each once",
    ),
    "text": (replaced(loop_lines(), 4, "1,1,2,high,160"), "line 4: torque_Nm is 'high'", "finite"),
    "NaN": (replaced(loop_lines(), 5, "1,1,3,30,nan"), "line 5: torsion_arcsec is 'nan'", "finite"),
    "infinite": (replaced(loop_lines(), 5, "1,1,3,30,inf"), "line 5: torsion_arcsec", "finite"),
    "empty cell": (
        replaced(loop_lines(), 5, "1,1,3,30,"),
        "line 5: torsion_arcsec is ''",
        "number",
    ),
    "short row": (replaced(loop_lines(), 6, "1,1,4,40"), "line 6: number of cells is 4", "5"),
    "time": (replaced(loop_lines(), 7, "1,1,4,30,240"), "line 7: time_s is 4.0", "above 4, rising"),
    "half a prototype": (replaced(loop_lines(), 7, "1.5,1,5,30,240"), "line 7: prototype", "whole"),
    "no rows": (loop_lines()[:1], "line 1: rows below the header is 0", "at least 1"),
    "scattered rows": (
        [
            *loop_lines(),
            *(line.replace("1,1", "1,2", 1) for line in loop_lines()[1:]),
            "1,1,99,0,0",
        ],
        r"line 36: \(prototype, repeat\)",
        "next to each other",
    ),
    "never unloads": (
        loop_lines([0, 10, 20, 30, 40] + 12 * [40]),
        "lines 2 to 18: range of torque is",
        "unloads",
    ),
    "stops at the trough": (
        loop_lines(TORQUES[:13]),
        r"lines 2 to 14: torque\[12\] is -40.0",
        "unloaded",
    ),
    "reverse first": (
        loop_lines([-torque for torque in TORQUES]),
        "lines 2 to 18: sample of the lowest torque is 4",
        "forward first",
    ),
    "two loops": (
        loop_lines([*TORQUES, *TORQUES[1:]]),
        "lines 2 to 34: setback at torque",
        "one loop",
    ),
}

BAD_SPEEDS = {
    "too few": (speed_lines((200, 400)), "lines 2 to 3: number of speeds is 2", "at least 3"),
    "not rising": (speed_lines((200, 600, 400)), "line 4: speed_r_min is 400.0", "above 600"),
}

BAD_ERRORS = {
    "no errors": (
        [line.replace("_um", "_mm") for line in error_lines()],
        "line 1: columns",
        "ends in _um",
    ),
    "a repeat twice": (replaced(error_lines(), 3, "1,1,1,1"), "line 3: repeat is 1", "once"),
    "a repeat too few": (
        replaced(error_lines(), 7, None),
        "line 5: repeats of prototype 2 is 2",
        "3, as for the others",
    ),
    "text": (replaced(error_lines(), 2, "1,1,?,0.9"), r"line 2: dFp1_um is '\?'", "finite"),
}

CASES = [
    pytest.param(read, *case, id=f"{read.__name__}: {name}")
    for read, cases in (
        (read_torsion_loops, BAD_LOOPS),
        (read_no_load_runs, BAD_SPEEDS),
        (read_error_measurements, BAD_ERRORS),
    )
    for name, case in cases.items()
]


@pytest.mark.parametrize(("read", "lines", "field", "allowed"), CASES)
def test_a_bad_file_is_refused_with_its_line(tmp_path, read, lines, field, allowed):
    with pytest.raises(InvalidInput, match=f"record.csv, {field}.*allowed: .*{allowed}"):
        read(write(tmp_path, lines))


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"", r"line 1: columns is \[\]"), (b"prototype,repeat\n1,\x81\n", "UTF-8")],
)
def test_files_that_are_no_csv_text_are_refused(tmp_path, content, message):
    path = tmp_path / "record.csv"
    path.write_bytes(content)
    with pytest.raises(InvalidInput, match=message):
        read_torsion_loops(path)


def test_good_examples_are_accepted(tmp_path):
    """The cases above start from files that are good, so each fault is the one planted."""
    assert len(read_torsion_loops(write(tmp_path, loop_lines()))) == 1
    assert len(read_no_load_runs(write(tmp_path, speed_lines()))) == 1
