"""A user's own effects, from a Python file that is named on the command line."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pymoo_hdte.checks import InvalidInput

if TYPE_CHECKING:
    from pymoo_hdte.effects import Effect

OPTION = "--effects"


def own_effects(path: Path) -> tuple[Effect, ...]:
    """Return the effects that a Python file defines; the file is run.

    Effects of the package that the file imports are not among them. The file may also register
    its own effects.

    Raises
    ------
    InvalidInput
        If there is no such file, it cannot be run, or no effect stands in it under a name.
    """
    # All effects of the package have to be known before, to tell those of the file from them.
    import pymoo_hdte.discrepancy  # noqa: F401
    from pymoo_hdte.effects import Effect, known_effects

    known = known_effects()
    effects: list[Effect] = []
    for value in _names_of(path).values():
        if isinstance(value, Effect) and all(value is not effect for effect in (*known, *effects)):
            effects.append(value)
    if not effects:
        raise InvalidInput(OPTION, str(path), "a Python file in which an Effect stands by a name")
    return tuple(effects)


@contextmanager
def errors_by_line(path: Path | None) -> Iterator[None]:
    """Report errors of the file's effects, which occur later in a fit, with the file's line."""
    try:
        yield
    except InvalidInput:
        raise
    except Exception as error:
        if path is None or not _line(error, path):
            raise
        allowed = f"a Python file whose effects make no errors; {on_one_line(error, path)}"
        raise InvalidInput(OPTION, str(path), allowed) from error


def _names_of(path: Path) -> dict[str, Any]:
    """Run a Python file as a module and return what its names stand for."""
    if not path.is_file():
        raise InvalidInput(OPTION, str(path), "a Python file that is there")
    name = f"own_effects_{path.stem}"
    loader = SourceFileLoader(name, str(path))
    spec = spec_from_loader(name, loader)
    assert spec is not None
    module = module_from_spec(spec)
    # Data classes look up the module that they stand in.
    sys.modules[name] = module
    try:
        loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        allowed = f"a Python file that runs without errors; {on_one_line(error, path)}"
        raise InvalidInput(OPTION, str(path), allowed) from error
    return vars(module)


def on_one_line(error: BaseException, path: Path) -> str:
    """Return an error with its line of the file, on one line."""
    message = " ".join(f"{type(error).__name__}: {error}".split())
    return f"{_line(error, path)}{message}"


def _line(error: BaseException, path: Path) -> str:
    """Return in words the line of the file that failed; an empty text if it never ran."""
    steps = traceback.extract_tb(error.__traceback__)
    lines = [step.lineno for step in steps if step.filename == str(path)]
    return f"line {lines[-1]}: " if lines else ""
