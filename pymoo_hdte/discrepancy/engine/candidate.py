"""A candidate: one effect that the workflow can name, with its unknowns, their ranges, its words.

A candidate turns a vector of values into effects of the drive model; the laws themselves stand in
`pymoo_hdte.drive`. Amplitude and phase of a line are searched as its cosine and sine parts, in
which the prediction is close to linear. A periodic effect brings its harmonics along: a ripple of
order 6 with a little of order 12 is one effect and not two.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.drive import Effect
from pymoo_hdte.drive.effects import Place, place_of

Values = Sequence[float]

HARMONIC_NAMES = ("", "second_", "third_")
"""Prefixes of the parameters of a line's harmonics."""
_LINEAR = ("_cosine", "_sine", "mean", "narrowest", "locked")
_HARMONIC_SHARE = 0.2
"""Typical size of a further harmonic, as a share of the first."""


@dataclass(frozen=True)
class Candidate:
    """One effect at one port, perhaps at one order.

    Attributes
    ----------
    name, port : str
    parameters : tuple of Parameter
        Its unknowns; ``start`` is a typical strength.
    starts : tuple of tuple of float
        Where the joint fit begins, and the directions that the screening tries.
    build : callable
        From values to the effects of the drive model that make it up.
    sentence : str
        What it is, for the report.
    order : float or None
        Cycles per input turn, where the candidate has one.
    exact : bool
        Whether its form leaves nothing open, so that it must explain the misfit down to the noise;
        the curve of a friction or a stiffness is only ever approximately the library's.
    listed : bool
        Whether its name may stand in a verdict; if not, it is there so that what it explains is
        not laid at another's door.
    frees : str or None
        Base parameter whose tolerance it lifts.
    form : str
        In a word, where the library holds several forms of one effect.
    """

    name: str
    port: str
    parameters: tuple[Parameter, ...]
    starts: tuple[tuple[float, ...], ...]
    build: Callable[[Values], tuple[Effect, ...]]
    sentence: str
    order: float | None = None
    exact: bool = False
    listed: bool = True
    frees: str | None = None
    form: str = ""

    @property
    def label(self) -> str:
        """Name, form, port and order in one word."""
        order = "" if self.order is None else f"@{self.order:.4g}"
        form = f"/{self.form}" if self.form else ""
        return f"{self.name}{form}:{self.port}{order}"

    @property
    def places(self) -> frozenset[Place]:
        """Where its effects stand in a drive model, which takes one of a name at each place."""
        return frozenset(place_of(effect) for effect in self.build(self.starts[0]))

    def goes_with(self, other: Candidate) -> bool:
        """Tell whether a drive may have both: no two of their effects at one place."""
        return not self.places & other.places

    @property
    def linear(self) -> bool:
        """Whether a prediction is close to linear in all its unknowns: parts of lines, and levels.

        Each of `starts` then goes along one of them.
        """
        return all(one.name.endswith(_LINEAR) for one in self.parameters)

    @property
    def unknowns(self) -> int:
        """Number of parameters that it adds to a fit or sets free."""
        return len(self.parameters) + (self.frees is not None)


def out_of_tolerance(name: str, words: str) -> Candidate:
    """Return the candidate that lifts the tolerance of a base parameter, which is ``words``."""
    return Candidate(
        "parameter",
        name,
        (),
        ((),),
        lambda v: (),
        f"The {words} lies outside its tolerance.",
        exact=True,
        frees=name,
    )


def unknown(name: str, lower: float, upper: float, typical: float) -> Parameter:
    """Return a parameter that starts at its typical size."""
    return Parameter(name, typical, lower, upper, abs(typical))


