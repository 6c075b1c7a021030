"""Which source and which versions made a result."""

from __future__ import annotations

import ast
import hashlib
import json
import platform
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pymoo_hdte

PACKAGES = (
    *("numpy", "scipy", "finufft", "numba", "pymoo", "moocore", "chaospy", "matplotlib"),
    *("jmetalpy", "pygmo", "coco-experiment", "comocma", "cma"),
    *("pysindy", "sysidentpy", "mujoco", "platypus-opt", "openturns", "scikit-learn", "emcee"),
)
"""Packages whose version can change a result, where they are installed."""
_COMPUTES = ("algorithms", "drive", "problems", "surrogate")
"""Rooms of the package from which the numbers of the paper's experiments come."""


def environment() -> dict[str, str]:
    """Versions of what computes the results."""
    versions = {}
    for package in PACKAGES:
        with suppress(PackageNotFoundError):
            versions[package] = version(package)
    return {"python": platform.python_version(), "machine": platform.machine()} | versions


@cache
def fingerprint(*sources: Path) -> str:
    """Identify a state of the package, of further source files and of `environment`.

    A change in any of them changes the fingerprint, so that what one state made is never taken for
    the work of another.
    """
    digest = hashlib.sha256(json.dumps(environment()).encode())
    for path in [*files_below(Path(pymoo_hdte.__file__).parent), *sources]:
        digest.update(f"{path.name} {path.stat().st_size}\n".encode() + path.read_bytes())
    return digest.hexdigest()[:16]


@cache
def source_fingerprint() -> str:
    """Identify the code and the data of drive, surrogate, problems and swarms.

    Stored outcomes carry it, so that those which belong together can be seen to stem from the same
    source. Comments and docstrings do not count: they change no result.
    """
    digest = hashlib.sha256()
    package = Path(pymoo_hdte.__file__).parent
    for path in [path for room in _COMPUTES for path in files_below(package / room)]:
        digest.update(f"{path.relative_to(package).as_posix()}\n".encode())
        digest.update(_code(path) if path.suffix == ".py" else path.read_bytes())
    return digest.hexdigest()[:16]


def _code(path: Path) -> bytes:
    """Return the syntax tree of a module without its docstrings."""
    tree = ast.parse(path.read_bytes())
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            # Also the strings below fields, which document them.
            node.body = [line for line in node.body if not _is_text(line)]
    return ast.dump(tree).encode()


def _is_text(line: ast.stmt) -> bool:
    value = line.value if isinstance(line, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)


def files_below(folder: Path) -> list[Path]:
    """Return all files of a folder and of those in it, but compiled modules."""
    paths = (path for path in folder.rglob("*") if "__pycache__" not in path.parts)
    return sorted(path for path in paths if path.is_file())
