"""Sphinx: ``python -m sphinx -W --keep-going -b html docs build/docs``. Nothing is fetched."""

import sys
from pathlib import Path

import pymoo_hdte

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_extensions"))

project = "pymoo_hdte"
author = copyright = "The pymoo_hdte developers"
version = release = pymoo_hdte.__version__

extensions = [
    "mathml",
    "myst_parser",
    "sphinx.ext.autodoc",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = f"pymoo_hdte {version}"
html_math_renderer = "mathml"
html_show_sphinx = False

default_role = "py:obj"
autodoc_member_order = "bysource"
autodoc_typehints = "none"
numpydoc_show_class_members = False

sphinx_gallery_conf = {
    "examples_dirs": "guides",
    "gallery_dirs": "auto_guides",
    "filename_pattern": r"\.py$",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
}
