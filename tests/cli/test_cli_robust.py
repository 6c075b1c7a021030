"""``pymoo-hdte robust``: studies of functions and of programs, from their file to the report."""

import csv
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import closing
from functools import partial

import numpy as np
import pytest
from places import DOCS, ROOT
from scipy.stats import norm

from pymoo_hdte._interrupts import INTERRUPTED
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.cli import program
from pymoo_hdte.cli.program import Program, responses_in
from pymoo_hdte.cli.robust_study import read_study
from pymoo_hdte.problems._simulator.children import TOO_LONG
from pymoo_hdte.problems._simulator.workers import Workers

PAGE = (DOCS / "command_line.md").read_text(encoding="utf-8")
INPUTS = """
[design.x]
lower = 1
upper = 2
deviation = { distribution = "normal", mean = 0, std = 0.05 }
[noise.load]
distribution = "uniform"
lower = 2
upper = 4
"""
GOALS = """
[[objective]]
statistic = "mean"
response = "cost"
[[objective]]
statistic = "std"
response = "cost"
[[constraint]]
statistic = "mean"
response = "height"
at_least = 4.5
[search]
population = 12
generations = 8
"""
OF_FUNCTION = '[simulator]\nfunction = "steps_of_a_test:staircase"\n'
CASES = """
[[scenarios]]
names = ["a", "b"]
rows = [[1, 2], [3, 4]]
"""
TWO_EVENTS = """[[constraint]]
statistic = "failure_probability"
any_of = [{ response = "cost", above = 3 }]
all_of = [{ response = "height", below = 1 }]
at_most = 0.1
[search]"""
STAIRCASE = """
def staircase(x, load):
    return {"cost": x * load, "height": load * x**2}
"""
PROGRAM = """
import sys
x, load = map(float, sys.argv[1:])
print("solver 3.1 done")
print("cost =", x * load)
print("height:", str(load * x**2).replace("e", "D"))
"""
OF_PROGRAM = """[simulator]
command = [{python}, "-I", "-S", "${{study}}/solve.py", "${{x}}", "${{load}}"]
responses = ["cost", "height"]
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with both kinds of simulators, in which the commands run."""
    monkeypatch.chdir(tmp_path)
    # A file that is written again within a second, and as long, would be taken for the one before.
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    (tmp_path / "steps_of_a_test.py").write_text(STAIRCASE)
    (tmp_path / "solve.py").write_text(PROGRAM)
    return tmp_path


def written(folder, simulator=OF_FUNCTION, inputs=INPUTS, goals=GOALS, name="study.toml"):
    path = folder / name
    path.write_text(simulator + inputs + goals)
    return path


def of_program(**others):
    python = json.dumps(sys.executable)
    return OF_PROGRAM.format(python=python) + "".join(f"{k} = {v}\n" for k, v in others.items())


def robust(*arguments):
    return cli.main(["robust", *map(str, arguments)])


def rows_of(path):
    with path.open(newline="") as stream:
        header, *rows = csv.reader(stream)
    return header, np.array(rows, dtype=float)


