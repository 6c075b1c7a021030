"""A drive model as the believed model: its values are fitted within their tolerances.

The inertia of the load and the damping of the torsion are values of their own, which a fit may
change within their tolerances; other effects keep the numbers that have no tolerance. The phases of
the static error are fitted anew, because they depend on where an encoder has its zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.toml import read_toml
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._records.believed import MECHANICAL, BelievedDrive
from pymoo_hdte.drive import (
    DampingReference,
    DriveModel,
    LoadInertia,
    load_datasheet,
    load_drive,
    load_model,
)

LEAST = 1e-12
"""Value that replaces zero in a data sheet, which refuses zero, SI."""
_ROUNDED = 1.0 + 1e-9
"""Factor that allows for the rounding of a value by multiplication and division."""
OF_VALUES = (LoadInertia.name, DampingReference.name)
"""Effects that are values of `BelievedDrive`."""
SHEET_SUFFIX = "_sheet"
"""Ending of the name of a model's data sheet, where no other is given."""


def read_drive_model(path: str | Path, sheet: str | Path | None = None) -> DriveModel:
    """Read a drive model with its data sheet, such as ``revised_model.toml`` of a report.

    Parameters
    ----------
    path : str or Path
        File of the whole drive, as `load_drive` reads it, or of the model, in the format of
        `load_model`.
    sheet : str or Path, optional
        File of the model's data sheet; by default ``NAME_sheet.toml`` beside ``NAME.toml``.

    Returns
    -------
    DriveModel

    Raises
    ------
    InvalidInput
        With the name of the file, for a wrong, missing or superfluous field, or a number of an
        effect that is out of range.
    OSError
        If a file cannot be read.

    Examples
    --------
    >>> read_drive_model("my_drive_model.toml", "my_drive.toml").name
    'my_drive'
    """
    path = Path(path)
    if sheet is None and path.is_file() and _holds_drive(path):
        return load_drive(path)
    sheet = path.with_name(f"{path.stem}{SHEET_SUFFIX}{path.suffix}") if sheet is None else sheet
    # Where neither file exists, the error is about the model's.
    path.stat()
    try:
        return load_model(path, load_datasheet(sheet))
    except InvalidInput as error:
        if error.field.startswith((path.name, Path(sheet).name, str(path), str(sheet))):
            raise
        raise InvalidInput(f"{path.name}: {error.field}", error.value, error.allowed) from None


def _holds_drive(path: Path) -> bool:
    """Return whether a file describes a whole drive, not its model alone."""
    top = read_toml(path)
    return top.has("catalogue") or top.has("model")


def believed_of_model(
    model: DriveModel,
    tolerance: float = 0.1,
    error_tolerance: float = 0.3,
    tolerances: Mapping[str, float] | None = None,
) -> BelievedDrive:
    """Return a drive model as a believed drive.

    Parameters
    ----------
    model : DriveModel
    tolerance, error_tolerance, tolerances
        Relative half-widths, as in `BelievedDrive`; a model itself has none.

    Raises
    ------
    InvalidInput
        Whatever `BelievedDrive` refuses.
    """
    of_values = tuple(effect for effect in model.effects if effect.name in OF_VALUES)
    plain = replace(model, effects=of_values).coefficients(model.nominal[None])
    nominal = model.sheet.nominal

    def known(value: float) -> float:
        return 0.0 if value <= LEAST * _ROUNDED else float(value)

    return BelievedDrive(
        ratio=model.sheet.ratio,
        stiffness=nominal.stiffness,
        damping=known(plain.damping[0]),
        input_inertia=nominal.input_inertia,
        input_damping=known(nominal.input_damping),
        output_damping=known(nominal.output_damping),
        output_inertia=nominal.output_inertia,
        load_inertia=float(np.max(plain.load_inertia)),
        error_orders=tuple(model.kinematic_error.orders),
        error_amplitudes=tuple(np.abs(plain.error_phasors[0]).tolist()),
        tolerance=tolerance,
        error_tolerance=error_tolerance,
        effects=tuple(effect for effect in model.effects if effect.name not in OF_VALUES),
        tolerances=dict(tolerances or {}),
    )


def believed_from_fields(top: Fields, folder: Path) -> BelievedDrive:
    """Take ``model``, ``sheet`` and ``[tolerance]`` out of a campaign's file.

    Raises
    ------
    InvalidInput, OSError
        As `read_drive_model` and `believed_of_model`.
    """
    sheet = folder / top.text("sheet") if top.has("sheet") else None
    model = read_drive_model(folder / top.text("model"), sheet)
    return believed_of_model(model, *tolerances_of_fields(top))


def tolerances_of_fields(top: Fields) -> tuple[float, float, dict[str, float]]:
    """Take ``[tolerance]``: that of all values, of the static error, and of single values."""
    limits: dict[str, float] = {}
    if top.has("tolerance"):
        table = top.table("tolerance")
        for name in ("default", "static_error"):
            if table.has(name):
                limits[name] = table.number(name, at_least=0.0, below=1.0)
        limits |= single_tolerances(table)
    default, error = limits.pop("default", 0.1), limits.pop("static_error", 0.3)
    return default, error, limits


def single_tolerances(table: Fields) -> dict[str, float]:
    """Take the tolerances of single values out of a table, those of effects by dotted names.

    TOML has ``coulomb_friction.input.level`` as a table of its own, or as one name in quotes.

    Raises
    ------
    InvalidInput
        For a name without a dot that is none of `MECHANICAL`, or a number that is no tolerance;
        what the effects do not have, `BelievedDrive` refuses.
    """
    limits = {
        name: table.number(name, at_least=0.0, below=1.0) for name in MECHANICAL if table.has(name)
    }
    for name in table.names():
        if table.is_table(name) or "." in name:
            limits |= _dotted(table, name)
    table.finish()
    return limits


def _dotted(table: Fields, name: str) -> dict[str, float]:
    """Take a number, or the numbers of a table, by dotted names."""
    if not table.is_table(name):
        return {name: table.number(name, at_least=0.0, below=1.0)}
    inner, limits = table.table(name), dict[str, float]()
    for field in inner.names():
        limits |= {f"{name}.{tail}": limit for tail, limit in _dotted(inner, field).items()}
    return limits
