"""A drive model as text: the two TOML files that `load_datasheet` and `load_model` read."""

from __future__ import annotations

from pymoo_hdte._io.toml import toml_text
from pymoo_hdte.drive.datasheet import DataSheet
from pymoo_hdte.drive.datasheet_file import sheet_table
from pymoo_hdte.drive.model import DriveModel
from pymoo_hdte.drive.model_values import model_tables


def model_toml(model: DriveModel) -> str:
    """Return the model, without its data sheet, as the text that `load_model` reads back exactly.

    Its values are in SI units, with all their digits.
    """
    return toml_text(model_tables(model)["model"])


def sheet_toml(sheet: DataSheet) -> str:
    """Return a data sheet as the text that `load_datasheet` reads back exactly, in SI units."""
    return toml_text(sheet_table(sheet))