@pytest.mark.slow
def test_the_first_study_runs_as_the_page_prints_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    block = next(b for b in re.findall(r"```sh\n(.*?)```", PAGE, re.S) if "pymoo-hdte robust" in b)
    for line in block.splitlines():
        command, *arguments = shlex.split(line)
        assert command == "pymoo-hdte"
        assert cli.main(arguments) == 0
    assert capsys.readouterr().out.count("pymoo-hdte robust study.toml --out report") == 1
    header, front = rows_of(tmp_path / "report" / "front.csv")
    width, height, mass, std, mass_error, std_error = front.T
    assert header[:4] == ["width", "height", "mean_mass", "std_stress"]
    # Of a beam in closed form: the mean of a product of independent dimensions is one of means,
    # and the variance of the stress comes from sampling.
    assert np.all(np.abs(mass - 7850.0 * width * height) <= mass_error + 1e-9)
    rng = np.random.default_rng(1)
    draws = rng.uniform(-1, 1, 10**5), rng.normal(size=10**5), rng.normal(2000.0, 200.0, 10**5)
    built = width[:, None] * (1 + 0.02 * draws[0]), height[:, None] + 5e-4 * draws[1]
    stress = 6.0 * draws[2] / (built[0] * built[1] ** 2)
    assert np.all(np.abs(std - stress.std(axis=1)) <= std_error + 0.01 * std)
    assert np.all(np.quantile(stress, 0.99, axis=1) <= 80e6 * 1.005)
    page = (tmp_path / "report" / "report.html").read_text()
    assert "<h1>Cantilever</h1>" in page
    document = json.loads((tmp_path / "report" / "robust.json").read_text())
    (limit,) = document["constraints"]
    assert (limit["name"], limit["at_most"]) == ("quantile_stress", 80e6)
    chosen = np.argmin(np.abs(width - document["design"]["width"]))
    assert limit["value"] == pytest.approx(np.quantile(stress[chosen], 0.99), rel=0.01)
    _, runs = rows_of(tmp_path / "report" / "runs.csv")
    assert document["n_runs"] == len(runs)


def test_the_first_study_replaces_nothing(folder, capsys):
    (folder / "beam.py").write_text("mine = True\n")
    assert robust("study.toml", "--example") == cli.MISTAKE
    assert "beam.py: File exists" in capsys.readouterr().err
    assert not (folder / "study.toml").exists()
    assert (folder / "beam.py").read_text() == "mine = True\n"
    assert robust("study.txt", "--example") == cli.MISTAKE


@pytest.mark.slow
def test_a_program_and_a_function_give_the_same_front(folder):
    written(folder)
    written(folder, of_program(), name="program.toml")
    for name in ("study", "program"):
        assert robust(f"{name}.toml", "--out", f"{name}_report", "--quiet") == 0
    ours, theirs = (folder / f"{n}_report/front.csv" for n in ("study", "program"))
    assert ours.read_bytes() == theirs.read_bytes()
    _, front = rows_of(ours)
    np.testing.assert_allclose(front[:, 1], 3.0 * front[:, 0], 1e-6)
    # The mean height is 3 (x^2 + 0.05^2), at least 4.5.
    assert front[:, 0].min() == pytest.approx(np.sqrt(1.5 - 0.05**2), abs=2e-3)


@pytest.mark.slow
def test_finished_runs_are_not_made_again(folder):
    counting = "    with open('calls', 'a') as file:\n        file.write('x')\n    return"
    (folder / "steps_of_a_test.py").write_text(STAIRCASE.replace("    return", counting))
    written(folder, goals=GOALS + "[surrogate]\nbudget = 35\naccuracy = 0.2\n")
    assert robust("study.toml", "--out", "report", "--quiet") == 0
    calls = (folder / "calls").read_text()
    assert robust("study.toml", "--out", "report", "--quiet") == 0
    # One is made again, to see whether the simulator is the same.
    assert (folder / "calls").read_text() == calls + "x"
    (folder / "steps_of_a_test.py").write_text(STAIRCASE.replace("x * load", "x + load"))
    assert robust("study.toml", "--out", "report", "--quiet") == cli.MISTAKE


