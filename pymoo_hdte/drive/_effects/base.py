"""Effects in a drive model: laws at ports, or other changes of Eq. (9).

An effect changes the coefficients of the equations of motion, or what sensors read of them; this
serves every solver. The effect is defined by `effects.effect.Effect`, with its names, quantities
and form in files.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import InvalidInput, one_of, real_number
from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.effects.effect import Effect, effect_named, known_effects
from pymoo_hdte.effects.guess import Sizes
from pymoo_hdte.effects.law import Law, Values

Lines = NDArray[np.complex128]


@dataclass(frozen=True)
class DriveSizes(Sizes):
    """Sizes of a port of a drive, including those for effects that are no laws; SI.

    Attributes
    ----------
    error : float
        Typical size of a line of the transmission error that may be missing, rad.
    largest_error : float
        Largest size of such a line, rad.
    believed_orders : tuple of float
        Orders of the nominal lines of the static error.
    ratio : float
        Transmission ratio N.
    inertia : float
        Inertia of the load, kg.m2: the size of an inertia that may be missing.
    duration : float
        Duration of the session, s.
    changes : tuple of float
        Times of the session between records, at which a reading may have changed at once, s.
    series : tuple of float
        Times of the session between series of measurements, s: as stated, else ``changes``.
    loads_differ : bool
        Whether the records are taken under different loads.
    readings, largest_readings : tuple of float
        Typical and largest error of a reading of the input's and the output's torque that may be
        missing, N.m.
    """

    error: float = 0.0
    largest_error: float = 0.0
    believed_orders: tuple[float, ...] = ()
    ratio: float = 1.0
    inertia: float = 0.0
    duration: float = 0.0
    changes: tuple[float, ...] = ()
    series: tuple[float, ...] = ()
    loads_differ: bool = False
    readings: tuple[float, float] = (0.0, 0.0)
    largest_readings: tuple[float, float] = (0.0, 0.0)

    def further(self) -> Self:
        """Return the sizes without the orders of believed lines of the error."""
        return replace(
            self,
            seen=tuple(order for order in self.seen if not self.believes(order)),
            shown=tuple(order for order in self.shown if not self.believes(order)),
        )

    def believes(self, order: float) -> bool:
        """Tell whether the static error is believed to have a line of an order."""
        return any(abs(order - believed) < 1e-6 for believed in self.believed_orders)


@dataclass(frozen=True, eq=False)
class Session:
    """Times of r records, and the m lines of them that are analysed.

    Attributes
    ----------
    orders : sequence of float, length m
        Cycles per input turn.
    ratio : float
        Transmission ratio N, dimensionless.
    elapsed : ndarray, shape (r,)
        Middle of each record within the session, s.
    bends : complex ndarray, shape (r, 3, 1 + m)
        Mean and lines that a fit assigns to the second to fourth power of the time from the middle
        of a record, over their factorials: see `OrderLines`; s^2, s^3 and s^4.
    """

    orders: Sequence[float]
    ratio: float
    elapsed: Values
    bends: Lines


class DriveEffect:
    """An effect that the equations of motion, Eq. (9), lack: base of all effects of a drive model.

    A subclass is a frozen dataclass whose fields are the quantities of its effect; it overrides
    what it changes.

    Examples
    --------
    >>> [effect.name for effect in preset("calibrated").effects]
    ['load_inertia', 'damping_reference', 'mesh_stiffness_variation']
    """

    name: ClassVar[str]
    """Name of the effect, in model files and verdicts."""

    @property
    def only_reads(self) -> bool:
        """Whether it changes readings only, so that no motion has to be found anew."""
        reads = type(self).reading_lines is not DriveEffect.reading_lines
        return reads and not self.changes_motion

    @property
    def changes_motion(self) -> bool:
        """Whether the drive moves otherwise, and is not only read otherwise."""
        return type(self).apply is not DriveEffect.apply

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with this effect added."""
        return coefficients

    def at_port(self) -> tuple[str, Law] | None:
        """Return port and law, where the effect is a law at a port."""
        return None

    def reading_lines(self, records: Session) -> tuple[Values, Lines] | None:
        """Return what is added to the reading of the output angle, or None for nothing.

        Parameters
        ----------
        records : Session
            r records, each with m lines.

        Returns
        -------
        mean : ndarray, shape (r,)
            rad.
        lines : complex ndarray, shape (r, m)
            rad.
        """
        return None

    def torque_reading(self, elapsed: Values) -> Values | None:
        """Return what is added to the readings of input and output torque, or None for nothing.

        Parameters
        ----------
        elapsed : ndarray, shape (n,)
            Time of the session, s.

        Returns
        -------
        ndarray, shape (2, n), or None
            N.m.
        """
        return None

    def turned_back(self, frequency: Values) -> Lines | None:
        """Return by how much less the output angle is read for a torque there, or None for nothing.

        Parameters
        ----------
        frequency : ndarray, shape (...)
            rad/s; negative where the drive turns backward.

        Returns
        -------
        ndarray of complex, shape (...), or None
            rad/(N.m).
        """
        return None

    def on_sheet(self, ratio: float) -> DriveEffect:
        """Return the effect for a model that holds B_fc, not the damping of the torsion.

        Parameters
        ----------
        ratio : float
            Transmission ratio N, dimensionless.
        """
        return self

    def joined(self, other: Any) -> DriveEffect:
        """Return this effect and another of its name, as one.

        Parameters
        ----------
        other : DriveEffect
            An effect of the same type.

        Raises
        ------
        InvalidInput
            If a model cannot take the two.
        """
        raise InvalidInput("effects", self.name, "each effect once, at each port and order")

    def to_dict(self) -> dict[str, object]:
        """Return the effect as the TOML-like table that `effect_from_fields` reads."""
        return {"name": self.name} | effect_named(self.name).to_fields(self)


