"""Where the project's files lie, and the data beside it."""

from pathlib import Path

import experiments

ROOT = Path(experiments.__file__).parents[1]
DOCS = ROOT / "docs"
STORED = ROOT / "tests" / "stored"
SHARED = ROOT.parent / "shared"
"""Campaigns and measurements, which are no part of the project; tests without them are skipped."""