@pytest.mark.slow
def test_ctrl_c_tells_where_finished_runs_are_and_the_command_goes_on(folder):
    slow = STAIRCASE.replace("    return", "    time.sleep(0.05)\n    return")
    (folder / "steps_of_a_test.py").write_text("import time\n" + slow)
    written(folder, goals=GOALS + "[surrogate]\naccuracy = 0.2\n")
    command = [sys.executable, "-m", "pymoo_hdte.cli", "robust", "study.toml", "--out", "report"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    # Whatever this process inherits: a shell starts programs in the background without Ctrl-C.
    started = subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        env=environment,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    runs = folder / "study_runs.jsonl"
    while not runs.exists() or runs.read_text().count('"at"') < 3:
        time.sleep(0.02)
        assert started.poll() is None
    started.send_signal(signal.SIGINT)
    _, errors = started.communicate(timeout=60)
    assert started.returncode == INTERRUPTED
    assert errors.decode() == (
        "pymoo-hdte: interrupted, finished runs are kept in study_runs.jsonl;"
        " the same command goes on from there\n"
    )
    kept = [line for line in runs.read_text().splitlines(True) if '"at"' in line]
    assert robust("study.toml", "--out", "report", "--quiet") == 0
    assert all(line in runs.read_text() for line in kept)


def test_other_files_of_a_program_are_other_runs(folder):
    first = studied(written(folder, of_program())).simulator
    (folder / "solve.py").write_text(PROGRAM + "# otherwise\n")
    assert studied(folder / "study.toml").simulator.digest != first.digest


def studied(path):
    with read_study(path) as study:
        return study


def test_a_template_makes_the_input_file_and_marks_find_the_responses(folder):
    (folder / "deck.txt").write_text("$$begin\nX=${x}\nP=${load}\n")
    (folder / "solve.py").write_text(
        "import sys\n"
        "lines = open(sys.argv[1]).read().split()\n"
        "x, load = (float(line[2:]) for line in lines[1:])\n"
        "assert lines[0] == '$begin'\n"
        "open(sys.argv[2], 'w').write(f'max height  1.0\\nmax height = {load * x**2}\\ncost={x}')\n"
    )
    simulator = f"""[simulator]
command = [{json.dumps(sys.executable)}, "-I", "${{study}}/solve.py", "${{input_file}}",
  "${{output_file}}"]
input_file = "deck.in"
output_file = "deck.out"
template = "deck.txt"
responses = {{ height = "max height", cost = "cost=" }}
"""
    run = studied(written(folder, simulator)).simulator
    assert run(x=1.5, load=2.0) == {"height": 4.5, "cost": 1.5}


def test_without_a_template_the_input_file_is_json(folder):
    script = "import json, sys; print(json.dumps({'cost': json.load(open('in.json'))['load']}))"
    run = Program((sys.executable, "-I", "-c", script), "", (("cost", None),), "in.json")
    assert run(x=1.0, load=0.1) == {"cost": 0.1}


def test_arguments_reach_no_shell(folder):
    told = "import sys; print('cost =', len(sys.argv[1:])); assert sys.argv[1] == '; touch $$HOME*'"
    command = sys.executable, "-I", "-c", told, "; touch $$HOME*", "${x}"
    assert Program(command, "", (("cost", None),))(x=1.0) == {"cost": 2.0}


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ("import sys; print('no licence', file=sys.stderr); sys.exit(3)", "code 3: no licence"),
        ("print('cost = high')", "no cost"),
        ("import os; os.remove('stdout.txt'); os.symlink('/etc/passwd', 'stdout.txt')", "read"),
        ("import os; os.remove('stdout.txt'); os.mkfifo('stdout.txt')", "no regular file"),
        ("print('cost = 1' + 1000 * ' ')", "more than"),
    ],
)
def test_a_program_that_goes_wrong_has_failed(script, words, monkeypatch):
    monkeypatch.setattr(program, "LARGEST_OUTPUT", 500)
    run = Program((sys.executable, "-I", "-c", script), "", (("cost", None),))
    with pytest.raises(RuntimeError, match=words):
        run(x=1.0)


@pytest.mark.parametrize(
    ("text", "value"),
    [("a=1", 1.0), ("a : -.5e3\n", -500.0), ("x a\na 2.5D-1", 0.25), ('{"a": 3, "b": "c"}', 3.0)],
)
def test_numbers_of_an_output(text, value):
    assert responses_in(text, [("a", None)]) == {"a": value}


