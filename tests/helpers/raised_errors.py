"""Which errors a function raises itself, read from its source."""

import ast
import builtins
import inspect
import sys
import textwrap

from pymoo_hdte import checks

CHECKS = {
    name
    for name, check in inspect.getmembers(checks, inspect.isfunction)
    if check.__module__ == checks.__name__
}
"""Functions that raise InvalidInput for those who call them."""


def raised(function: object) -> set[str]:
    """Return the names of the errors that a function raises itself, private helpers included."""
    module = sys.modules[function.__module__]
    found: set[str] = set()
    seen: set[object] = set()
    waiting = [function]
    while waiting:
        one = waiting.pop()
        if one in seen:
            continue
        seen.add(one)
        owner = _owner(module, one)
        for node in nodes(one):
            call = node.exc if isinstance(node, ast.Raise) else node
            callee = call.func if isinstance(call, ast.Call) else None
            name = getattr(callee, "id", None) or getattr(callee, "attr", None)
            if isinstance(node, ast.Raise):
                maker = getattr(module, name or "", None)
                is_function = inspect.isfunction(maker)
                found |= {maker.__annotations__["return"] if is_function else name} - {None}
            elif name in CHECKS:
                found.add("InvalidInput")
            elif name and name.startswith("_") and not name.startswith("__"):
                waiting.append(getattr(module, name, None) or getattr(owner, name, None))
    return found


def nodes(function: object) -> list[ast.AST]:
    """Return all nodes of a function's source; of one that has none, as of a dataclass, nothing."""
    try:
        return list(ast.walk(ast.parse(textwrap.dedent(inspect.getsource(function)))))
    except (OSError, TypeError):
        return []


def _owner(module: object, function: object) -> object:
    return getattr(module, getattr(function, "__qualname__", "").partition(".")[0], None)


def ancestors(module: object, name: str) -> set[str]:
    """Return the names of an exception and of those it is a kind of."""
    places = (module, checks, builtins)
    kind = next(getattr(place, name) for place in places if hasattr(place, name))
    return {base.__name__ for base in kind.__mro__} - {"Exception", "BaseException", "object"}
