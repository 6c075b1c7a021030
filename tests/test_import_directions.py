"""Data flows one way: no part of the package imports one that stands above it."""

import ast
from pathlib import Path

import pytest

import pymoo_hdte

ROOT = Path(pymoo_hdte.__file__).parent
LOWEST_FIRST = (
    *("__version__", "checks", "units", "compiled", "storage", "reports"),
    *("drive", "surrogate", "validation", "identification", "mechanism", "discrepancy", "measured"),
    *("problems", "algorithms", "decision", "commands", "cli"),
)


def imported(path: Path) -> set[str]:
    """Return the parts of the package, and the other packages, that a file imports anywhere."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            assert not node.level, f"{path} imports relatively"
            package, *rest = str(node.module).split(".")
            names = {rest[0]} if rest else {alias.name for alias in node.names}
            found |= names if package == "pymoo_hdte" else {package}
        elif isinstance(node, ast.Import):
            found |= {alias.name.removeprefix("pymoo_hdte.").split(".")[0] for alias in node.names}
    return found


PARTS = sorted({path.relative_to(ROOT).parts[0].removesuffix(".py") for path in ROOT.rglob("*.py")})


@pytest.mark.parametrize("part", [part for part in PARTS if part != "__init__"])
def test_no_import_runs_back(part):
    files = (
        [ROOT / f"{part}.py"] if (ROOT / f"{part}.py").is_file() else (ROOT / part).rglob("*.py")
    )
    names = set().union(*map(imported, files))
    above = set(LOWEST_FIRST[LOWEST_FIRST.index(part) + 1 :])
    assert not names & (above | {"experiments", "tests"})


@pytest.mark.parametrize("part", ["discrepancy", "measured"])
def test_the_workflow_knows_nothing_of_optimisation(part):
    names = set().union(*map(imported, (ROOT / part).rglob("*.py")))
    assert "drive" in names
    assert not names & {"surrogate", "problems", "algorithms", "decision", "pymoo"}