@pytest.mark.parametrize(
    "text",
    ["a = 2,5", "a = 1,234.5", "a = 0.1234-102", "a = 1.5.2", "a = 1e5-3", "a = information"],
)
def test_half_a_number_is_none(text):
    for mark in ("a =", None):
        with pytest.raises(RuntimeError, match="no a: "):
            responses_in(text, [("a", mark)])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2.5e8Pa", 2.5e8),
        ("3.", 3.0),
        ("4; 5", 4.0),
        ("1.0,2.0", 1.0),
        ("5 %", 5.0),
        ("7e2.", 7e2),
        ("-Infinity", -np.inf),
    ],
)
def test_what_follows_a_number_does_not_matter(text, value):
    assert responses_in(f"a = {text}", [("a", "a =")]) == {"a": value}


@pytest.mark.parametrize(
    ("simulator", "words"),
    [
        ('[simulator]\nfunction = "no_such_module_here:f"\n', "ModuleNotFoundError"),
        ('[simulator]\nfunction = "steps_of_a_test:stair"\n', r"function of .*\(staircase\)"),
        ('[simulator]\nfunction = "os.system"\n', "MODULE:FUNCTION"),
        ("[simulator]\n", "a function .* or a command"),
        ('[simulator]\ncommand = "solve x"\nresponses = ["a"]\n', "a list of non-empty strings"),
        ('[simulator]\ncommand = ["./solve"]\nresponses = ["a"]\n', "path of an executable file"),
        ('[simulator]\ncommand = ["./data"]\nresponses = ["a"]\n', "path of an executable file"),
        ('[simulator]\ncommand = ["sh", "${x}"]\nresponses = ["a"]\n', r"\$\{load\} stands"),
        ('[simulator]\ncommand = ["sh", "${y}"]\nresponses = ["a"]\n', r"command\[1\] is '\$\{y}'"),
        ('[simulator]\ncommand = ["sh", "$1"]\nresponses = ["a"]\n', r"written \$\$"),
        (
            '[simulator]\ncommand = ["sh"]\ninput_file = "../x"\nresponses = ["a"]\n',
            "line 3: simulator.input_file",
        ),
        (
            '[simulator]\ncommand = ["sh"]\ninput_file = "x"\ntemplate = "../data"\n'
            'responses = ["a"]\n',
            "a file in the folder of the study",
        ),
        ('[simulator]\ncommand = ["sh", "${x} ${load}"]\n', "responses"),
        (
            '[simulator]\ncommand = ["sh"]\ninput_file = "x"\noutput_file = "x"\n'
            'responses = ["a"]\n',
            "line 4: simulator.output_file is 'x', allowed: another name",
        ),
    ],
)
def test_a_simulator_that_is_none_is_named_with_what_is_allowed(simulator, words, folder, capsys):
    (folder / "data").write_text("no program")
    (folder.parent / "data").write_text("outside")
    written(folder, simulator)
    assert robust("study.toml", "--out", "report") == cli.MISTAKE
    (line,) = capsys.readouterr().err.splitlines()
    assert re.search(words, line)
    assert not (folder / "report").exists()


@pytest.mark.parametrize(
    ("inputs", "goals", "words"),
    [
        (INPUTS.replace("upper = 2\n", "uper = 2\n"), GOALS, "is it 'uper'"),
        (INPUTS.replace("upper = 2\n", "upper = 0\n"), GOALS, "line 6: design.x.upper is 0.0"),
        (INPUTS.replace("0.05", "-1"), GOALS, "deviation.std is -1.0"),
        (INPUTS.replace('"uniform"', '"uniforn"'), GOALS, "one of normal, uniform, triangle"),
        (INPUTS.replace(".load", ".study"), GOALS, "none of input_file, output_file, study"),
        (INPUTS + '[[scenarios]]\nnames = ["a", "b"]\nrows = [[1]]\n', GOALS, "rows of 2 values"),
        (INPUTS, GOALS.replace('"mean"', '"meen"', 1), "one of 'mean', 'std'"),
        (INPUTS, GOALS.replace("at_least", "at_best"), "either at_most or at_least"),
        (INPUTS, GOALS + 'algorithm = "NSGA4"\n', "one of 'ElitistSwarm'"),
        (INPUTS, GOALS.replace('"cost"', '"costs"', 1), "one of .'cost', 'height'"),
        (INPUTS + 2 * CASES, GOALS, r"scenarios\[1\].names .* other names than"),
        (
            INPUTS,
            GOALS + 'algorithm = "GA"\n',
            "search.algorithm is 'GA', allowed: one of 'Eli",
        ),
        (
            INPUTS,
            GOALS.replace("[search]", TWO_EVENTS),
            "constraint.1. is .*either any_of or all_of",
        ),
    ],
)
def test_a_mistake_in_the_study_is_named_with_its_line(inputs, goals, words, folder, capsys):
    written(folder, inputs=inputs, goals=goals)
    assert robust("study.toml", "--out", "report") == cli.MISTAKE
    printed = capsys.readouterr().err
    assert re.search(words, printed)
    assert "Traceback" not in printed


