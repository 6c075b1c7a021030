"""The data sheet of a drive: typed, checked, immutable. Tables 1, 2 and 4 of the paper."""

from __future__ import annotations

from dataclasses import dataclass, fields

from pymoo_hdte.checks import InvalidInput, one_of, real_number, whole_number
from pymoo_hdte.units import si_unit

ERROR_CLASSES = ("e_m", "e_g", "e_w", "e_p", "e_h")
"""Classes of Eq. (1): stationary, with the output, with the wave generator, pitch, tooth.

In the paper what turns with the output is the flexspline."""
MEMBERS = ("circular_spline", "flexspline")
"""Members of which one is held in the housing and the other is the output; makers hold the first.

Either turns against the wave generator, which is always the input."""

LARGEST_TWIST = 0.1
"""Largest twist that is accepted, rad: no load twists a strain wave gear by more.

Thirty times the wind-up of catalogued drives at their rated torque, some 1 to 3 mrad; a stiffness
whose power of ten was overlooked, 10^4 N.m/rad, gives 10 rad and more."""
LOST_POWER = (
    "catalogues print it in 10^4 N.m/rad, in the head of the column, or in N.m/arcmin, which is "
    "3438 N.m/rad"
)
"""Likely cause of a stiffness that is too small."""


@dataclass(frozen=True)
class ErrorSource:
    """One manufacturing or assembly error of a component (Tables 1 and 2).

    Attributes
    ----------
    component, symbol, description : str
        As in Table 1.
    error_class : str
        One of `ERROR_CLASSES`.
    mean, std : float
        Mean and standard deviation of the normal distribution over prototypes, m.

    Raises
    ------
    InvalidInput
        For an unknown class, or a mean or std that is negative or not finite.
    """

    component: str
    symbol: str
    description: str
    error_class: str
    mean: float
    std: float

    def __post_init__(self) -> None:
        if not isinstance(self.symbol, str) or not self.symbol:
            raise InvalidInput("symbol", self.symbol, "a word")
        one_of(f"error class of {self.symbol}", self.error_class, ERROR_CLASSES)
        real_number(f"mean of {self.symbol}", self.mean, at_least=0.0)
        real_number(f"std of {self.symbol}", self.std, at_least=0.0)


@dataclass(frozen=True)
class Mesh:
    """The constants by which Eq. (2) turns the motion error at the mesh into an output angle.

    Attributes
    ----------
    error_influence : float
        K_b, influence of the errors under multi-tooth meshing, dimensionless.
    teeth_in_mesh : int
        z_t.
    pitch_diameter : float
        d of the circular spline, in metres.
    pressure_angle : float
        alpha_n of the flexspline's pitch circle, in radians.

    Raises
    ------
    InvalidInput
        For a value that is not finite or out of range.
    """

    error_influence: float
    teeth_in_mesh: int
    pitch_diameter: float
    pressure_angle: float

    def __post_init__(self) -> None:
        real_number("error_influence", self.error_influence, above=0.0)
        whole_number("teeth_in_mesh", self.teeth_in_mesh, 1)
        real_number("pitch_diameter", self.pitch_diameter, above=0.0)
        real_number("pressure_angle", self.pressure_angle, at_least=0.0, below=1.5)


@dataclass(frozen=True)
class Nominal:
    """Nominal parameters of the drive (Table 4), SI units.

    Attributes
    ----------
    static_error : float
        theta_s, rad.
    stiffness : float
        K, N.m/rad at the output.
    input_inertia, output_inertia : float
        J_in, J_out, kg.m2.
    input_damping, mesh_damping, output_damping : float
        B_in, B_fc, B_out, N.m.s/rad.

    Raises
    ------
    InvalidInput
        For a value that is not finite or not above 0.
    """

    static_error: float
    stiffness: float
    input_inertia: float
    input_damping: float
    mesh_damping: float
    output_inertia: float
    output_damping: float

    def __post_init__(self) -> None:
        for field in fields(self):
            real_number(field.name, getattr(self, field.name), above=0.0)


NOMINAL_QUANTITIES = {
    "static_error": "angle",
    "stiffness": "stiffness",
    "input_inertia": "inertia",
    "input_damping": "damping",
    "mesh_damping": "damping",
    "output_inertia": "inertia",
    "output_damping": "damping",
}
"""The quantity, among `units.UNITS`, of every field of `Nominal`."""

NOMINAL_FIELDS = {
    "theta_s": "static_error",
    "K": "stiffness",
    "J_in": "input_inertia",
    "B_in": "input_damping",
    "B_fc": "mesh_damping",
    "J_out": "output_inertia",
    "B_out": "output_damping",
}
"""The field of `Nominal` for every symbol of Table 4."""


def unit_of(symbol: str) -> str:
    """Return the SI unit of a parameter, by its symbol in `NOMINAL_FIELDS`."""
    return si_unit(NOMINAL_QUANTITIES[NOMINAL_FIELDS[symbol]])


