"""Imports go one way: no room imports from a room above it, not even for types."""

import ast
from pathlib import Path

import pytest
from places import PACKAGE, ROOT

EXPERIMENTS = ROOT / "experiments"
TESTS = Path(__file__).parents[1]
LOWEST_FIRST = (
    *("checks", "_lazy", "units", "_compilation", "_one_thread", "_interrupts", "_unchanging"),
    *("_io", "effects"),
    *("_reports", "drive._solve", "drive._effects", "drive", "mechanism"),
    *("surrogate", "surrogate._sparse", "surrogate._rare"),
    "validation",
    "identification",
    *(
        "discrepancy._selection",
        "discrepancy._records",
        "discrepancy._records.cleaning",
        "discrepancy._records.drafts",
        "discrepancy._evidence",
        "discrepancy._evidence.order_lines",
        "discrepancy._evidence.force_balances.beyond_band",
        "discrepancy._evidence.force_balances",
        "discrepancy._verdicts",
        "discrepancy._answers.where",
        "discrepancy._answers",
        "discrepancy._plan",
        "discrepancy._report",
    ),
    *("problems._simulator", "problems._closed_form", "problems"),
    *("algorithms", "parallel", "decision", "discrepancy", "export"),
    *("_runner", "_comparing", "benchmark", "cli"),
)
"""Rooms of the package; a folder stands for the modules in it, not for the folders below it.

The modules of `discrepancy` itself are what users call, above all that they put together.
"""
LOWEST_EXPERIMENTS_FIRST = (
    *("published_values", "runner", "command_line", "__main__", "comparing"),
    *("paper.bench", "paper.static_error", "paper.prototypes", "paper.anytime", "paper"),
    *("paper.calibrating", "paper.inference"),
    *("studies.virtual_rig", "studies.fronts", "studies.contest"),
    *("studies.suites.formulas", "studies.suites", "studies.cards"),
    *("studies.robust", "studies.blind.rig", "studies.blind", "studies.measured"),
    *("studies.reliability", "studies", "paper_page"),
)
OUTSIDE = ("experiments", "tests")


def room_of(module: str, root: Path) -> str:
    """Return the room of a module, of a package or of a name in one, by dotted path below root."""
    parts = module.split(".")
    while parts and not root.joinpath(*parts).is_dir():
        inside = ".".join(parts[:-1])
        if root.joinpath(*parts).with_suffix(".py").is_file():
            return inside or parts[0]
        parts.pop()
    return ".".join(parts)


def imported(path: Path, package: str, root: Path) -> set[str]:
    """Return the rooms of a package that a file imports from anywhere, and other packages."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            assert not node.level, f"{path} imports relatively"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        for name in names:
            first, _, rest = name.partition(".")
            found.add(room_of(rest, root) if first == package and rest else first)
    return found


def rooms(root: Path, order: tuple[str, ...]) -> list[tuple[str, list[Path]]]:
    """Return the files of each room, every file of the package being in one."""
    found = [
        (room, sorted(root.joinpath(*room.split(".")).glob("*.py")) or [root / f"{room}.py"])
        for room in order
    ]
    inside = {path for _, paths in found for path in paths}
    assert inside | {root / "__init__.py"} == set(root.rglob("*.py"))
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("package", "root", "order"),
    [
        ("pymoo_hdte", PACKAGE, LOWEST_FIRST),
        ("experiments", EXPERIMENTS, LOWEST_EXPERIMENTS_FIRST),
    ],
)
def test_no_import_runs_back(package, root, order):
    outside = set(OUTSIDE) - {package}
    for place, (room, paths) in enumerate(rooms(root, order)):
        names = set().union(*(imported(path, package, root) for path in paths))
        assert not names & (set(order[place + 1 :]) | outside), f"{package}.{room}"


@pytest.mark.parametrize(
    "rooms_of_it", ["discrepancy._selection", "discrepancy._records", "discrepancy._evidence"]
)
def test_the_workflow_knows_nothing_of_optimisation(rooms_of_it):
    found = dict(rooms(PACKAGE, LOWEST_FIRST))[rooms_of_it]
    names = set().union(*(imported(path, "pymoo_hdte", PACKAGE) for path in found))
    assert not names & {"surrogate", "problems", "algorithms", "decision", "pymoo"}


def test_the_engine_knows_no_machine():
    found = dict(rooms(PACKAGE, LOWEST_FIRST))["discrepancy._selection"]
    names = set().union(*(imported(path, "pymoo_hdte", PACKAGE) for path in found))
    assert not {name for name in names if name.startswith(("drive", "mechanism"))}
