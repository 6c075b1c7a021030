"""A drive as a catalogue prints it: its page, what completes it, and the model that follows.

Makers' terms (Harmonic Drive SE, engineering data): K1 holds from 0 to T1, K2 from there to T2, K3
above, with the input locked; the hysteresis loss is the width of the torsion loop without torque
after loading to plus and minus the rated torque; the transmission accuracy is the peak-to-peak of
the error over one output turn, without load or reversal.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import InvalidInput, one_of, real_number
from pymoo_hdte.drive._effects import DampingReference, DriveEffect, LawAtPort, LoadInertia
from pymoo_hdte.drive._solve.quasi_static import quasi_static_torsion
from pymoo_hdte.drive.datasheet import MEMBERS, DataSheet, ErrorSource, Mesh, Nominal
from pymoo_hdte.drive.datasheet_file import hs_20_100
from pymoo_hdte.drive.estimates import ESTIMATES, TENTH_OF_INCH, Estimate
from pymoo_hdte.drive.kinematic_error import KinematicError
from pymoo_hdte.drive.model import DriveModel
from pymoo_hdte.drive.static_error import class_amplitudes, sample_static_error
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.load_friction import LoadFriction
from pymoo_hdte.effects.stiffness import HardeningStiffness, SoftWindup
from pymoo_hdte.units import ORIGINS, UNITS


class FigureKind(NamedTuple):
    """What holds for a figure of every page.

    Attributes
    ----------
    quantity : str
        Among `units.UNITS`.
    asked_for : str
        What to enter, for a figure that nothing replaces.
    may_be_zero, compared, of_temperature : bool
        Whether a drive may lack it, whether `figures.predicted` has it for a model, and whether
        makers print it for one temperature.
    """

    quantity: str
    asked_for: str = ""
    may_be_zero: bool = False
    compared: bool = False
    of_temperature: bool = False


_SHARE = FigureKind("share", may_be_zero=True)
_NO_LOAD = FigureKind("torque", compared=True, of_temperature=True)

FIGURES: Mapping[str, FigureKind] = {
    "rated_speed": FigureKind(
        "speed", "the input speed for which the rated torque is printed, mostly 2000 r/min"
    ),
    "average_speed": FigureKind("speed"),
    "largest_speed": FigureKind("speed"),
    "rated_torque": FigureKind("torque", "printed beside size and ratio"),
    "average_torque": FigureKind("torque"),
    "repeated_peak_torque": FigureKind("torque"),
    "momentary_peak_torque": FigureKind("torque"),
    "input_inertia": FigureKind(
        "inertia",
        "of all that turns with the input: the printed moment of inertia of the gear and the rotor "
        "of the motor",
    ),
    "output_inertia": FigureKind("inertia"),
    "load_inertia": FigureKind(
        "inertia",
        "of what the output moves; no page has it, and the resonances depend on it. 0 for nothing",
        may_be_zero=True,
    ),
    "K1": FigureKind("stiffness"),
    "K2": FigureKind("stiffness"),
    "K3": FigureKind(
        "stiffness",
        "the torsional stiffness at high torque; catalogues print it in 10^4 N.m/rad, in the head "
        "of the column, or in N.m/arcmin",
    ),
    "T1": FigureKind("torque"),
    "T2": FigureKind("torque"),
    "hysteresis_loss": FigureKind("angle", may_be_zero=True, compared=True),
    "lost_motion": FigureKind("angle", compared=True),
    "transmission_accuracy": FigureKind("angle", compared=True),
    "no_load_running_torque": _NO_LOAD,
    "no_load_starting_torque": _NO_LOAD._replace(may_be_zero=True),
    "no_load_back_driving_torque": _NO_LOAD,
    "efficiency": FigureKind("share", compared=True, of_temperature=True),
    "output_damping": FigureKind("damping", may_be_zero=True),
    "load_friction": _SHARE,
    "driven_friction": _SHARE,
    "mesh_damping_share": _SHARE,
    "wall_share": _SHARE,
    "ring_share": _SHARE,
    "preload_share": _SHARE,
}
"""The figures of a page.