@dataclass(frozen=True)
class DataSheet:
    """A harmonic drive, as its maker and the test bench describe it.

    Attributes
    ----------
    name, source : str
        Name of the drive, and source of its numbers.
    flexspline_teeth, circular_spline_teeth : int
        Z_f < Z_c, by an even number: the wave generator has two ends, and both must mesh alike.
    held : {"circular_spline", "flexspline"}
        Member that does not turn; the other one is the output. Makers' drives hold the circular
        spline, and their output turns against the input; angles here count in its own sense.
    orders_as_held : {"circular_spline", "flexspline"}, optional
        Member that `error_orders` take for held, of a source that mixes both arrangements, as the
        paper does; by default ``held``.
    input_speed : float
        Rated, rad/s.
    load_torque : float
        Rated, N.m at the output; negative where the load drives.
    nominal : Nominal
        Parameters of the motion, Eq. (9), as in Table 4: ``static_error`` in rad, ``stiffness``
        in N.m/rad, inertias in kg.m2 and damping in N.m.s/rad.
    mesh : Mesh
        Constants of Eq. (2), from the mesh to the angle of the output.
    error_sources : tuple of ErrorSource
        Tables 1 and 2, in metres.

    Raises
    ------
    InvalidInput
        For a value that is not finite or out of range, or a symbol that two error sources share.

    Examples
    --------
    >>> sheet = hs_20_100()
    >>> sheet.name, sheet.ratio, sheet.error_orders
    ('HS-20-100', 101.0, {'e_m': 2.0, 'e_g': 2.02, 'e_w': 1.0, 'e_p': 2.0, 'e_h': 404.0})
    """

    name: str
    source: str
    flexspline_teeth: int
    circular_spline_teeth: int
    held: str
    input_speed: float
    load_torque: float
    nominal: Nominal
    mesh: Mesh
    error_sources: tuple[ErrorSource, ...]
    orders_as_held: str | None = None

    def __post_init__(self) -> None:
        whole_number("flexspline_teeth", self.flexspline_teeth, 2)
        whole_number("circular_spline_teeth", self.circular_spline_teeth, self.flexspline_teeth + 1)
        _check_difference(self.circular_spline_teeth - self.flexspline_teeth, self)
        one_of("held", self.held, MEMBERS)
        if self.orders_as_held is not None:
            one_of("orders_as_held", self.orders_as_held, MEMBERS)
        real_number("input_speed", self.input_speed, above=0.0)
        real_number("load_torque", self.load_torque)
        symbols = [source.symbol for source in self.error_sources]
        if len(set(symbols)) != len(symbols):
            raise InvalidInput("symbols of the error sources", symbols, "each symbol once")

    @property
    def ratio(self) -> float:
        """Transmission ratio N, turns of the input per turn of the output, dimensionless.

        Z_f / (Z_c - Z_f) with the circular spline held, Z_c / (Z_c - Z_f) with the flexspline held
        (Musser, US Patent 2906143 of 1959).
        """
        return 1.0 / abs(self._output_turn(self.held))

    @property
    def error_orders(self) -> dict[str, float]:
        """Order of each class of the static error, Eq. (1), by name, in cycles per input turn.

        Both ends of the wave generator pass each error of a spline once a turn against it. What is
        held is passed 2 times per input turn, what turns with the output 2 (1 - w) times, where w
        is the turn of the output per turn of the input, and teeth as often as the held member has
        any. With 100 and 102 teeth the class e_g has order 2.04 with the circular spline held, and
        1.96 with the flexspline held.
        """
        held = self.orders_as_held or self.held
        output = 2.0 * (1.0 - self._output_turn(held))
        return {"e_m": 2.0, "e_g": output, "e_w": 1.0, "e_p": 2.0, "e_h": 2.0 * self._teeth(held)}

    def _output_turn(self, held: str) -> float:
        """Return the turn of the output per turn of the input, negative if against it.

        On its way round, the wave generator moves the output on the held member by the difference
        of their teeth, counted in teeth of the output.
        """
        (output,) = set(MEMBERS) - {held}
        return (self._teeth(output) - self._teeth(held)) / self._teeth(output)

    def _teeth(self, member: str) -> int:
        return self.flexspline_teeth if member == "flexspline" else self.circular_spline_teeth


def _check_difference(difference: int, sheet: DataSheet) -> None:
    if difference % 2:
        teeth = sheet.flexspline_teeth + difference
        allowed = (
            f"{sheet.flexspline_teeth} (flexspline_teeth) + 2, or another even number more: teeth "
            f"engage at both ends of the wave generator, which a difference of {difference} does "
            "not let them; likely a tooth number was miscounted or computed from a rounded ratio"
        )
        raise InvalidInput("circular_spline_teeth", teeth, allowed)
