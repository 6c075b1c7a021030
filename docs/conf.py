"""Sphinx: ``python -m sphinx -W -b html docs build/docs``. Nothing is fetched."""

import sys
from importlib import import_module
from pathlib import Path

from numpydoc.xref import DEFAULT_LINKS
from sphinx.application import Sphinx
from sphinx.ext import autosummary
from sphinx.util import logging

import pymoo_hdte

sys.path.insert(0, str(Path(__file__).parent / "_extensions"))

project = "pymoo_hdte"
author = copyright = "The pymoo_hdte developers"
version = release = pymoo_hdte.__version__

extensions = [
    "mathml",
    "pictures",
    "problem_cards",
    "glossary",
    "readme_code",
    "signatures",
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]
myst_enable_extensions = ["colon_fence"]
exclude_patterns = ["guides"]
templates_path = ["_templates"]
html_theme = "furo"
html_title = f"pymoo_hdte {version}"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_context = {"author": author}

# Docstrings put names in single backticks; one that is no public name stays plain code.
default_role = "py:obj"
# Summaries end with a sentence, and not with "Eq.".
autosummary.WELL_KNOWN_ABBREVIATIONS += ("Eq.", "Eqs.", "Fig.")
autodoc_member_order = "bysource"
autodoc_typehints = "none"
# As written: the fields of `Rules` would fill a screen.
autodoc_preserve_defaults = True
numpydoc_show_class_members = False
# Types are links where they are ours; the manuals of Python and numpy would have to be fetched.
DEFAULT_LINKS.clear()
numpydoc_xref_param_type = True
numpydoc_xref_ignore = "all"
numpydoc_xref_aliases = {
    name: f"pymoo_hdte.{package}.{name}"
    for package in (
        "drive",
        "surrogate",
        "problems",
        "algorithms",
        "parallel",
        "mechanism",
        "discrepancy",
    )
    for name in import_module(f"pymoo_hdte.{package}").__all__
} | {"InvalidInput": "pymoo_hdte.checks.InvalidInput"}

sphinx_gallery_conf = {
    "examples_dirs": "guides",
    "gallery_dirs": "auto_guides",
    "filename_pattern": r"\.py$",
    "within_subsection_order": "guide_order.place",
    "abort_on_example_error": True,
    # What a guide shows it prints: the value of a last line may hold an address in memory.
    "capture_repr": (),
    "download_all_examples": False,
    # So many guides run at a time; they share nothing.
    "parallel": 2,
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
}


def setup(app: Sphinx) -> None:
    """Say at the start how long it takes, since a first build otherwise seems to hang."""
    app.connect("builder-inited", _announced, priority=0)


def _announced(app: Sphinx) -> None:
    guides = len(list(Path(__file__).with_name("guides").glob("*.py")))
    logging.getLogger(__name__).info(
        f"{guides} guides are run first, two at a time, and {app.outdir} is written then. A first "
        "build takes some ten minutes; later ones run only what has changed."
    )