def test_several_mistakes_are_told_together(folder, capsys):
    inputs = INPUTS.replace("upper = 2\n", "upper = 0\n").replace("0.05", "-1")
    written(folder, inputs=inputs, goals=GOALS.replace('"std"', '"sdt"'))
    assert robust("study.toml", "--out", "report") == cli.MISTAKE
    assert len(capsys.readouterr().err.splitlines()) == 2


def test_all_kinds_of_inputs_and_goals_can_be_written(folder):
    inputs = """
[design.x]
lower = 1
upper = 2
tolerance = 0.1
scale = "log"
[noise.a]
distribution = "log_normal"
mean = 3
std = 0.5
[noise.b]
scenarios = [1, 2, 5]
weights = [2, 1, 1]
[noise.c]
interval = [-1, 1]
[noise.d]
distribution = "gumbel_r"
scale = 2
[noise.e]
distribution = "triangle"
lower = 0
mode = 1
upper = 4
[[scenarios]]
names = ["speed", "torque"]
rows = [[1, 2], [3, 0]]
weights = [3, 1]
"""
    goals = """
[[objective]]
statistic = "failure_probability"
any_of = [{ response = "cost", above = 3 }, { response = "height", below = -1 }]
[[objective]]
statistic = "cvar"
p = 0.9
response = "cost"
maximise = true
[[constraint]]
statistic = "crash_probability"
at_most = 0.1
"""
    study = studied(written(folder, inputs=inputs, goals=goals))
    a, b, c, d, e, together = study.inputs["noise"].values()
    assert study.inputs["noise"]["speed", "torque"] is together
    assert together.values == ((1.0, 2.0), (3.0, 0.0))
    assert (a.mean(), a.std()) == (pytest.approx(3.0), pytest.approx(0.5))
    assert b.weights == (0.5, 0.25, 0.25)
    assert (c.lower, c.upper) == (-1.0, 1.0)
    assert d.std() == pytest.approx(2.0 * np.pi / np.sqrt(6.0))
    assert e.mean() == pytest.approx(5.0 / 3.0)
    rare, cvar = study.goals["objectives"]
    margin = rare.failure.margin({"cost": np.array([4.0, 0.0]), "height": np.array([0.0, 0.0])})
    assert list(margin > 0.0) == [True, False]
    assert cvar.sign == -1.0
    assert norm.isf(study.goals["constraints"][0].bound) > 0.0


@pytest.mark.slow
def test_an_inaccurate_surrogate_is_an_error_and_its_runs_remain(folder, capsys):
    rough = STAIRCASE.replace("x * load", "int(1e4 * x * load) % 7")
    (folder / "steps_of_a_test.py").write_text(rough)
    written(folder, goals=GOALS + "[surrogate]\nbudget = 36\n")
    assert robust("study.toml", "--out", "report") == cli.MISTAKE
    assert "error of the" in capsys.readouterr().err
    assert not (folder / "report").exists()
    assert len((folder / "study_runs.jsonl").read_text().splitlines()) > 36
    written(folder, goals=GOALS + '[surrogate]\nbudget = 36\naccept = "best"\n')
    assert robust("study.toml", "--out", "report", "--json") == 0
    document = json.loads(capsys.readouterr().out)
    assert not document["trusted"]
    assert any("accepted as the best there is" in limit for limit in document["limits"])


