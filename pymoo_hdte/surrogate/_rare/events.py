"""Events of one or several responses: which of their values count as failure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from pymoo_hdte.checks import InvalidInput, one_of, real_number

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Event:
    """Something that happens or not, given the responses; ``|`` and ``&`` join events.

    Examples
    --------
    >>> event = (Response("g1") > 2.0) | (Response("g2") < 0.5)
    >>> event.responses
    ('g1', 'g2')
    """

    def __or__(self, other: Event) -> Event:
        return JointEvent("any", (self, _event(other)))

    def __and__(self, other: Event) -> Event:
        return JointEvent("all", (self, _event(other)))

    def __bool__(self) -> bool:
        raise TypeError("join events by | and &; `or`, `and` and chained comparisons keep one only")

    @property
    def responses(self) -> tuple[str | None, ...]:
        """Names of the responses, each once; None for the only one."""
        raise NotImplementedError

    @property
    def limits(self) -> tuple[Limit, ...]:
        """The limits it is made of."""
        raise NotImplementedError

    def margin(
        self, values: Mapping[str | None, Array], slack: Mapping[str | None, Array] | None = None
    ) -> Array:
        """Return what is above 0 where the event happens, same shape as the values.

        Parameters
        ----------
        values : mapping of str to ndarray
            The responses by name, in their units.
        slack : mapping of str to ndarray, optional
            By how much each may be nearer to its limit, in its unit.
        """
        raise NotImplementedError

    def chance(self, mean: Mapping[str | None, Array], std: Mapping[str | None, Array]) -> Array:
        """Return its probability for normal, independent responses, same shape as ``mean``.

        Parameters
        ----------
        mean, std : mapping of str to ndarray
            Of the responses by name, in their units.
        """
        raise NotImplementedError

    def table(self) -> dict[str, Any]:
        """Return the event as words and numbers."""
        raise NotImplementedError


def _event(given: Any) -> Event:
    if not isinstance(given, Event):
        raise InvalidInput("event", given, "an event, as Response('stress') > 250e6 makes it")
    return given


@dataclass(frozen=True)
class Limit(Event):
    """A response is beyond a bound; ``Response("stress") > 250e6`` makes it.

    Parameters
    ----------
    response : str or None
        Its name; None for the only one.
    bound : float
        In its unit.
    side : float
        Dimensionless: 1 where the event is above the bound, -1 where below.
    """

    response: str | None
    bound: float
    side: float

    @property
    def responses(self) -> tuple[str | None, ...]:
        """Names of the responses, each once; None for the only one."""
        return (self.response,)

    @property
    def limits(self) -> tuple[Limit, ...]:
        """The limits it is made of."""
        return (self,)

    def margin(
        self, values: Mapping[str | None, Array], slack: Mapping[str | None, Array] | None = None
    ) -> Array:
        """Return what is above 0 where the event happens, same shape as the values."""
        margin = self.side * (values[self.response] - self.bound)
        return margin if slack is None else margin + slack[self.response]

    def chance(self, mean: Mapping[str | None, Array], std: Mapping[str | None, Array]) -> Array:
        """Return its probability for normal, independent responses, same shape as ``mean``."""
        tiny = np.finfo(float).tiny
        return ndtr(self.margin(mean) / np.maximum(std[self.response], tiny))

    def table(self) -> dict[str, Any]:
        """Return the event as words and numbers."""
        return {"response": self.response, "bound": self.bound, "side": self.side}


@dataclass(frozen=True)
class JointEvent(Event):
    """Any or all of several events.

    Parameters
    ----------
    kind : {"any", "all"}
    parts : tuple of Event
    """

    kind: str
    parts: tuple[Event, ...]

    @property
    def responses(self) -> tuple[str | None, ...]:
        """Names of the responses, each once; None for the only one."""
        return tuple(dict.fromkeys(name for part in self.parts for name in part.responses))

    @property
    def limits(self) -> tuple[Limit, ...]:
        """The limits it is made of."""
        return tuple(limit for part in self.parts for limit in part.limits)

    def margin(
        self, values: Mapping[str | None, Array], slack: Mapping[str | None, Array] | None = None
    ) -> Array:
        """Return what is above 0 where the event happens, same shape as the values."""
        margins = [part.margin(values, slack) for part in self.parts]
        return np.max(margins, axis=0) if self.kind == "any" else np.min(margins, axis=0)

    def chance(self, mean: Mapping[str | None, Array], std: Mapping[str | None, Array]) -> Array:
        """Return its probability for normal, independent responses, same shape as ``mean``."""
        chances = np.array([part.chance(mean, std) for part in self.parts])
        if self.kind == "all":
            return np.prod(chances, axis=0)
        return 1.0 - np.prod(1.0 - chances, axis=0)

    def table(self) -> dict[str, Any]:
        """Return the event as words and numbers."""
        return {self.kind: [part.table() for part in self.parts]}


def event_from(table: Any) -> Event:
    """Return the event of a table that `Event.table` made.

    Raises
    ------
    InvalidInput
        If it is none.
    """
    if isinstance(table, dict) and sorted(table) == ["bound", "response", "side"]:
        if table["side"] not in (1.0, -1.0) or not isinstance(table["response"], str | None):
            raise InvalidInput("limit of an event", table, "a response, a bound and a side")
        return Limit(table["response"], real_number("bound", table["bound"]), table["side"])
    if isinstance(table, dict) and len(table) == 1:
        ((kind, parts),) = table.items()
        if isinstance(parts, list) and len(parts) > 1:
            return JointEvent(
                one_of("kind", kind, ("any", "all")), tuple(event_from(part) for part in parts)
            )
    raise InvalidInput("event", table, "a limit, or any or all of several")


@dataclass(frozen=True)
class Response:
    """A response by its name; comparing it with a number makes an event.

    Parameters
    ----------
    name : str or None
        Its name; None for the only one.

    Examples
    --------
    >>> event = (Response("stress") > 250e6) | (Response("margin") < 0.0)
    >>> event.responses
    ('stress', 'margin')
    """

    name: str | None = None

    def __gt__(self, bound: float) -> Event:
        return Limit(self.name, real_number("bound", bound), 1.0)

    def __lt__(self, bound: float) -> Event:
        return Limit(self.name, real_number("bound", bound), -1.0)
