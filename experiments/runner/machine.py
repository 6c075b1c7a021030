"""Description of the machine on which times were measured."""

from __future__ import annotations

import os
import platform
from pathlib import Path

from threadpoolctl import threadpool_info

from pymoo_hdte._runner.provenance import environment
from pymoo_hdte._runner.result import Column, Table
from pymoo_hdte.surrogate.threads import usable_cores


def machine_table() -> Table:
    """Return processor, cores, memory, system and versions."""
    versions = environment()
    rows = [
        ("processor", processor()),
        ("cores this process may use", str(usable_cores())),
        ("memory", f"{os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 2**30:.1f} GiB"),
        ("system", f"{platform.system()} {platform.release()}"),
        ("linear algebra", _linear_algebra()),
        ("load when it ended, over one minute", f"{os.getloadavg()[0]:.1f}"),
        ("versions", ", ".join(f"{name} {version}" for name, version in versions.items())),
    ]
    return Table(
        "machine", "The machine", (Column("what"), Column("fact")), tuple(rows), wall_times=True
    )


def processor() -> str:
    """Return the name of the processor, as the system gives it."""
    facts = Path("/proc/cpuinfo")
    if facts.is_file():
        for line in facts.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _linear_algebra() -> str:
    libraries = {
        f"{library['internal_api']} {library['version']}, {library['num_threads']} threads"
        for library in threadpool_info()
        if library["user_api"] == "blas"
    }
    return "; ".join(sorted(libraries)) or "unknown"
