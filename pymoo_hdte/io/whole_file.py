"""Files that are either complete or not there, whenever the program is interrupted."""

from __future__ import annotations

import os
from pathlib import Path


def write_whole(path: Path, content: bytes) -> None:
    """Write a file in a folder that is there; a file of that name is replaced in one step.

    Raises
    ------
    OSError
        If it cannot be written; what was there before is then still there.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.write_bytes(content)
        os.replace(temporary, path)
    finally:
        # On a full disk a partial file remains, which would keep the disk full.
        temporary.unlink(missing_ok=True)
