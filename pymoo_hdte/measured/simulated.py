"""Records of which not every coordinate is measured: what the sensors give against a simulation.

The residual is measured minus simulated position, or reading, from the measured inputs. It costs an
integration for every step of a fit, where force balances cost a transform: minutes for records of
some thousand samples. Twenty samples to a period of the motion are wanted, as `simulate` takes
inputs for straight between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy.candidate import Candidate
from pymoo_hdte.discrepancy.evidence import Response, Vector
from pymoo_hdte.discrepancy.fit import Fit
from pymoo_hdte.discrepancy.objective import LOST, Unknowns, built
from pymoo_hdte.measured.whitened import WhitenedData
from pymoo_hdte.mechanism import LawAt, Mechanism, Port, Record
from pymoo_hdte.mechanism.balances import PortMotion
from pymoo_hdte.mechanism.motion import highest_share, noise_of
from pymoo_hdte.mechanism.simulation import Simulation, simulate

Values = NDArray[np.float64]


class Outputs:
    """What the sensors of one record give; see `whitened.Spectrum`.

    Parameters
    ----------
    mechanism : Mechanism
        Believed; its simulation gives the motion of the ports.
    record : Record
    names : tuple of str
        Channels that are compared.
    known : sequence of LawAt

    Raises
    ------
    InvalidInput
        If a channel is missing.
    ArithmeticError
        If the believed mechanism diverges.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        record: Record,
        names: tuple[str, ...],
        known: Sequence[LawAt],
    ) -> None:
        self.record, self._names = record, names
        for name in names:
            if name not in record.channels:
                allowed = f"{name} among them, as in the other records"
                raise InvalidInput(
                    f"channels of record {record.name}", tuple(record.channels), allowed
                )
        n = len(record.time)
        frequency = np.arange(n) / (2.0 * n * record.step)
        self.frequency = frequency[frequency <= highest_share(record.step)]
        self.kept = np.ones((len(names), len(self.frequency)), dtype=bool)
        spread = np.array([noise_of(record.channels[name]) for name in names])
        self.noise = np.repeat(spread[:, None], len(self.frequency), axis=1)
        run = self.run(mechanism, known)
        self.ports = {
            port.name: PortMotion(_along(port, run.position), _along(port, run.speed))
            for port in mechanism.ports
        }

    def run(self, mechanism: Mechanism, effects: Sequence[LawAt]) -> Simulation:
        """Return the simulation of the record."""
        return simulate(mechanism, self.record, effects)

    @property
    def time(self) -> Values:
        """Times of the record, s, shape (n,)."""
        return self.record.time

    def left(self, run: Simulation) -> Values:
        """Return coefficients of measured minus simulated, (n_parts, n_bins)."""
        simulated = run.position | run.forces
        return np.array(
            [
                dct(self.record.channels[name] - simulated[name], norm="ortho")
                for name in self._names
            ]
        )[:, : len(self.frequency)]

    def in_time(self, coefficients: Values) -> Values:
        """Return the signal, shape (n,), of coefficients (n_bins,)."""
        missing = len(self.record.time) - len(coefficients)
        return np.asarray(dct(np.pad(coefficients, (0, missing)), type=3, norm="ortho"))


