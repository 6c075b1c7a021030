"""What identifies a simulator: its state, what it reads beside its inputs, and sources."""

from __future__ import annotations

import functools
import hashlib
import inspect
import pickle
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FunctionType, MethodType, ModuleType
from typing import Any


def identity(simulator: Callable[..., Any]) -> str | None:
    """Return a digest that identifies a simulator.

    That is its state; globals, closures and defaults of its functions, and of those of the same
    file that they call; that file, and those of the modules named there. Files that it reads while
    it runs, programs that it calls, and what other modules call in turn are not seen.

    Parameters
    ----------
    simulator : callable
        A function, a method, an object with a state, or a `functools.partial` of these.

    Returns
    -------
    str or None
        None where it cannot be told: there is no source file, or the state or a value that it reads
        cannot be written down.
    """
    inner: Any = simulator
    while isinstance(inner, functools.partial):
        inner = inner.func
    # A user's object may raise anything when it is pickled.
    try:
        values, modules = _surroundings(inner)
        contents = [pickle.dumps(value, protocol=4) for value in (simulator, *values)]
        contents.append(
            Path(str(inspect.getsourcefile(sys.modules[inner.__module__]))).read_bytes()
        )
        contents += map(_source, modules)
    except Exception:
        return None
    digests = [hashlib.sha256(content).digest() for content in contents]
    return hashlib.sha256(b"".join(digests)).hexdigest()


def _surroundings(simulator: Any) -> tuple[list[Any], list[ModuleType]]:
    """Return the values that its functions read beside their arguments, and the modules named."""
    waiting = _functions(simulator)
    done: list[FunctionType] = []
    values: list[Any] = []
    modules: list[ModuleType] = []
    while waiting:
        function = waiting.pop()
        if function in done:
            continue
        done.append(function)
        for name, value in _read(function):
            if isinstance(value, FunctionType) and value.__globals__ is function.__globals__:
                waiting.append(value)
                values.append((name, value.__qualname__, value.__code__.co_firstlineno))
            elif isinstance(value, ModuleType):
                modules.append(value)
            else:
                values.append((name, value))
                if isinstance(value, FunctionType | type) and value.__module__ in sys.modules:
                    modules.append(sys.modules[value.__module__])
    return values, modules


def _functions(simulator: Any) -> list[FunctionType]:
    """Return the simulator as a function, or the methods of its class, pymoo's base excepted."""
    if isinstance(simulator, FunctionType):
        return [simulator]
    kind = type(simulator.__self__ if isinstance(simulator, MethodType) else simulator)
    # What pymoo's own classes read cannot be pickled, and they do not compute the responses.
    bases = [base for base in kind.__mro__ if not base.__module__.startswith("pymoo.core.")]
    return [
        member
        for base in bases
        for member in vars(base).values()
        if isinstance(member, FunctionType)
    ]


def _read(function: FunctionType) -> Iterator[tuple[str, Any]]:
    """Yield name and value of all that a function reads, its arguments excepted."""
    yield "defaults", (function.__defaults__, function.__kwdefaults__)
    cells = function.__closure__ or ()
    for name, cell in zip(function.__code__.co_freevars, cells, strict=True):
        yield name, cell.cell_contents
    for name in _names(function.__code__):
        if name in function.__globals__:
            yield name, function.__globals__[name]


def _names(code: CodeType) -> list[str]:
    """Return the names in a function and in those within it; some are of attributes."""
    inside = [constant for constant in code.co_consts if isinstance(constant, CodeType)]
    names = dict.fromkeys(code.co_names)
    for function_code in inside:
        names |= dict.fromkeys(_names(function_code))
    return list(names)


def _source(module: ModuleType) -> bytes:
    """Return the source of a module, its name where that is not Python's."""
    try:
        return Path(str(inspect.getsourcefile(module))).read_bytes()
    except (TypeError, OSError):
        return module.__name__.encode()
