"""What is public: the names in ``__all__`` of the packages, and what their classes offer."""

import ast
import functools
import importlib
import inspect
import itertools
import sys

PACKAGES = (
    "drive", "surrogate", "identification", "problems", "algorithms", "decision", "discrepancy",
    "mechanism", "validation", "parallel", "export", "benchmark",
)  # fmt: skip

HERE = ("pymoo_hdte", "test_public_docstrings")
"""Where the names are defined that are checked, not inherited from a library."""


@functools.cache
def public_objects() -> dict[str, object]:
    """Return every public class, function, method and property of the package, by full name."""
    found: dict[str, object] = {}
    for package in PACKAGES:
        module = importlib.import_module(f"pymoo_hdte.{package}")
        for name in module.__all__:
            target = getattr(module, name)
            if inspect.isclass(target):
                found[f"{package}.{name}"] = target
                found |= {f"{package}.{name}.{one}": it for one, it in members(target).items()}
            elif callable(target):
                found[f"{package}.{name}"] = target
    return found


def public_constants() -> dict[str, str | None]:
    """Return the string below each public constant, None where there is none, by full name."""
    found: dict[str, str | None] = {}
    for package in PACKAGES:
        module = importlib.import_module(f"pymoo_hdte.{package}")
        for name in module.__all__:
            if not callable(getattr(module, name)):
                found[f"{package}.{name}"] = _string_below(name, getattr(module, name))
    return found


def _string_below(name: str, value: object) -> str | None:
    for title, module in list(sys.modules.items()):
        if not title.startswith("pymoo_hdte") or vars(module).get(name) is not value:
            continue
        body = ast.parse(inspect.getsource(module)).body
        for statement, below in itertools.pairwise(body):
            targets = getattr(statement, "targets", [getattr(statement, "target", None)])
            if [getattr(one, "id", None) for one in targets] == [name]:
                text = getattr(getattr(below, "value", None), "value", None)
                return text if isinstance(text, str) else None
    return None


def members(kind: type) -> dict[str, object]:
    """Return the public methods and properties of a class that this package defines."""
    found: dict[str, object] = {}
    for base in reversed(kind.__mro__):
        if not base.__module__.startswith(HERE):
            continue
        for name, value in vars(base).items():
            if name.startswith("_") and name != "__call__":
                continue
            value = getattr(value, "fget", None) or getattr(value, "func", value)
            value = getattr(value, "__func__", value)
            if inspect.isfunction(value):
                found[name] = value
    return found
