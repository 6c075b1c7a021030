"""One file for one drive: a catalogue page, or a data sheet with its model below ``[model]``."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.toml import named_by_file, toml_with_lines
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive.catalogue import CataloguePage, drive_of, page_from_fields
from pymoo_hdte.drive.datasheet import DataSheet
from pymoo_hdte.drive.datasheet_file import PLACES, check_twist, datasheet_from_fields
from pymoo_hdte.drive.model import DriveModel
from pymoo_hdte.drive.model_values import values_of


class DescribedDrive(NamedTuple):
    """What a TOML file says of a drive.

    Attributes
    ----------
    sheet : DataSheet
    model : DriveModel or None
        None where the file is a data sheet alone.
    page : CataloguePage or None
        None where the drive is described otherwise.
    """

    sheet: DataSheet
    model: DriveModel | None
    page: CataloguePage | None


def describe_drive(path: str | Path) -> DescribedDrive:
    """Read a catalogue page, or a data sheet with or without its model.

    Raises
    ------
    InvalidInput, OSError
        As `load_drive`.
    """
    path = Path(path)
    with toml_with_lines(path) as top:
        if top.has("catalogue"):
            with named_by_file(path):
                page = _page(top)
                model = drive_of(page)
            return DescribedDrive(model.sheet, model, page)
        # What the data sheet itself refuses is named as it stands in the file.
        with named_by_file(path, PLACES):
            fields = top.table("model") if top.has("model") else None
            sheet = datasheet_from_fields(top)
            check_twist(sheet)
            described = None if fields is None else DriveModel(**values_of(fields, sheet))
            return DescribedDrive(sheet, described, None)


BUILT_IN_SIZES = (14, 20, 25)
"""Sizes of the catalogue pages that the package brings along, all of ratio 100."""


def built_in_page(size: int) -> Path:
    """Return the file of a catalogue page that the package brings along.

    Parameters
    ----------
    size : {14, 20, 25}

    Raises
    ------
    InvalidInput
        For another size.

    Examples
    --------
    >>> built_in_page(20).name
    'size_20.toml'
    """
    if size not in BUILT_IN_SIZES:
        raise InvalidInput("size", size, ", ".join(map(str, BUILT_IN_SIZES)))
    return Path(str(files("pymoo_hdte.drive"))) / "data" / f"size_{size}.toml"


def load_page(path: str | Path) -> CataloguePage:
    """Read a catalogue page: ``name``, ``source``, ``[catalogue]`` and any ``[[printed]]``.

    Parameters
    ----------
    path : str or Path
        A TOML file, in which every quantity has its unit.

    Returns
    -------
    CataloguePage

    Raises
    ------
    InvalidInput
        Naming file and line, for a field that is wrong, unit-less or superfluous.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> page = load_page(built_in_page(20))
    >>> page.teeth
    (200, 202)
    """
    path = Path(path)
    with toml_with_lines(path) as top, named_by_file(path):
        return _page(top)


def _page(top: Fields) -> CataloguePage:
    page = page_from_fields(top)
    top.finish()
    return page


def load_drive(path: str | Path) -> DriveModel:
    """Read a drive from one file.

    Parameters
    ----------
    path : str or Path
        A TOML file: a catalogue page, as `load_page` reads it, or a data sheet as `load_datasheet`
        reads it with a table ``[model]``, as `load_model` reads it.

    Returns
    -------
    DriveModel

    Raises
    ------
    InvalidInput
        Naming file and field, for one that is wrong, missing, superfluous or unit-less.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> load_drive(built_in_page(20)).sheet.ratio
    100.0
    """
    model = describe_drive(path).model
    if model is None:
        raise InvalidInput(f"{Path(path).name}: model", None, "a table, or [catalogue]")
    return model