def wave(name: str, largest: float, typical: float, harmonics: int = 1) -> tuple[Parameter, ...]:
    """Return the cosine and sine parts of a line and of its harmonics.

    Parameters
    ----------
    name : str
        Of the amplitude.
    largest, typical : float
        Amplitudes.
    harmonics : int
        1 for the line alone.
    """
    found = []
    for place, prefix in enumerate(HARMONIC_NAMES[:harmonics]):
        size = typical if place == 0 else _HARMONIC_SHARE * typical
        start = typical if place == 0 else 0.0
        found.append(Parameter(f"{prefix}{name}_cosine", start, -largest, largest, size))
        found.append(Parameter(f"{prefix}{name}_sine", 0.0, -largest, largest, size))
    return tuple(found)


def wave_starts(parameters: Sequence[Parameter]) -> tuple[tuple[float, ...], ...]:
    """Return one start along each part of a `wave`, and along its mean."""
    sizes = np.diag([parameter.scale for parameter in parameters])
    return tuple(tuple(row) for row in sizes.tolist())


def lines_of(values: Values) -> list[tuple[int, float, float]]:
    """Return (multiple of the order, amplitude, phase) for the values of a `wave`."""
    parts = np.reshape(values, (-1, 2))
    return [(place + 1, *polar(cosine, sine)) for place, (cosine, sine) in enumerate(parts)]


def harmonics_among(orders: Sequence[float], order: float, most: int) -> int:
    """Return how many of order, 2 order, 3 order, ... the ``orders`` hold; at least 1."""
    count = 1
    while count < most and any(abs((count + 1) * order - one) < 1e-6 for one in orders):
        count += 1
    return count


def line_with_variance(
    cosine: float, sine: float, covariance: NDArray[np.float64]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return amplitude and phase of a line, each with its variance.

    ``covariance`` is that of its cosine and sine part, shape (2, 2). A phase is never less certain
    than one of which nothing is known.
    """
    amplitude, phase = polar(cosine, sine)
    along = np.array([np.cos(phase), np.sin(phase)])
    across = np.array([-np.sin(phase), np.cos(phase)])
    sidewise = float(across @ covariance @ across)
    nothing_known = np.pi**2 / 3.0
    of_phase = sidewise / amplitude**2 if sidewise < nothing_known * amplitude**2 else nothing_known
    return (amplitude, float(along @ covariance @ along)), (phase, of_phase)


def polar(cosine: float, sine: float) -> tuple[float, float]:
    """Return amplitude and phase of cosine cos(x) - sine sin(x) = amplitude cos(x + phase)."""
    return float(np.hypot(cosine, sine)), float(np.arctan2(sine, cosine))


@dataclass(frozen=True)
class Parameter:
    """One unknown.

    Attributes
    ----------
    name : str
    start, lower, upper : float
        SI.
    scale : float
        Its natural size, the unit of the search.
    prior : float
        Standard deviation around ``start``; infinite for a parameter with bounds only.
    """

    name: str
    start: float
    lower: float
    upper: float
    scale: float
    prior: float = np.inf


@dataclass(frozen=True)
class Layout:
    """Where each parameter stands in a vector of values, shape (..., n_parameters)."""

    parameters: tuple[Parameter, ...]

    def __len__(self) -> int:
        return len(self.parameters)

    def index(self, name: str) -> int:
        """Return the place of a parameter."""
        return [parameter.name for parameter in self.parameters].index(name)

    def array(self, attribute: str) -> NDArray[np.float64]:
        """Return one attribute of all parameters, shape (n_parameters,)."""
        return np.array([getattr(parameter, attribute) for parameter in self.parameters])


_PORT = r"([A-Za-z]\w*(?: of \w+)?)"


_LABEL = re.compile(r"([a-z]+(?:_[a-z]+)*)(?:/([a-z\d.+]+))?:" + _PORT + r"(?:@([\d.e+-]*\d))?")


def in_words(text: str) -> str:
    """Return a text with all labels of candidates, such as ``torque_ripple:input@6``, in words."""
    return _LABEL.sub(_words, text).replace(")+", ") and ")


def _words(label: re.Match[str]) -> str:
    name, form, port, order = label.groups()
    details = [port.replace("_", " "), form, None if order is None else f"order {order}"]
    return f"{name.replace('_', ' ')} ({', '.join(one for one in details if one)})"
