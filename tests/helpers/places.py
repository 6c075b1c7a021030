"""Where the project's files lie, and the data beside it."""

from pathlib import Path

import experiments
import pymoo_hdte

PACKAGE = Path(pymoo_hdte.__file__).parent
"""The package that is tested, which is installed elsewhere when a release is tested."""
ROOT = Path(experiments.__file__).parents[1]
DOCS = ROOT / "docs"
STORED = ROOT / "tests" / "stored"
SHARED = ROOT.parent / "shared"
"""Campaigns and measurements, which are no part of the project; tests without them are skipped."""

README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = "\n\n".join(
    (DOCS / f"{name}.md").read_text(encoding="utf-8")
    for name in ("model_and_measurements", "command_line", "paper", "which_algorithm", "faq")
)
"""Pages that the README leaves the details to."""
WORDS = " ".join((README + PAGES).split())
"""Both, with single spaces."""