@dataclass(frozen=True, eq=False)
class SimulatedData(WhitenedData):
    """Sensors' outputs against simulation, whitened."""

    spectra: tuple[Outputs, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Channels that are compared."""
        return output_names(self.mechanism, [one.record for one in self.spectra])

    def what(self, part: str) -> str:
        """Return in words what a part is."""
        return f"simulated {part}"

    def residuals(self, base: Vector, effects: Sequence[LawAt]) -> Vector:
        """Return whitened residuals, shape (n,), at base parameters (n_base,) with effects.

        Where the mechanism diverges, `LOST`.
        """
        values = {one.name: float(v) for one, v in zip(self.base, base, strict=True)}
        mechanism, found = self.mechanism.with_values(values), []
        for one, deviation in zip(self.spectra, self.deviation, strict=True):
            try:
                left = one.left(one.run(mechanism, (*self.known, *effects)))
                for part, name in enumerate(self.names):
                    # The constant of a reading is in its first coefficient.
                    zero = values.get(f"zero of {name}", 0.0)
                    left[part, 0] -= zero * np.sqrt(len(one.time))
                found.append((left / deviation)[one.kept])
            except ArithmeticError:
                found.append(np.full(int(one.kept.sum()), LOST))
        return np.concatenate(found)

    def objective(
        self, candidates: Sequence[Candidate], slopes: Values | None = None
    ) -> OutputObjective:
        """Return whitened residuals with candidates; slopes of the base are kept where given."""
        return OutputObjective(self, candidates, slopes)

    def response(self, fitted: Fit) -> Response:
        """Return how the whitened residuals of a fit respond to further effects."""
        base = fitted.values[: len(self.base)]
        stands = tuple(fitted.effects)
        before = self.residuals(base, stands)  # type: ignore[arg-type]
        return lambda added: self.residuals(base, (*stands, *added)) - before  # type: ignore[arg-type]


class OutputObjective(Unknowns):
    """Whitened residuals of outputs and their derivatives for a set of candidates."""

    def __init__(
        self, data: SimulatedData, candidates: Sequence[Candidate], slopes: Values | None
    ) -> None:
        super().__init__(data.base, candidates)
        self.data, self.slopes = data, slopes

    def residuals(self, values: Vector) -> Vector:
        """Return residuals at values (n_parameters,)."""
        n_base = len(self.data.base)
        effects = [one for part in built(self.candidates, values[n_base:]) for one in part]
        return self.data.residuals(values[:n_base], effects)  # type: ignore[arg-type]

    def jacobian(self, values: Vector) -> Values:
        """Return derivatives (n, n_parameters) by parameters in units of their scale."""
        n_base = len(self.data.base)
        kept = self.slopes is not None
        places = range(n_base if kept else 0, len(values))
        moved = self._quotients(values, places)
        return np.vstack([self.slopes, moved]).T if kept else moved.T  # type: ignore[list-item]

    def slopes_at(self, values: Vector) -> Values:
        """Return derivatives by base parameters in units of their scale, (n_base, n)."""
        return self._quotients(values, range(len(self.data.base)))

    def _quotients(self, values: Vector, places: Sequence[int]) -> Values:
        steps, stands = self.steps(values), self.residuals(values)
        found = np.empty((len(places), len(stands)))
        for row, place in enumerate(places):
            moved = values.copy()
            moved[place] += steps[place] * self.scale[place]
            found[row] = (self.residuals(moved) - stands) / steps[place]
        return found


def _along(port: Port, motion: dict[str, Values]) -> Values:
    return np.asarray(np.sum([share * motion[name] for name, share in port.motion.items()], axis=0))


def output_names(mechanism: Mechanism, records: Sequence[Record]) -> tuple[str, ...]:
    """Return the coordinates and force sensors that the first record has channels of."""
    read = [port.name for port in mechanism.ports if port.read]
    return tuple(name for name in (*mechanism.coordinates, *read) if name in records[0].channels)


def simulated_data(
    mechanism: Mechanism, records: Sequence[Record], known: Sequence[LawAt] = ()
) -> SimulatedData:
    """Return records of a mechanism with the noise of their sensors.

    Parameters
    ----------
    mechanism : Mechanism
    records : sequence of Record
    known : sequence of LawAt
        Effects that the mechanism has.

    Raises
    ------
    InvalidInput
        If no coordinate and no force sensor has a channel, or a record lacks one of the others'.
    ArithmeticError
        If the believed mechanism diverges.
    """
    names = output_names(mechanism, records)
    if not names:
        allowed = "a coordinate or a force sensor among them"
        raise InvalidInput(
            f"channels of record {records[0].name}", tuple(records[0].channels), allowed
        )
    spectra = tuple(Outputs(mechanism, record, names, known) for record in records)
    return SimulatedData(mechanism, spectra, tuple(one.noise for one in spectra), tuple(known))
