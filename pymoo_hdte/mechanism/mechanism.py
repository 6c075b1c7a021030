"""A lumped mechanism: inertias, and ports with springs, dampers and laws between them.

M q'' = sum over inputs of B gain u - sum over ports of A (stiffness d + damping d' + laws(d, d')),
where the motion at a port is d = A^T q plus its kinematic error. The laws are those of
`pymoo_hdte.effects`; units are SI throughout, N and m or N.m and rad depending on the coordinate.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from pymoo_hdte.checks import InvalidInput, one_of, real_number
from pymoo_hdte.mechanism.believed import NOTHING, BelievedValue
from pymoo_hdte.mechanism.parts import Input, Loop, Port


@dataclass(frozen=True)
class Mechanism:
    """Coordinates, ports and inputs of a lumped mechanism; SI units throughout.

    M q'' is the force of the inputs on the coordinates q, less that of springs, dampers and laws at
    the ports: Lagrange's equations, as in Eqs. (3) to (9) of the paper.

    Attributes
    ----------
    inertias : mapping of str to BelievedValue
        Mass, kg, or inertia, kg.m2, by coordinate, which is measured where a record has a channel
        of its name.
    ports : sequence of Port
    inputs : sequence of Input
    loops : sequence of Loop
        Closed loops of records that have their references; an input without one is taken from its
        channel.
    angles : sequence of str or None
        Coordinates that are angles of a shaft, rad, at which gravity may pull; those of a linear
        axis are not. None if it is not known, which counts as none; the units of files tell.
    lengths : sequence of str or None
        Coordinates that are lengths, m. By default all that are no angles, where ``angles`` are
        given; a coordinate in neither is one of which nothing tells.

    Raises
    ------
    InvalidInput
        For a name that is used twice or refers to nothing, an inertia that is not positive, a
        stiffness or damping that is negative, a port or input that touches no coordinate, a gear
        at a port whose motion is not the angle of a shaft, or a gain that is not stated beside a
        quantity that is known exactly, a force sensor or another input.

    Examples
    --------
    >>> arm = Mechanism(
    ...     inertias={"q": BelievedValue(0.06, tolerance=0.5)},
    ...     ports=[Port("bearing", {"q": 1.0}, damping=BelievedValue(0.5, tolerance=0.5))],
    ...     inputs=[Input("torque", {"q": 1.0})],
    ... )
    >>> arm.coordinates, arm.port_names
    (('q',), ('bearing',))
    """

    inertias: Mapping[str, BelievedValue]
    ports: Sequence[Port] = ()
    inputs: Sequence[Input] = ()
    loops: Sequence[Loop] = ()
    angles: Sequence[str] | None = None
    lengths: Sequence[str] | None = None

    def __post_init__(self) -> None:
        for name, value in (
            ("inertias", MappingProxyType(dict(self.inertias))),
            ("ports", tuple(self.ports)),
            ("inputs", tuple(self.inputs)),
            ("loops", tuple(self.loops)),
            ("angles", None if self.angles is None else tuple(self.angles)),
            ("lengths", self._lengths()),
        ):
            object.__setattr__(self, name, value)
        if not self.inertias:
            raise InvalidInput("mechanism.inertias", {}, "at least one coordinate")
        for name, inertia in self.inertias.items():
            real_number(f"inertia of {name}", inertia.value, above=0.0)
        for port in self.ports:
            for what, element in (("stiffness", port.stiffness), ("damping", port.damping)):
                real_number(f"{what} of {port.name}", element.value, at_least=0.0)
        named = [*self.inertias, *self.port_names, *(actuation.name for actuation in self.inputs)]
        for name in named:
            if not isinstance(name, str) or not name or named.count(name) > 1:
                allowed = "a name of its own for each coordinate, port and input"
                raise InvalidInput("mechanism name", name, allowed)
        for port in self.ports:
            self._check_shares(f"motion of {port.name}", port.motion)
            for line in port.error:
                moving = (*self.coordinates, *port.followed)
                one_of(f"error of {port.name}", line.coordinate, moving)
            if port.gear:
                # Where the mechanism does not tell its angles, the gear is believed.
                turning = self.coordinates if self.angles is None else self.angles
                port.gear.check_at(port.name, port.motion, turning)
            for name, share in port.load.items():
                one_of(f"load of {port.name}", name, [actuation.name for actuation in self.inputs])
                real_number(f"load of {port.name}.{name}", share)
        for actuation in self.inputs:
            self._check_shares(f"acts of {actuation.name}", actuation.acts)
        for name in self.angles or ():
            one_of("mechanism.angles", name, self.coordinates)
        for name in self.lengths or ():
            others = [
                coordinate
                for coordinate in self.coordinates
                if coordinate not in (self.angles or ())
            ]
            one_of("mechanism.lengths", name, others)
        self._check_scales()
        for loop in self.loops:
            one_of("loop.input", loop.input, [actuation.name for actuation in self.inputs])
            one_of("loop.coordinate", loop.coordinate, self.coordinates)
            real_number("loop.position_gain", loop.position_gain)
            real_number("loop.speed_gain", loop.speed_gain)
            if not loop.limit > 0.0:
                raise InvalidInput("loop.limit", loop.limit, "above 0, or infinite")

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return tuple(self.inertias)

    @property
    def port_names(self) -> tuple[str, ...]:
        """Names of the ports."""
        return tuple(port.name for port in self.ports)

    def port(self, name: str) -> Port:
        """Return the port of that name; raises `InvalidInput` where there is none."""
        return self.ports[self.port_names.index(one_of("port", name, self.port_names))]

    def turns(self, port: Port) -> bool:
        """Tell whether the motion of a port is the angle of one shaft, geared or not."""
        moved = [name for name, share in port.motion.items() if share]
        return len(moved) == 1 and moved[0] in (self.angles or ()) and not port.followed

    @property
    def quantities(self) -> dict[str, BelievedValue]:
        """Believed values, SI, by the names that fits use; those that are 0 are left out."""
        quantities = {f"inertia of {name}": inertia for name, inertia in self.inertias.items()}
        for port in self.ports:
            quantities[f"stiffness of {port.name}"] = port.stiffness
            quantities[f"damping of {port.name}"] = port.damping
        for actuation in self.inputs:
            quantities[f"gain of {actuation.name}"] = actuation.gain
        return {name: believed for name, believed in quantities.items() if believed.value != 0.0}

    def with_values(self, values: Mapping[str, float], exactly: bool = True) -> Mechanism:
        """Return the mechanism with other values of `quantities`.

        Parameters
        ----------
        values : mapping of str to float
            SI, by name as in `quantities`; all others are unchanged.
        exactly : bool
            Whether they are known exactly; otherwise each keeps its tolerance or factor.

        Returns
        -------
        Mechanism

        Raises
        ------
        InvalidInput
            For a value that is not finite, an inertia that is not above 0, or another value but a
            gain that is negative.
        """

        def known(name: str, before: BelievedValue) -> BelievedValue:
            if name not in values:
                return before
            return replace(NOTHING if exactly else before, value=float(values[name]))

        inertias = {
            name: known(f"inertia of {name}", inertia) for name, inertia in self.inertias.items()
        }
        ports = [
            replace(
                port,
                stiffness=known(f"stiffness of {port.name}", port.stiffness),
                damping=known(f"damping of {port.name}", port.damping),
            )
            for port in self.ports
        ]
        inputs = [
            replace(actuation, gain=known(f"gain of {actuation.name}", actuation.gain))
            for actuation in self.inputs
        ]
        return replace(self, inertias=inertias, ports=ports, inputs=inputs)

    def _lengths(self) -> tuple[str, ...] | None:
        if self.lengths is not None:
            return tuple(self.lengths)
        if self.angles is None:
            return None
        return tuple(name for name in self.inertias if name not in self.angles)

    def _check_scales(self) -> None:
        """Refuse an input without a gain beside anything that is not in units of its signal."""
        known = [name for name, believed in self.quantities.items() if believed.known]
        sensors = [f"force sensor {port.name}" for port in self.ports if port.read]
        for driving in self.inputs:
            own, allowed = f"gain of {driving.name}", "a number, with a tolerance or factor: "
            exact = [f"{name} is known exactly" for name in known if name != own]
            further = [
                f"input {actuation.name}" for actuation in self.inputs if actuation is not driving
            ]
            scales = [f"{name} has a scale of its own" for name in (*further, *sensors)]
            for reason in (*exact, *scales) if not driving.scaled else ():
                raise InvalidInput(own, None, allowed + reason)

    def _check_shares(self, name: str, shares: Mapping[str, float]) -> None:
        for coordinate, share in shares.items():
            one_of(name, coordinate, self.coordinates)
            real_number(f"{name}.{coordinate}", share)
        if not any(shares.values()):
            raise InvalidInput(name, dict(shares), "a share other than 0 of some coordinate")
