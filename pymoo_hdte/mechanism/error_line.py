"""The kinematic error of a port, which moves it while its shafts turn."""

from __future__ import annotations

from dataclasses import dataclass

from pymoo_hdte.checks import real_number


@dataclass(frozen=True)
class ErrorLine:
    """Kinematic error of a port: amplitude sin(order q + phase) of a coordinate q, as Eq. (1).

    Attributes
    ----------
    coordinate : str
        Name of q.
    order : float
        Cycles per turn of an angle in rad; of a length, radians per m.
    amplitude : float
        In the unit of the port's motion, m or rad.
    phase : float
        rad.

    Raises
    ------
    InvalidInput
        For a number that is not finite.

    Examples
    --------
    >>> ErrorLine("motor", order=2.0, amplitude=1e-4, phase=0.0).order
    2.0
    """

    coordinate: str
    order: float
    amplitude: float
    phase: float

    def __post_init__(self) -> None:
        for name in ("order", "amplitude", "phase"):
            real_number(f"error.{name}", getattr(self, name))