def test_where_no_design_meets_the_constraints_the_nearest_is_told(folder, capsys):
    written(folder, goals=GOALS.replace("4.5", "100"))
    assert robust("study.toml", "--out", "report", "--json") == 0
    document = json.loads(capsys.readouterr().out)
    assert not document["feasible"]
    assert document["design"]["x"] == pytest.approx(2.0, abs=0.02)


ONE_GOAL = GOALS.replace('[[objective]]\nstatistic = "std"\nresponse = "cost"\n', "")


def test_a_single_objective_has_its_own_algorithm(folder, capsys):
    written(folder, goals=ONE_GOAL)
    assert robust("study.toml", "--out", "report", "--json") == 0
    document = json.loads(capsys.readouterr().out)
    # As where the front begins: the mean height is 3 (x^2 + 0.05^2), at least 4.5.
    assert document["design"]["x"] == pytest.approx(np.sqrt(1.5 - 0.05**2), abs=2e-3)
    assert len(document["objectives"]) == document["front"] == 1


def test_algorithms_of_several_objectives_are_refused_before_a_run(folder):
    path = written(folder, goals=ONE_GOAL + 'algorithm = "CompactSwarm"\n')
    with pytest.raises(InvalidInput, match="one of 'DE', 'GA'"):
        studied(path)


@pytest.mark.filterwarnings("default:rough")
def test_warnings_of_every_run_are_told_once(folder, capsys):
    warned = STAIRCASE.replace(
        "return",
        "warnings.warn('rough', RuntimeWarning)\n    warnings.warn('rough grid')\n    return",
    )
    (folder / "steps_of_a_test.py").write_text("import warnings\n" + warned)
    written(folder)
    assert robust("study.toml", "--out", "report", "--json") == 0
    assert json.loads(capsys.readouterr().out)["limits"] == ["rough", "rough grid"]


def test_a_simulator_that_always_fails_is_the_mistake(folder, capsys):
    (folder / "steps_of_a_test.py").write_text("def staircase(x, load):\n    return 1 / 0\n")
    written(folder)
    assert robust("study.toml", "--out", "report") == cli.MISTAKE
    assert "ZeroDivisionError" in capsys.readouterr().err


@pytest.mark.slow
def test_a_program_that_hangs_is_ended_with_its_run_and_leaves_no_folder(folder, monkeypatch):
    temporary = folder / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    (folder / "solve.py").write_text(
        f"import time\ntime.sleep(1.0)\nopen({str(folder / 'late')!r}, 'w').close()\n"
    )
    study = studied(written(folder, of_program(time_limit_s=0.3, workers=2, tries=1)))
    workers = Workers(study.settings["executor"], study.settings["time_limit"])
    with closing(workers):
        workers.start("run", partial(study.simulator, x=1.0, load=2.0))
        _, gave = workers.next()
        assert gave.kind == TOO_LONG
        assert not [*temporary.glob("**/stdout.txt")]
    assert not [*temporary.iterdir()]
    time.sleep(1.0)
    assert not (folder / "late").exists()


def test_modules_of_a_study_are_forgotten(folder):
    before = list(sys.path)
    with read_study(written(folder)) as study:
        assert study.simulator(x=2.0, load=3.0)["height"] == 12.0
    assert sys.path == before
    assert "steps_of_a_test" not in sys.modules


def test_a_study_of_another_folder_is_read_from_anywhere(folder, tmp_path_factory, monkeypatch):
    written(folder)
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    relative = os.path.relpath(folder / "study.toml")
    assert studied(relative).title == "Robust design"


def test_a_missing_study_is_one_line(folder, capsys):
    assert robust("none.toml", "--out", "report") == cli.MISTAKE
    (line,) = capsys.readouterr().err.splitlines()
    assert "none.toml: No such file or directory" in line
    with pytest.raises(InvalidInput):
        studied(folder / "solve.py")