def check_line(effect: Any) -> None:
    """Refuse numbers of a line that are not finite, or an order that is not above 0.

    Parameters
    ----------
    effect : DriveEffect
        With ``order``, ``amplitude`` and ``phase``.

    Raises
    ------
    InvalidInput
        Naming effect and number.
    """
    real_number(f"{effect.name}.order", effect.order, above=0.0)
    real_number(f"{effect.name}.amplitude", effect.amplitude)
    real_number(f"{effect.name}.phase", effect.phase)


@dataclass(frozen=True)
class LawAtPort(DriveEffect):
    """A law at a port: friction, drag, clearance, hysteresis or another that is registered.

    Attributes
    ----------
    name : str
        Name of the effect, in model files and verdicts, e.g. ``"coulomb_friction"``.
    port : str
        ``"input"``, ``"output"``, ``"mesh"`` or ``"load"``, where the law may be.
    law : Law
        A law of the type that belongs to the name; its numbers are in SI.

    Raises
    ------
    InvalidInput
        For an unknown name, a port where such a law is not possible, or a law of another type.

    Examples
    --------
    >>> from pymoo_hdte.effects.friction import CoulombFriction
    >>> friction = LawAtPort("coulomb_friction", "input", CoulombFriction(0.02))
    >>> friction.port, friction.law.level
    ('input', 0.02)
    """

    name: str  # type: ignore[misc]
    port: str
    law: Law

    def __post_init__(self) -> None:
        effect = _law_effect(self.name)
        one_of(f"{self.name}.port", self.port, effect.ports)
        if type(self.law) is not effect.law:
            raise InvalidInput(f"{self.name}.law", self.law, f"a {effect.kind.__name__}")

    def apply(self, coefficients: Coefficients) -> Coefficients:
        """Return the coefficients with the law at its port."""
        return replace(coefficients, laws=(*coefficients.laws, (self.port, self.law)))

    def at_port(self) -> tuple[str, Law] | None:
        """Return port and law."""
        return self.port, self.law

    def to_dict(self) -> dict[str, object]:
        """Return the effect as a TOML-like table."""
        numbers = effect_named(self.name).to_fields(self.law)
        return {"name": self.name, "port": self.port} | numbers


def _law_effect(name: str) -> Effect:
    laws = [effect.name for effect in drive_effects() if effect.change is None]
    return effect_named(one_of("effect.name", name, laws))


def drive_effects() -> list[Effect]:
    """Return the effects that a drive model may have."""
    return [effect for effect in known_effects() if effect.ports]


def effect_from_fields(table: Fields) -> DriveEffect:
    """Build an effect from a table such as ``{ name = "damping_reference", factor = 8.7 }``.

    Raises
    ------
    InvalidInput
        For an unknown name, or a wrong, missing or superfluous field.
    """
    effect = effect_named(table.choice("name", [known.name for known in drive_effects()]))
    built: DriveEffect
    if effect.change is None:
        port = table.choice("port", effect.ports)
        built = LawAtPort(effect.name, port, effect.from_fields(table))
    else:
        built = effect.from_fields(table)
    table.finish()
    return built
