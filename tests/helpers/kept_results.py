"""Slow results that several test files need: one worker computes each for all."""

import fcntl
import hashlib
import os
import pickle
from collections.abc import Callable, Mapping
from functools import wraps
from pathlib import Path

import cloudpickle

FOLDER = "PYMOO_HDTE_KEPT_RESULTS"
"""Environment variable with the folder of this run of the suite; the workers inherit it."""


def kept(make: Callable) -> Callable:
    """Keep what a function returns, in a file for the other workers, which wait for it.

    The function must depend on nothing but its arguments, and its result must not be changed.
    """
    known = {}

    @wraps(make)
    def result(*args, **kwargs):
        key = pickle.dumps((make.__module__, make.__qualname__, args, kwargs))
        if key not in known:
            known[key] = _made_once(hashlib.sha256(key).hexdigest(), lambda: make(*args, **kwargs))
        return known[key]

    return result


def _made_once(name: str, make: Callable):
    path = Path(os.environ[FOLDER]) / name
    with path.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not path.exists():
            # Findings hold functions made on the way, which pickle alone cannot write.
            path.write_bytes(cloudpickle.dumps(make()))
    return pickle.loads(path.read_bytes())


def files_in(folder: Path) -> dict[str, bytes]:
    """Return the files of a folder by name."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def put_files(files: Mapping[str | Path, bytes], folder: Path) -> None:
    """Write files, by their path, into a new folder."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