Examples
--------
>>> FIGURES["K1"].quantity
'stiffness'
"""

SHARPNESS = 20.0
"""Corner between the straight pieces of a printed stiffness: off by 3 % at the corner itself."""
ROOM_TEMPERATURE = 20.0 + ORIGINS["C"]
"""At which makers print friction unless they say otherwise, K."""
_SAMPLES = 1000
"""Virtual prototypes from whose component errors a static error follows."""
_SCATTER = 0.2
"""Relative scatter of a printed accuracy from drive to drive: that of theta_s in the paper."""


_SHOWN = {
    "speed": "r/min",
    "torque": "N.m",
    "inertia": "kg.cm2",
    "stiffness": "N.m/rad",
    "angle": "arcmin",
    "share": "%",
    "damping": "N.m.s/rad",
}


def figure_text(name: str, value: float) -> str:
    """Return a figure in SI as makers print it, such as ``"1 arcmin"``.

    Examples
    --------
    >>> figure_text("K3", 2.9e4), figure_text("efficiency", 0.77)
    ('29000 N.m/rad', '77 %')
    """
    quantity = FIGURES[name].quantity
    unit = _SHOWN[quantity]
    number = value / UNITS[quantity][unit]
    digits = f"{number:.3g}"
    return f"{float(digits):.15g} {unit}" if abs(number) >= 1e-3 else f"{digits} {unit}"


@dataclass(frozen=True)
class Figure:
    """A figure with the condition it is printed for.

    Attributes
    ----------
    name : str
        One of `FIGURES`.
    value : float
        SI.
    speed, load : float or None
        Of the input, rad/s, and at the output, N.m; None for the rated ones.
    temperature : float
        In kelvin.
    tolerance : float
        Relative; of figures that are checked, how far a prediction may be off.
    limit : bool
        Whether the value is the largest that the maker allows ("< 1 arcmin").

    Raises
    ------
    InvalidInput
        For a name not among `FIGURES`, a value, speed, load or temperature that is not finite and
        above 0, but for what may be missing in a drive, or an efficiency above 1.

    Examples
    --------
    >>> Figure("efficiency", 0.77, tolerance=0.04).limit
    False
    """

    name: str
    value: float
    speed: float | None = None
    load: float | None = None
    temperature: float = ROOM_TEMPERATURE
    tolerance: float = 0.0
    limit: bool = False

    def __post_init__(self) -> None:
        one_of("name", self.name, FIGURES)
        most = 1.0 if self.name == "efficiency" else np.inf
        if FIGURES[self.name].may_be_zero:
            real_number(self.name, self.value, at_least=0.0)
        else:
            real_number(self.name, self.value, above=0.0, at_most=most)
        for condition in ("speed", "load", "temperature"):
            if (value := getattr(self, condition)) is not None:
                real_number(f"{self.name}.{condition}", value, above=0.0)


@dataclass(frozen=True)
class Entry:
    """A figure of a completed page.

    Attributes
    ----------
    value : float
        SI.
    tolerance : float
        Relative half-width; 0 for a printed figure.
    basis : str
        ``"printed"``, or the rule that estimates it.

    Examples
    --------
    >>> Entry(2.5e4, 0.05, "0.88 K3").estimated
    True
    """

    value: float
    tolerance: float = 0.0
    basis: str = "printed"

    @property
    def estimated(self) -> bool:
        """Whether a rule gave the value."""
        return self.basis != "printed"


@dataclass(frozen=True)
class CataloguePage:
    """What is printed of one drive, in SI.

    Attributes
    ----------
    name, source : str
        Name of the drive, and where its figures come from.
    size : float
        Pitch diameter of the teeth in units of a tenth of an inch.
    ratio : float
        Turns of the input per turn of the output, dimensionless.
    held : {"circular_spline", "flexspline"}
        Member that does not turn.
    entered : tuple of Figure
        Figures that the model is made from; friction and efficiency may stand for several
        conditions.
    printed : tuple of Figure
        Figures that the model is compared with.
    temperature : float
        Of operation, in kelvin.
    error_sources : tuple of ErrorSource
        Errors of the parts; by default those of the paper's Table 2.

    Raises
    ------
    InvalidInput
        For a value out of range, a figure that is entered twice for one condition or from which
        nothing is made, or a ratio that no pair of tooth numbers with a difference of two gives.

    Examples
    --------
    >>> page = load_page(built_in_page(20))
    >>> page.teeth, [figure.value for figure in page.of("T1")]
    ((200, 202), [7.0])
    """

    name: str
    source: str
    size: float
    ratio: float
    held: str
    entered: tuple[Figure, ...]
    printed: tuple[Figure, ...] = ()
    temperature: float = ROOM_TEMPERATURE
    error_sources: tuple[ErrorSource, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        real_number("size", self.size, above=0.0)
        real_number("ratio", self.ratio, above=1.0)
        if abs(2.0 * self.ratio - round(2.0 * self.ratio)) > 1e-9:
            allowed = (
                "half a number of teeth: turns of the input per turn of the output, as printed"
            )
            raise InvalidInput("ratio", self.ratio, allowed)
        if any(figure.name == "lost_motion" for figure in self.entered):
            allowed = "below [[printed]]: it is compared with the model, which follows without it"
            raise InvalidInput("catalogue.lost_motion", "entered", allowed)
        conditions = [(f.name, f.speed, f.load, f.temperature) for f in self.entered]
        for condition in conditions:
            if conditions.count(condition) > 1:
                raise InvalidInput(condition[0], "entered twice", "once for each condition")

    def of(self, name: str) -> list[Figure]:
        """Return the entered figures of that name at the temperature of operation."""
        return [
            figure
            for figure in self.entered
            if figure.name == name and abs(figure.temperature - self.temperature) < 0.5
        ]

    @property
    def teeth(self) -> tuple[int, int]:
        """Teeth of flexspline and circular spline, which differ by two."""
        most = round(2.0 * self.ratio)
        return (most, most + 2) if self.held == "circular_spline" else (most - 2, most)


def page_from_fields(top: Fields) -> CataloguePage:
    """Build a page from a file with ``name``, ``source``, ``[catalogue]`` and ``[[printed]]``.

    Raises
    ------
    InvalidInput
        Naming the field, for one that is wrong, unit-less, superfluous or missing.
    """
    table = top.table("catalogue")
    if table.has("pitch_diameter"):
        size = table.quantity("pitch_diameter", "length", above=0.0) / TENTH_OF_INCH
    else:
        size = table.number("size", above=0.0)
    entered: list[Figure] = []
    temperature = (
        _temperature(table, "temperature") if table.has("temperature") else ROOM_TEMPERATURE
    )
    ratio = table.number("ratio", above=1.0)
    held = table.choice("held", MEMBERS) if table.has("held") else "circular_spline"
    for name, kind in FIGURES.items():
        if not table.has(name):
            continue
        if table.is_table(name):
            value = table.quantity(name, kind.quantity)
            # What does not depend on temperature holds at all; the rest is printed for 20 C.
            entered.append(Figure(name, value, temperature=_printed_at(name, temperature)))
        else:
            rows = table.tables(name)
            entered += [_figure(row, name, temperature) for row in rows]
    table.finish()
    printed = [_printed(row) for row in top.tables("printed")] if top.has("printed") else []
    return CataloguePage(
        top.text("name"),
        top.text("source"),
        size,
        ratio,
        held,
        tuple(entered),
        tuple(printed),
        temperature,
    )


def _printed_at(name: str, temperature: float) -> float:
    return ROOM_TEMPERATURE if FIGURES[name].of_temperature else temperature


def _figure(row: Fields, name: str, temperature: float) -> Figure:
    """Return a figure of a row with ``value`` and its condition."""
    conditions: dict[str, Any] = {"temperature": _printed_at(name, temperature)}
    for condition, quantity in (("speed", "speed"), ("load", "torque")):
        if row.has(condition):
            conditions[condition] = row.quantity(condition, quantity)
    if row.has("temperature"):
        conditions["temperature"] = _temperature(row, "temperature")
    value = row.quantity("value", FIGURES[name].quantity)
    row.finish()
    return Figure(name, value, **conditions)


def _temperature(table: Fields, name: str) -> float:
    raw = table.take(name, '{ value = ..., unit = "C" }')
    if (
        not isinstance(raw, Mapping)
        or set(raw) != {"value", "unit"}
        or raw["unit"] not in ("C", "K")
    ):
        raise InvalidInput(name, raw, '{ value = ..., unit = "C" } or "K"')
    return real_number(name, raw["value"]) + ORIGINS.get(raw["unit"], 0.0)


def _printed(row: Fields) -> Figure:
    name = row.choice("figure", [name for name, kind in FIGURES.items() if kind.compared])
    tolerance = row.number("tolerance", at_least=0.0) if row.has("tolerance") else 0.0
    limit = row.truth("limit") if row.has("limit") else False
    if not limit and tolerance == 0.0:
        raise InvalidInput("printed.tolerance", None, "above 0, or limit = true")
    return replace(_figure(row, name, ROOM_TEMPERATURE), tolerance=tolerance, limit=limit)


def complete(
    page: CataloguePage, estimates: Mapping[str, Estimate] = ESTIMATES
) -> dict[str, Entry]:
    """Return all figures that a model needs, printed or estimated.

    Parameters
    ----------
    page : CataloguePage
    estimates : mapping of Estimate, optional
        The rules, by name of their figure.

    Returns
    -------
    dict of Entry
        By name of the figure; ``load_friction`` and ``driven_friction`` follow from a printed
        efficiency and back-driving torque.

    Raises
    ------
    InvalidInput
        Naming a figure that is missing and that no rule replaces at this size and ratio.

    Examples
    --------
    >>> entries = complete(load_page(built_in_page(20)))
    >>> entries["K3"].estimated, entries["no_load_starting_torque"].estimated
    (False, True)
    """
    known = {"size": page.size, "ratio": page.ratio}
    entries: dict[str, Entry] = {}

    def enter(name: str, entry: Entry) -> None:
        entries[name], known[name] = entry, entry.value

    for name in FIGURES:
        figures = page.of(name)
        plain = [f for f in figures if f.speed is None and f.load is None]
        if plain and name not in ("efficiency", "no_load_back_driving_torque"):
            enter(name, Entry(plain[0].value))
    for name, kind in FIGURES.items():
        if kind.asked_for and name not in entries:
            allowed = f"a figure; it is missing: {kind.asked_for}"
            raise InvalidInput(f"catalogue.{name}", None, allowed)
    _enter_friction(page, entries, enter)
    elsewhere = abs(page.temperature - ROOM_TEMPERATURE) > 0.5
    for name, rule in estimates.items():
        if name in entries:
            continue
        if not rule.covers(known) or not all(need in known for need in rule.needs):
            allowed = (
                f"a figure; it is missing, and its rule ({rule.basis}) holds for sizes "
                f"{rule.sizes[0]:g} to {rule.sizes[1]:g} and ratios {rule.ratios[0]:g} to "
                f"{rule.ratios[1]:g} only"
            )
            raise InvalidInput(f"catalogue.{name}", None, allowed)
        if elsewhere and FIGURES.get(name, _SHARE).of_temperature:
            allowed = (
                f"a figure for {page.temperature - ORIGINS['C']:.0f} C, the temperature of the "
                "page: grease is stiffer in the cold, and no rule says by how much"
            )
            raise InvalidInput(f"catalogue.{name}", None, allowed)
        enter(name, Entry(rule.formula(known), rule.tolerance, rule.basis))
        _enter_friction(page, entries, enter)
    return entries


def _enter_friction(
    page: CataloguePage, entries: Mapping[str, Entry], enter: Callable[[str, Entry], None]
) -> None:
    """Enter what printed conditions of friction imply, as soon as what they build on is known."""
    rated = entries["rated_speed"].value
    running = page.of("no_load_running_torque")
    if running and "no_load_running_torque" not in entries:
        speeds, torques = np.array([(figure.speed or rated, figure.value) for figure in running]).T
        if "no_load_starting_torque" in entries:
            level = entries["no_load_starting_torque"].value
            drag = float(speeds @ (torques - level) / (speeds @ speeds))
            enter("no_load_running_torque", Entry(level + drag * rated))
        elif len(running) > 1:
            drag, level = np.polyfit(speeds, torques, 1).tolist()
            enter("no_load_starting_torque", Entry(max(level, 0.0)))
            enter("no_load_running_torque", Entry(level + drag * rated))
    no_load = [entries.get(f"no_load_{name}_torque") for name in ("starting", "running")]
    known = [entry for entry in no_load if entry is not None]
    if len(known) < len(no_load):
        return
    start, at_rated = (entry.value for entry in known)
    rows = page.of("efficiency")
    if rows and "load_friction" not in entries:
        loads = np.array([row.load or entries["rated_torque"].value for row in rows]) / page.ratio
        speeds = np.array([row.speed or rated for row in rows])
        efficiencies = np.array([row.value for row in rows])
        unloaded = start + (at_rated - start) * speeds / rated
        share = float(loads @ (loads / efficiencies - unloaded - loads) / (loads @ loads))
        if share < 0.0:
            allowed = "at most the efficiency that the no-load torque leaves"
            raise InvalidInput("catalogue.efficiency", float(efficiencies.max()), allowed)
        enter("load_friction", Entry(share))
    back = page.of("no_load_back_driving_torque")
    if back and "driven_friction" not in entries:
        least = page.ratio * start
        if back[0].value < least:
            allowed = f"at least {least:.3g} N.m, ratio times starting torque"
            raise InvalidInput("catalogue.no_load_back_driving_torque", back[0].value, allowed)
        enter("driven_friction", Entry(1.0 - least / back[0].value))


def sampled(
    entries: Mapping[str, Entry], n: int, rng: np.random.Generator
) -> Iterator[dict[str, Entry]]:
    """Yield n completed pages whose estimates are drawn within their tolerances.

    A draw that no drive has, such as a running torque below the starting torque, is drawn again.

    Parameters
    ----------
    entries : mapping of Entry
        Of `complete`.
    n : int
    rng : numpy.random.Generator

    Yields
    ------
    dict of Entry

    Raises
    ------
    InvalidInput
        As `drive_of`, if no drive has the estimates themselves.
    """
    _require_consistent(entries)
    drawn = 0
    while drawn < n:
        draw = {
            name: replace(entry, value=entry.value * (1.0 + entry.tolerance * rng.uniform(-1, 1)))
            for name, entry in entries.items()
        }
        try:
            _require_consistent(draw)
        except InvalidInput:
            continue
        drawn += 1
        yield draw


def _require_consistent(entries: Mapping[str, Entry]) -> None:
    """Raise `InvalidInput` for figures that no drive has together."""
    value = {name: entry.value for name, entry in entries.items()}
    start, running = value["no_load_starting_torque"], value["no_load_running_torque"]
    if running <= start:
        allowed = f"above the starting torque, {start:.3g} N.m"
        raise InvalidInput("catalogue.no_load_running_torque", float(f"{running:.3g}"), allowed)
    stiffnesses = (value["K1"], value["K2"], value["K3"])
    if not stiffnesses[0] <= stiffnesses[1] <= stiffnesses[2]:
        raise InvalidInput("catalogue.K1, K2, K3", stiffnesses, "rising")
    if not 0.0 < value["T1"] < value["T2"]:
        raise InvalidInput("catalogue.T1, T2", (value["T1"], value["T2"]), "above 0, and rising")


def drive_of(
    page: CataloguePage,
    entries: Mapping[str, Entry] | None = None,
    *,
    sources: Sequence[ErrorSource] | None = None,
) -> DriveModel:
    """Return the model of a page.

    K is the middle stiffness K2, below which the drive is softer to T1 and above which stiffer
    from T2; the hysteresis is of springs that slip; starting torque is dry friction at the input,
    what the running torque has beyond it a drag in proportion to the speed, and the efficiency
    leaves a friction in proportion to the load. Without a printed accuracy, theta_s and its scatter
    are those of 1000 prototypes with the errors of the parts.

    Parameters
    ----------
    page : CataloguePage
    entries : mapping of Entry, optional
        Of `complete`, which is the default, or changed ones.
    sources : sequence of ErrorSource, optional
        Errors of the parts in place of the page's.

    Returns
    -------
    DriveModel

    Raises
    ------
    InvalidInput
        As `complete`; for stiffnesses that do not rise, or a running torque that is not above the
        starting torque.

    Examples
    --------
    >>> model = drive_of(load_page(built_in_page(20)))
    >>> model.sheet.name, model.sheet.ratio
    ('RT1 size 20, ratio 100', 100.0)
    """
    entries = complete(page) if entries is None else entries
    _require_consistent(entries)
    value = {name: entry.value for name, entry in entries.items()}
    start, running = value["no_load_starting_torque"], value["no_load_running_torque"]
    drag = (running - start) / value["rated_speed"]
    teeth = dict(zip(("flexspline", "circular_spline"), page.teeth, strict=True))
    sources = tuple(sources or page.error_sources or hs_20_100().error_sources)
    sheet = DataSheet(
        name=page.name,
        source=page.source,
        flexspline_teeth=teeth["flexspline"],
        circular_spline_teeth=teeth["circular_spline"],
        held=page.held,
        input_speed=value["rated_speed"],
        load_torque=value["rated_torque"],
        nominal=Nominal(
            static_error=1e-4,
            stiffness=value["K2"],
            input_inertia=value["input_inertia"],
            input_damping=drag,
            mesh_damping=value["mesh_damping_share"] * drag,
            output_inertia=value["output_inertia"],
            output_damping=value["output_damping"],
        ),
        mesh=Mesh(0.9, max(teeth["flexspline"] // 4, 1), TENTH_OF_INCH * page.size, np.radians(20)),
        error_sources=sources,
    )
    static, scatter = _static_error(sheet, value.get("transmission_accuracy"))
    sheet = replace(sheet, nominal=replace(sheet.nominal, static_error=static))
    amplitudes = class_amplitudes(sheet)
    orders = sheet.error_orders
    error = KinematicError(
        orders=(1.0, 2.0, orders["e_g"]),
        amplitudes=(
            amplitudes["e_w"],
            float(np.hypot(amplitudes["e_m"], amplitudes["e_p"])),
            amplitudes["e_g"],
        ),
        phases=(0.0, 0.0, 0.0),
        reading="peak_to_peak",
        std=scatter,
    )
    return DriveModel(
        name=page.name,
        description="Eq. (9) with stiffness, hysteresis and friction of a catalogue page.",
        provenance=page.source,
        sheet=sheet,
        kinematic_error=error,
        effects=_effects(value),
    )


def _effects(value: Mapping[str, float]) -> tuple[DriveEffect, ...]:
    first, second, third = (value[name] for name in ("K1", "K2", "K3"))
    corner = value["T1"] / first
    upper = corner + (value["T2"] - value["T1"]) / second
    mesh: list[DriveEffect] = []
    if first < second:
        soft = SoftWindup(1.0 - first / second, corner, SHARPNESS)
        mesh.append(LawAtPort("soft_windup", "mesh", soft))
    if second < third:
        hard = HardeningStiffness(0.0, third / second - 1.0, upper, SHARPNESS)
        mesh.append(LawAtPort("hardening_stiffness", "mesh", hard))
    if value["hysteresis_loss"] > 0.0:
        loss, rated = value["hysteresis_loss"], value["rated_torque"]
        force = _slip_force(tuple(mesh), second, corner, loss, rated)
        mesh.append(LawAtPort("hysteresis", "mesh", MaxwellSlip(force, corner)))
    friction = LoadFriction(value["load_friction"], value["driven_friction"])
    return (
        LoadInertia(value["load_inertia"]),
        DampingReference(1.0),
        *mesh,
        LawAtPort("coulomb_friction", "input", CoulombFriction(value["no_load_starting_torque"])),
        LawAtPort("load_dependent_friction", "input", friction),
    )


@lru_cache(maxsize=256)
def _slip_force(
    mesh: tuple[DriveEffect, ...], stiffness: float, corner: float, wanted: float, rated: float
) -> float:
    """Return the force of springs that slip within T1 and leave the printed loss.

    Raises
    ------
    InvalidInput
        If the loss is wider than springs of half the rated torque make it.
    """
    sheet = hs_20_100()
    sheet = replace(sheet, nominal=replace(sheet.nominal, stiffness=stiffness))
    blank = KinematicError((1.0,), (1.0,), (0.0,), "peak_to_peak", 1e-6)

    def excess(force: float) -> float:
        slipping = LawAtPort("hysteresis", "mesh", MaxwellSlip(force, corner))
        return (
            loop_width(DriveModel("-", "-", "-", sheet, blank, (*mesh, slipping)), rated) - wanted
        )

    largest = 0.5 * rated
    if excess(largest) < 0.0:
        allowed = "less: the loop would be wider than springs of half the rated torque make it"
        raise InvalidInput("catalogue.hysteresis_loss", wanted, allowed)
    return float(scipy.optimize.brentq(excess, 1e-9 * largest, largest, rtol=1e-6))


def loop_width(model: DriveModel, torque: float) -> float:
    """Return the width of the torsion loop at zero torque after a load of +-torque, rad.

    Parameters
    ----------
    model : DriveModel
    torque : float
        N.m at the output.
    """
    path = torque * np.array([1.0, 0.0, -1.0, 0.0])
    loop = quasi_static_torsion(model.coefficients(model.nominal[None]), path)[0]
    return float(abs(loop[1] - loop[3]))


def _static_error(sheet: DataSheet, printed: float | None) -> tuple[float, float]:
    """Return theta_s and its standard deviation over drives, rad."""
    if printed:
        return printed, _SCATTER * printed
    return accuracy_of_parts(sheet)


def accuracy_of_parts(sheet: DataSheet) -> tuple[float, float]:
    """Return mean and standard deviation of the accuracy that the errors of the parts give, rad.

    They are those of 1000 virtual prototypes, without the tooth-to-tooth class, whose order lies
    far above what encoders and dynamics pass on.

    Parameters
    ----------
    sheet : DataSheet

    Examples
    --------
    >>> mean, std = accuracy_of_parts(hs_20_100())
    >>> print(f"{np.degrees(mean) * 3600:.0f} +- {np.degrees(std) * 3600:.0f} arcsec")
    53 +- 14 arcsec
    """
    own = hs_20_100()
    # Teeth and errors decide; drives that differ in the rest share the sample.
    return _of_parts(
        replace(
            sheet,
            name=own.name,
            source=own.source,
            input_speed=own.input_speed,
            load_torque=own.load_torque,
            nominal=own.nominal,
        )
    )


@lru_cache(maxsize=64)
def _of_parts(sheet: DataSheet) -> tuple[float, float]:
    sample = sample_static_error(sheet, _SAMPLES, np.random.default_rng(1))
    sizes = sample.peak_to_peak(("e_m", "e_g", "e_w", "e_p"))
    return float(sizes.mean()), float(sizes.std())
