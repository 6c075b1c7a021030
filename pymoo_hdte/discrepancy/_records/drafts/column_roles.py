"""Which column of a log is what, by physics first and by titles second.

A speed is the derivative of a position, two encoders of one drive are proportional to each other,
and a force or current is what the balance of mass, friction, gravity and spring explains.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from pymoo_hdte._io.layout import CHANNEL_UNITS, COUNTS
from pymoo_hdte._io.unstated import UnstatedTable
from pymoo_hdte.discrepancy._records.drafts.column_titles import read_title
from pymoo_hdte.mechanism.motion import noise_of
from pymoo_hdte.units import UNITS

Name = str | int
Values = NDArray[np.float64]

_WIDTHS = (1, 4, 16, 64)
"""Rows over which signals are averaged: of slow motion the derivative drowns in noise without."""
_ROWS_PER_WIDTH = 30
"""Averages that a record must hold at least."""
_COMPARED = 6000
"""Rows of all records together that are compared."""
_MOST_FILES = 8
_DERIVATIVE = 0.98
"""Share of a column's variance that the derivative of another explains, from which it is that: of a
force the friction of a joint explains less, since it has two signs."""
_SURE_DERIVATIVE = 0.999
"""The same, against what titles say."""
_SAME = 0.9999
"""Share from which two columns are one signal, or two encoders of a drive."""
_COMPUTED = 1.0 - 1e-10
"""Share from which one column was computed from another: no two sensors agree so well."""
_ALIKE = 1.0 - 1e-5
"""The same for forces, which are noisier."""
_AS_GOOD = 0.005
"""Share of a force by which balances count as equally good."""
_CLOSE = 0.4
"""Of scores, up to which two forces may be what was wanted and what was measured."""
_LIKE = 0.9
"""Share of one of them that the other explains, at least."""
_FINITE = 0.9
"""Least share of numbers in a column."""
_COUNTED = 1000.0
"""Least size of whole numbers that are counts of an encoder."""
_RATES = (5.0, 5e4)
"""Hz, of logs of machines: tells the unit of time where its title does not."""
_TIME_UNITS = {"s": ("s", 1.0), "ms": ("ms", 1.0), "us": ("ms", 1e-3), "ns": ("ms", 1e-6)}
"""Units of stamps with how a layout says them."""
_PERIODS = (("rad", 2.0 * math.pi), ("deg", 360.0), ("rev", 1.0))
_NEAR = 0.02
"""Relative, of a period from a known one."""
_RATIOS = (10.0, 1000.0)
"""Of drives: without titles, smaller ones may be those of joints that move together."""
_EVEN = 0.3
"""Median deviation of the steps of a column of time without a title from their median, relative."""
_RISES = 0.99
"""Share of the steps of a column of time that are above zero; others may be zero."""
_DIFFERENTIATED, _MOVES, _STANDS, STILL = 0.5, 0.3, 1.0, 0.1
"""Scores of a position that has a speed, of its travel over the widest, and of one that stands
still, with the share of the widest travel up to which it does."""
_RUBS, _NUMBERED, _ROUGHER, _IS_FORCE = 0.5, 0.3, 0.3, 0.1
"""Scores of a force beside the share of it that motion explains: of its friction, of the number of
the joint in its title, of being rougher than the position, of being no current or voltage."""
_WANTED, _MULTIPLE = 0.5, 0.5
"""Scores taken from what was wanted, by its title, and from exact multiples of other columns."""
FORCES = ("torque", "force", "current", "voltage")


@dataclass(frozen=True)
class ColumnGuess:
    """What a column is taken for.

    Attributes
    ----------
    column : str or int
        As the layout calls it.
    title : str
    quantity : str
        One of `column_titles.QUANTITIES`.
    unit : str
        One of `CHANNEL_UNITS` or `COUNTS`.
    why : tuple of str
        From what, each the end of a sentence.
    sure : {"sure", "likely", "unsure"}
    unit_sure : bool
        Whether the unit is known, not assumed.
    options : dict of str to float or bool
        Further keys of a channel: ``scale``, ``divided_by``, ``unwrap``, ``wraps``,
        ``counts_per_turn``.
    file : str
        Where it stands, if it is not in the same file as the others.
    """

    column: Name
    title: str
    quantity: str
    unit: str
    why: tuple[str, ...]
    sure: str
    unit_sure: bool
    options: Mapping[str, float | bool] = field(default_factory=dict)
    file: str = ""

    @property
    def factor(self) -> float:
        """To SI."""
        unit = (
            2.0 * math.pi / float(self.options["counts_per_turn"])
            if self.unit == COUNTS
            else CHANNEL_UNITS[self.unit]
        )
        scale = float(self.options.get("scale", 1.0)) / float(self.options.get("divided_by", 1.0))
        return unit * scale


@dataclass(frozen=True)
class Balance:
    """Force as inertia a + damping v + dry sign(v) + stiffness q + gravity sin(q + phase) + c.

    Attributes
    ----------
    share : float
        Of the variance of the force that is explained.
    inertia, damping, dry, stiffness, gravity : float
        Per unit of the force's column, the rest in SI.
    force, acceleration, speed, position : float
        Standard deviations; the acceleration is smoothed.
    """

    share: float
    inertia: float
    damping: float
    dry: float
    stiffness: float
    gravity: float
    force: float
    acceleration: float
    speed: float
    position: float

    def at_rate(self, rate: float) -> Balance:
        """Return a balance whose time is in rows as one in seconds, at a sampling rate in Hz."""
        return replace(
            self,
            inertia=self.inertia / rate**2,
            damping=self.damping / rate,
            acceleration=self.acceleration * rate**2,
            speed=self.speed * rate,
        )


@dataclass(frozen=True, eq=False)
class Roles:
    """What the columns of a log are taken for.

    Attributes
    ----------
    time : ColumnGuess or None
    sample_rate : float or None
        Hz, of rows without a column of time, where a speed tells it.
    coordinates : tuple of ColumnGuess
        One; or two encoders of a drive, input first.
    forces : tuple of ColumnGuess
        None, one; or of a bench two, input first.
    ratio : float
        Input turns per output turn of two encoders; 0 for one.
    balance : Balance or None
        Of the last coordinate and the first force.
    remarks : tuple of str
        What was seen, where titles and data disagree, and what other columns are.
    """

    time: ColumnGuess | None
    sample_rate: float | None
    coordinates: tuple[ColumnGuess, ...]
    forces: tuple[ColumnGuess, ...]
    ratio: float
    balance: Balance | None
    remarks: tuple[str, ...]


class Log:
    """Columns of files with the same columns, smoothed and differentiated to be compared.

    Parameters
    ----------
    tables : sequence of UnstatedTable
        At least one, all with the same columns.
    """

    def __init__(self, tables: Sequence[UnstatedTable]) -> None:
        self.tables = tables
        reference = tables[0]
        self.hints = {
            name: read_title(reference.titles.get(name, ""), reference.units.get(name, ""))
            for name in reference.columns
        }
        self.titles = reference.titles
        self.periods = {
            name: period
            for name in reference.columns
            if self.hints[name].quantity in ("", "position")
            and (period := _period([table.columns[name] for table in tables])) is not None
        }
        self._values = [
            {name: self._cleaned(name, values) for name, values in table.columns.items()}
            for table in tables[:_MOST_FILES]
        ]
        self.names = [
            name
            for name in reference.columns
            if all(
                np.isfinite(table.columns[name]).mean() > _FINITE for table in tables[:_MOST_FILES]
            )
            and any(np.ptp(values[name]) > 0.0 for values in self._values)
        ]
        self.time, self.step = self._time()

    def label(self, name: Name) -> str:
        """Return how sentences call a column."""
        title = self.titles.get(name, "")
        if isinstance(name, str):
            return name
        return f"column {name}" + (f" ({title})" if title else "")

    @property
    def signals(self) -> list[Name]:
        """Names of all columns that vary, but for that of time."""
        return [name for name in self.names if self.time is None or name != self.time.column]

    def values(self, name: Name) -> list[Values]:
        """Return a column of each file without gaps and turns, in its unit."""
        return [values[name] for values in self._values]

    @cached_property
    def _smoothed(self) -> dict[int, dict[Name, tuple[Values, Values, Values]]]:
        """By width: level, derivative and second derivative of each column, rows compared."""
        rows = sum(len(next(iter(signals.values()))) for signals in self._values)
        smoothed: dict[int, dict[Name, tuple[Values, Values, Values]]] = {}
        for width in _WIDTHS:
            parts: dict[Name, list[tuple[Values, Values, Values]]] = {}
            for index, signals in enumerate(self._values):
                length = len(next(iter(signals.values())))
                if length < _ROWS_PER_WIDTH * width:
                    continue
                # Rows may be uneven: the mean of a signal belongs to the mean of its times.
                moments = _averaged(self._moments(index), width)
                inside = slice(2 * width, length - 2 * width, max(1, rows // _COMPARED))
                for name in self.signals:
                    level = _averaged(signals[name], width)
                    rate = np.gradient(level, moments)
                    second = np.gradient(rate, moments)
                    parts.setdefault(name, []).append((level[inside], rate[inside], second[inside]))
            if parts:
                smoothed[width] = {
                    name: tuple(np.concatenate(arrays) for arrays in zip(*of_files, strict=True))  # type: ignore[misc]
                    for name, of_files in parts.items()
                }
        return smoothed

    @cached_property
    def _shares(self) -> dict[str, tuple[Values, Values]]:
        """Best share of each column (second index) that each other explains, with the slope.

        By ``level``, or ``rate`` for its derivative.
        """
        count = len(self.signals)
        shares = {}
        for index, kind in enumerate(("level", "rate")):
            best, slopes = np.zeros((count, count)), np.zeros((count, count))
            for signals in self._smoothed.values():
                x = np.array([signals[name][index] for name in self.signals])
                y = np.array([signals[name][0] for name in self.signals])
                x, y = x - x.mean(axis=1)[:, None], y - y.mean(axis=1)[:, None]
                xx, yy, xy = np.sum(x * x, axis=1), np.sum(y * y, axis=1), x @ y.T
                with np.errstate(divide="ignore", invalid="ignore"):
                    share = np.nan_to_num(xy**2 / np.outer(xx, yy), posinf=0.0)
                    slope = np.nan_to_num(xy / xx[:, None], posinf=0.0, neginf=0.0)
                better = share > best
                best, slopes = np.where(better, share, best), np.where(better, slope, slopes)
            shares[kind] = best, slopes
        return shares

    def _share(self, kind: str, name: Name, other: Name) -> tuple[float, float]:
        at, to = self.signals.index(name), self.signals.index(other)
        share, slope = self._shares[kind]
        return float(share[at, to]), float(slope[at, to])

    def derivative(self, name: Name, other: Name) -> tuple[float, float]:
        """Return which share of another column the derivative of one explains, and their ratio."""
        return self._share("rate", name, other)

    def same(self, name: Name, other: Name) -> tuple[float, float]:
        """Return which share of another column a column explains, and their ratio."""
        return self._share("level", name, other)

    def ratio(self, name: Name, other: Name, force: Name | None) -> float:
        """Return how many times a column another one is, beside what a force twists them apart."""
        signals = self._smoothed[min(self._smoothed)]
        columns = [signals[name][0], np.ones_like(signals[name][0])]
        columns += [signals[force][0]] if force is not None else []
        fitted, *_ = np.linalg.lstsq(np.column_stack(columns), signals[other][0], rcond=None)
        return float(fitted[0])

    def roughness(self, name: Name) -> float:
        """Return the steps between rows over the variation of a column; 0 for a smooth one."""
        steps = [float(np.std(np.diff(values))) for values in self.values(name)]
        whole = [float(np.std(values)) for values in self.values(name)]
        return max(steps) / (max(whole) or 1.0)

    def noise(self, name: Name) -> float:
        """Return the white noise of a column over its variation."""
        return max(
            noise_of(values, jumps=True) / (float(np.std(values)) or 1.0)
            for values in self.values(name)
        )

    def balance(self, position: Name, force: Name, factor: float = 1.0) -> Balance:
        """Return what motion explains of a force.

        Parameters
        ----------
        position, force : str or int
        factor : float
            Of the position to SI.
        """
        balances = [
            self._balance(signals, position, force, factor) for signals in self._smoothed.values()
        ] or [Balance(*[0.0] * 10)]
        best = max(balance.share for balance in balances)
        # Noise of an acceleration makes its coefficient too small: the smoothest of the best.
        return next(balance for balance in reversed(balances) if balance.share >= best - _AS_GOOD)

    def explained(self, position: Name) -> dict[Name, tuple[float, float]]:
        """Return by column which share of it motion explains, and which share friction has.

        The second is the size of friction, over that of the column; 0 where it would push.
        """
        explained: dict[Name, tuple[float, float]] = dict.fromkeys(self.signals, (0.0, 0.0))
        for averaged in self._smoothed.values():
            basis = _basis(*averaged[position])
            signals = np.array([averaged[name][0] for name in self.signals]).T
            fitted, *_ = np.linalg.lstsq(basis, signals, rcond=1e-9)
            power = np.var(signals, axis=0)
            unexplained = np.mean((signals - basis @ fitted) ** 2, axis=0)
            friction = basis[:, 1:3] @ fitted[1:3]
            works = np.mean(friction * basis[:, 1:2], axis=0)
            for at, name in enumerate(self.signals):
                if not power[at]:
                    continue
                share = 1.0 - float(unexplained[at] / power[at])
                size = math.sqrt(float(np.mean(friction[:, at] ** 2) / power[at]))
                if share > explained[name][0]:
                    explained[name] = share, size if works[at] > 0.0 else 0.0
        return explained

    @staticmethod
    def _balance(
        signals: Mapping[Name, tuple[Values, Values, Values]],
        position: Name,
        force: Name,
        factor: float,
    ) -> Balance:
        q, v, a = (factor * part for part in signals[position])
        u = signals[force][0]
        scales = [float(np.std(part)) or 1.0 for part in (a, v, q)]
        basis = _basis(q, v, a)
        coefficients, *_ = np.linalg.lstsq(basis, u, rcond=1e-9)
        power = float(np.var(u))
        share = 1.0 - float(np.mean((u - basis @ coefficients) ** 2)) / power if power else 0.0
        # Of sine and spring over a small travel only the sum is known.
        plain, *_ = np.linalg.lstsq(basis[:, [0, 1, 2, 3, 6]], u, rcond=1e-9)
        return Balance(
            share,
            plain[0] / scales[0],
            plain[1] / scales[1],
            plain[2],
            plain[3] / scales[2],
            math.hypot(coefficients[4], coefficients[5]),
            float(np.std(u)),
            *(float(np.std(part)) for part in (a, v, q)),
        )

    def _cleaned(self, name: Name, values: Values) -> Values:
        finite = np.isfinite(values)
        if not finite.any():
            return np.zeros_like(values)
        if not finite.all():
            values = np.interp(np.arange(len(values)), np.flatnonzero(finite), values[finite])
        if name in self.periods:
            values = np.unwrap(values, period=self.periods[name])
        return values

    def _moments(self, index: int) -> Values:
        """Return the times of a file's rows, s, or their numbers without a column of time."""
        rows = np.arange(len(next(iter(self._values[index].values()))), dtype=float)
        if self.time is None:
            return rows
        stamps = self._values[index][self.time.column] * self.time.factor
        # Rows with one stamp are apart all the same.
        return stamps if np.all(np.diff(stamps) > 0.0) else rows * self.step

    def _time(self) -> tuple[ColumnGuess | None, float]:
        """Return the column of time, and its usual step, s; 1 row without one."""
        candidates: list[tuple[bool, float, Name, float]] = []
        for name in self.names:
            hint, steps = self.hints[name], np.concatenate([np.diff(v) for v in self.values(name)])
            usual = float(np.median(steps))
            if usual <= 0.0 or np.mean(steps > 0.0) < _RISES or np.any(steps < 0.0):
                continue
            spread = float(np.median(np.abs(steps - usual))) / usual
            if hint.quantity not in ("", "time") and not hint.weak:
                continue
            titled = hint.quantity == "time"
            if titled or (spread < _EVEN and not hint.quantity):
                candidates.append((titled, -spread, name, usual))
        if not candidates:
            return None, 1.0
        titled, _, name, usual = max(candidates, key=lambda candidate: candidate[:2])
        stated = self.hints[name].unit
        unit, scale, sure = self._unit_of_time(stated, usual)
        rate = 1.0 / (usual * CHANNEL_UNITS[unit] * scale)
        why = [f"it rises by {usual:g} from row to row, which is {rate:.4g} Hz in this unit"]
        why += ["its title says so"] if titled else ["no other column rises so evenly"]
        if stated:
            why.append("unit as its title has it")
        options = {"scale": scale} if scale != 1.0 else {}
        guess = ColumnGuess(
            name, self.titles.get(name, ""), "time", unit, tuple(why), sure, bool(stated), options
        )
        return guess, usual * guess.factor

    @staticmethod
    def _unit_of_time(stated: str, usual: float) -> tuple[str, float, str]:
        if stated in UNITS["time"]:
            return stated, 1.0, "sure"
        for name, (unit, scale) in _TIME_UNITS.items():
            rate = 1.0 / (usual * CHANNEL_UNITS[unit] * scale)
            if _RATES[0] <= rate <= _RATES[1]:
                return unit, scale, "sure" if name == "s" else "likely"
        return "s", 1.0, "unsure"


def _averaged(values: Values, width: int) -> Values:
    return uniform_filter1d(uniform_filter1d(values, width), width)


def _basis(q: Values, v: Values, a: Values) -> Values:
    """Return what a force may be made of, shape (n, 7): inertia first, the constant last."""
    scales = [float(np.std(part)) or 1.0 for part in (a, v, q)]
    columns = [a / scales[0], v / scales[1], np.sign(v), (q - q.mean()) / scales[2]]
    columns += [np.sin(q), np.cos(q), np.ones_like(q)]
    return np.column_stack(columns)


def _period(columns: Sequence[Values]) -> float | None:
    """Return after how much readings begin anew, None where they do not.

    They jump from one end to the other, and spend no more time at the ends than elsewhere, which a
    force that is switched does.
    """
    lowest = min(
        float(np.nanmin(values[np.isfinite(values)], initial=np.inf)) for values in columns
    )
    highest = max(
        float(np.nanmax(values[np.isfinite(values)], initial=-np.inf)) for values in columns
    )
    span = highest - lowest
    if not (math.isfinite(span) and span > 0.0):
        return None
    periods: list[float] = []
    for values in columns:
        finite = values[np.isfinite(values)]
        steps = np.diff(finite)
        jumps = np.flatnonzero(np.abs(steps) > 0.5 * span)
        if not jumps.size:
            continue
        usual = np.abs(np.delete(steps, jumps))
        at_ends = np.minimum(finite - lowest, highest - finite) < 0.05 * span
        before, after = finite[jumps], finite[jumps + 1]
        reached = np.abs(after - before) > 0.8 * span
        if not usual.size or np.quantile(usual, 0.99) > 0.2 * span or not np.median(usual):
            return None
        if jumps.size > 0.05 * len(finite) or at_ends.mean() > 0.5 or not reached.all():
            return None
        # What it moved in the step of the jump is that of the step before.
        periods += np.abs(steps[jumps] - steps[np.maximum(jumps - 1, 0)]).tolist()
    if not periods:
        return None
    period = float(np.median(periods))
    for _, known in _PERIODS[:2]:
        if abs(period / known - 1.0) < _NEAR:
            return known
    power = 2.0 ** round(math.log2(period)) if period > 1.0 else 0.0
    if period > _COUNTED / 2 and abs(period / power - 1.0) < _NEAR:
        return power
    digits = 2 - math.floor(math.log10(period))
    return round(period, digits)


def find_roles(log: Log) -> Roles:
    """Return what the columns of a log are taken for.

    Parameters
    ----------
    log : Log

    Returns
    -------
    Roles
        Without coordinates where no column can be one.
    """
    return _Finder(log).roles()


@dataclass(frozen=True, eq=False)
class _Finder:
    """The columns of a log, compared with each other."""

    log: Log

    @cached_property
    def speeds(self) -> dict[tuple[Name, Name], tuple[float, float]]:
        """Pairs of a column and another one that is its derivative, with share and ratio."""
        names = self.log.signals
        pairs = {}
        for name in names:
            for other in names:
                hint = self.log.hints[other]
                if name == other:
                    continue
                share, ratio = self.log.derivative(name, other)
                least = (
                    _SURE_DERIVATIVE
                    if hint.quantity not in ("", "speed", "acceleration") and not hint.weak
                    else _DERIVATIVE
                )
                if share >= least and self.log.same(name, other)[0] < share:
                    pairs[name, other] = share, ratio
        return pairs

    @cached_property
    def is_speed(self) -> dict[Name, tuple[Name, float, float]]:
        """Columns that are derivatives: of which, the share and the ratio."""
        speeds: dict[Name, tuple[Name, float, float]] = {}
        for (name, other), (share, ratio) in self.speeds.items():
            backward = self.speeds.get((other, name), (0.0, 0.0))
            # In steady sines each is the derivative of the other: signs and titles tell.
            wrong = ratio < 0.0 < backward[1] or self._said(name, other) < self._said(other, name)
            if backward[0] and wrong:
                continue
            if share > speeds.get(other, (name, 0.0, 0.0))[1]:
                speeds[other] = name, share, ratio
        return speeds

    def _said(self, name: Name, other: Name) -> int:
        """Return how far titles support that one column is the derivative of another."""
        return (self.log.hints[name].quantity == "position") + (
            self.log.hints[other].quantity == "speed"
        )

    @cached_property
    def computed(self) -> set[Name]:
        """Columns that are exact multiples of others."""
        names = self.log.signals
        return {
            name
            for name in names
            for other in names
            if name != other and self.log.same(name, other)[0] > _ALIKE
        }

    def roles(self) -> Roles:
        log = self.log
        positions = self._positions()
        chosen = self._pair(positions)
        if chosen is None:
            return Roles(log.time, None, (), (), 0.0, None, tuple(self._others(())))
        position, force = chosen
        rate = self._rate(position)
        encoders = self._encoders(positions, force)
        if encoders is not None:
            first, second, ratio = encoders
            coordinates: tuple[ColumnGuess, ...] = self._two_encoders(first, second, ratio)
        else:
            ratio = 0.0
            coordinates = (self._coordinate(position, force),)
        forces: tuple[ColumnGuess, ...] = ()
        balance = None
        if force is not None:
            forces = (self._force(force, coordinates[-1]),)
            balance = log.balance(coordinates[-1].column, force, abs(coordinates[-1].factor))
            if rate:
                balance = balance.at_rate(rate)
        if encoders is not None and (pair := self._two_forces(force)):
            forces = tuple(self._force(guess, coordinates[-1]) for guess in pair)
        used = [guess.column for guess in (*coordinates, *forces)]
        remarks = tuple(self._others(used))
        return Roles(log.time, rate, coordinates, forces, ratio, balance, remarks)

    def _positions(self) -> list[Name]:
        """Return columns that may be positions, those that are by titles or data alone."""
        log = self.log
        titled = [
            name
            for name in log.signals
            if log.hints[name].quantity == "position" and name not in self.is_speed
        ]
        strong = [name for name in titled if not log.hints[name].weak]
        moved = [
            name
            for name in log.signals
            if any(of == name for of, _, _ in self.is_speed.values())
            and name not in self.is_speed
            and (log.hints[name].quantity in ("", "position") or log.hints[name].weak)
        ]
        strong = list(dict.fromkeys([*strong, *moved]))
        measured = [name for name in strong if not log.hints[name].command]
        if measured or strong:
            return measured or strong
        if titled:
            return titled
        speeds = [name for name in log.signals if log.hints[name].quantity == "speed"]
        unknown = [name for name in log.signals if not log.hints[name].quantity]
        weak = [name for name in log.signals if log.hints[name].weak]
        return unknown or speeds or weak

    def _force_candidates(self, positions: Sequence[Name]) -> list[Name]:
        log = self.log
        others = [
            name
            for name in log.signals
            if name not in self.is_speed
            and log.hints[name].quantity not in ("speed", "acceleration", "position", "temperature")
        ]
        titled = [name for name in others if log.hints[name].quantity in FORCES]
        strong = [
            name for name in titled if not log.hints[name].weak and not log.hints[name].command
        ]
        if strong or titled:
            return strong or titled
        return others

    def _pair(self, positions: Sequence[Name]) -> tuple[Name, Name | None] | None:
        """Return the position and the force of which motion explains most; None without one."""
        log, most = self.log, -math.inf
        best: tuple[Name, Name | None] | None = None
        forces = self._force_candidates(positions)
        scores: dict[tuple[Name, Name], float] = {}
        widest = max((self._span(name) for name in positions), default=0.0)
        for position in positions:
            if self._span(position) <= 0.0:
                continue
            differentiated = any(of == position for of, _, _ in self.is_speed.values())
            score = _DIFFERENTIATED * differentiated - _WANTED * log.hints[position].command
            if self._alike(positions):
                # In the same unit a joint that hardly moves is not the one that was tested.
                moves = self._span(position) / widest
                score += _MOVES * moves - _STANDS * (moves < STILL)
            if not forces and score > most:
                best, most = (position, None), score
            explained = log.explained(position)
            for force in forces:
                if force == position or log.same(position, force)[0] > _SAME:
                    continue
                share, friction = explained[force]
                fits = log.hints[position].number == log.hints[force].number != ""
                # Another joint's motor feels the motion as well, but not its friction.
                of_force = share + _RUBS * min(1.0, friction) + _NUMBERED * fits
                of_force -= _WANTED * log.hints[force].command
                of_force -= _MULTIPLE * (force in self.computed)
                of_force += _ROUGHER * (log.roughness(position) < log.roughness(force))
                of_force += _IS_FORCE * (log.hints[force].quantity in ("torque", "force"))
                scores[position, force] = score + of_force
                if score + of_force > most:
                    best, most = (position, force), score + of_force
        if best is None:
            return None
        position, chosen = best
        if chosen is None:
            return position, None
        # What was wanted, or what a model says, lacks the noise of what was measured.
        like = [
            force
            for (of, force), score in scores.items()
            if of == position
            and score > most - _CLOSE
            and log.same(chosen, force)[0] > _LIKE
            and bool(log.hints[force].quantity) == bool(log.hints[chosen].quantity)
        ]
        force = max(like, key=log.noise, default=chosen)
        twins = [
            other
            for other in positions
            if log.same(position, other)[0] > _SAME
            and abs(log.same(position, other)[1] - 1) < _NEAR
        ]
        if not log.titles.get(position) or not any(log.hints[name].quantity for name in twins):
            position = max(twins, key=log.noise, default=position)
        return position, force

    def _span(self, name: Name) -> float:
        return max(float(np.ptp(values)) for values in self.log.values(name))

    def _alike(self, names: Sequence[Name]) -> bool:
        """Tell whether all of these have one unit, or none."""
        units = {self.log.hints[name].unit for name in names}
        counted = {self._counted(name) for name in names}
        return len(units) == len(counted) == 1

    def _counted(self, name: Name) -> bool:
        """Tell whether a column holds whole numbers as large as those of an encoder."""
        if self.log.hints[name].unit:
            return self.log.hints[name].unit == COUNTS
        values = np.concatenate(self.log.values(name))
        whole = bool(np.all(np.abs(values - np.round(values)) < 1e-6))
        return whole and self._span(name) > _COUNTED

    def _rate(self, position: Name) -> float | None:
        """Return the sampling rate, Hz, that a speed tells where there is no column of time."""
        if self.log.time is not None:
            return None
        for other, (of, share, ratio) in self.is_speed.items():
            if of == position and share > _DERIVATIVE:
                return abs(ratio) * self._size(other) / self._size(position)
        return None

    def _size(self, name: Name) -> float:
        """Return the factor to SI that the title of a column tells, 1 where it tells none."""
        return CHANNEL_UNITS.get(self.log.hints[name].unit, 1.0)

    def _encoders(
        self, positions: Sequence[Name], force: Name | None
    ) -> tuple[Name, Name, float] | None:
        """Return columns of input and output encoder, and the ratio of their readings."""
        log, best = self.log, None
        measured = [name for name in positions if not log.hints[name].command]
        for input_name in measured:
            for output_name in measured:
                if input_name == output_name:
                    continue
                share, ratio = log.same(output_name, input_name)
                sides = (
                    log.hints[input_name].side == "input",
                    log.hints[output_name].side == "output",
                )
                computed = share > _COMPUTED and not all(sides)
                if (
                    share < _SAME
                    or computed
                    or self._counted(input_name) != self._counted(output_name)
                ):
                    continue
                ratio = (
                    log.ratio(output_name, input_name, force)
                    * self._size(input_name)
                    / self._size(output_name)
                )
                if not (_RATIOS[0] <= abs(ratio) <= _RATIOS[1]) and not all(sides):
                    continue
                known = sum(sides), share
                if best is None or known > best[0]:
                    best = known, (input_name, output_name, ratio)
        return None if best is None else best[1]

    def _two_encoders(
        self, first: Name, second: Name, ratio: float
    ) -> tuple[ColumnGuess, ColumnGuess]:
        log = self.log
        load = self._coordinate(second, None)
        if load.unit == COUNTS:
            # Encoders of one maker have the same counts more often than not.
            motor = self._coordinate(first, None, load)
        else:
            motor = self._coordinate(first, None)
            motor = replace(motor, unit=load.unit if not motor.unit_sure else motor.unit)
        whole = round(ratio) if abs(ratio - round(ratio)) < 2e-3 * abs(ratio) else ratio
        said = (
            f"its readings are {ratio:.6g} times those of {log.label(second)}, whose drive they "
            "share"
        )
        motor = replace(
            motor,
            options={**motor.options, "divided_by": float(whole)},
            why=(*motor.why, said),
        )
        why = (*load.why, f"{log.label(first)} follows it with a ratio of {ratio:.6g}")
        return motor, replace(load, why=why)

    def _two_forces(self, force: Name | None) -> tuple[Name, Name] | None:
        """Return torques of input and output, where titles tell both."""
        by_side: dict[str, Name] = {}
        for name in self.log.signals:
            hint = self.log.hints[name]
            if hint.quantity in FORCES and not hint.command and hint.side:
                by_side.setdefault(hint.side, name)
        if set(by_side) == {"input", "output"}:
            return by_side["input"], by_side["output"]
        return None

    def _coordinate(
        self, name: Name, force: Name | None, like: ColumnGuess | None = None
    ) -> ColumnGuess:
        log, hint = self.log, self.log.hints[name]
        why: list[str] = []
        sure = "unsure"
        speed = [
            (other, relation) for other, relation in self.is_speed.items() if relation[0] == name
        ]
        if hint.quantity == "position":
            why.append("its title says so")
            sure = "likely" if hint.weak else "sure"
        if speed:
            other, (_, share, ratio) = max(speed, key=lambda relation: relation[1][1])
            why.append(
                f"its derivative is {log.label(other)} ({100.0 * share:.2f} % of its variance"
                f"{self._slope_said(name, other, ratio)})"
            )
            sure = "sure"
        if force is not None and len(log.signals) > 1:
            share = log.balance(name, force).share
            why.append(
                f"mass, friction, gravity and spring along it explain {100.0 * share:.0f} % of "
                f"the variance of {log.label(force)}"
            )
            sure = "likely" if sure == "unsure" and share > 0.5 else sure
        if hint.quantity == "speed":
            why.append("no position is there, so that this speed will be integrated")
        unit, unit_sure, options, said = self._unit_of_position(name, force, like)
        return ColumnGuess(
            name,
            log.titles.get(name, ""),
            "speed" if hint.quantity == "speed" else "position",
            unit,
            (*why, *said),
            sure,
            unit_sure,
            options,
        )

    def _slope_said(self, position: Name, speed: Name, ratio: float) -> str:
        if self.log.time is None or self._counted(position):
            return ""
        ratio *= self._size(speed) / self._size(position)
        for said, known in (
            ("", 1.0),
            (", in deg/s of rad", 57.29578),
            (", in rpm of rad", 9.549297),
        ):
            if abs(ratio / known - 1.0) < _NEAR:
                return said
        return f", {ratio:.4g} times"

    def _unit_of_position(
        self, name: Name, force: Name | None, like: ColumnGuess | None
    ) -> tuple[str, bool, dict[str, float | bool], tuple[str, ...]]:
        log, hint = self.log, self.log.hints[name]
        options: dict[str, float | bool] = {}
        period = log.periods.get(name)
        if hint.quantity == "speed":
            return hint.unit or "rad/s", bool(hint.unit), options, ()
        if self._counted(name):
            return self._counts(name, like)
        by_period = {known: unit for unit, known in _PERIODS}
        said: tuple[str, ...] = ()
        unit, unit_sure = hint.unit, bool(hint.unit)
        if period is not None:
            if unit in ("", by_period.get(period)) and by_period.get(period):
                unit, unit_sure = by_period[period], True
                options["unwrap"] = True
                said = (f"it begins anew after {period:.6g}, a turn in {unit}",)
            else:
                options["wraps"] = period
                said = (f"it begins anew after some {period:.6g}",)
        if unit:
            return unit, unit_sure, options, said
        if hint.quantity in ("voltage", "current"):
            # A circuit that acts like a machine.
            return {"voltage": "V", "current": "A"}[hint.quantity], False, options, said
        words = log.titles.get(name, "").lower()
        of_length = force is not None and log.hints[force].quantity == "force"
        if of_length or words in ("x", "y", "s") or "weg" in words or "displacement" in words:
            return "m", False, options, said
        span = self._span(name)
        if period is None and 30.0 < span < 800.0 and hint.side != "input":
            return (
                "deg",
                False,
                options,
                (*said, f"it spans {span:.3g}, too far for a joint in rad"),
            )
        return "rad", False, options, said

    def _counts(
        self, name: Name, like: ColumnGuess | None
    ) -> tuple[str, bool, dict[str, float | bool], tuple[str, ...]]:
        log = self.log
        for other in log.signals:
            hint = log.hints[other]
            if other == name or self._counted(other) or hint.quantity != "position":
                continue
            share, ratio = log.same(other, name)
            if share > _SAME and hint.unit in ("", *UNITS["angle"]):
                turn = abs(ratio) * 2.0 * math.pi / CHANNEL_UNITS.get(hint.unit, 1.0)
                power = 2.0 ** round(math.log2(turn))
                is_power = abs(turn / power - 1.0) < _NEAR
                if is_power:
                    said = f"{log.label(other)}, an angle, shows {turn:.6g} counts a turn"
                    return COUNTS, True, {"counts_per_turn": power}, (said,)
        if like is not None and "counts_per_turn" in like.options:
            count = float(like.options["counts_per_turn"])
            return COUNTS, False, {"counts_per_turn": count}, ("as many counts as the other",)
        largest = max(float(np.max(np.abs(values))) for values in log.values(name))
        power = 2.0 ** math.ceil(math.log2(largest))
        said = "whole numbers; the counts per turn are the next power of two, a guess"
        return COUNTS, False, {"counts_per_turn": power}, (said,)

    def _force(self, name: Name, coordinate: ColumnGuess) -> ColumnGuess:
        log, hint = self.log, self.log.hints[name]
        why: list[str] = []
        quantity = hint.quantity if hint.quantity in FORCES else ""
        balance = log.balance(coordinate.column, name, abs(coordinate.factor))
        sure = "unsure"
        if quantity:
            why.append("its title says so")
            sure = "likely" if hint.weak else "sure"
        if balance.share > 0.5:
            sure = "sure" if sure == "sure" else "likely"
        elif sure == "sure":
            sure = "likely"
        why.append(f"motion explains {100.0 * balance.share:.0f} % of its variance")
        if name in self.computed:
            why.append("it is an exact multiple of another column, so perhaps no measurement")
        turning = coordinate.unit == COUNTS or coordinate.unit in (*UNITS["angle"], *UNITS["speed"])
        quantity = quantity or ("torque" if turning else "force")
        usual = {"torque": "N.m", "force": "N", "current": "A", "voltage": "V"}[quantity]
        options: dict[str, float | bool] = {}
        if balance.share > 0.5 and balance.inertia < 0.0 and balance.damping < 0.0:
            options["scale"] = -1.0
            why.append("mass and damping would be negative, so that it counts the other way")
        return ColumnGuess(
            name,
            log.titles.get(name, ""),
            quantity,
            hint.unit or usual,
            tuple(why),
            sure,
            bool(hint.unit),
            options,
        )

    def _others(self, used: Sequence[Name]) -> list[str]:
        """Return a sentence on each column that is not used, as far as something is known of it."""
        log = self.log
        said: list[str] = []
        for name in log.signals:
            hint = log.hints[name]
            if name in self.is_speed:
                of, share, ratio = self.is_speed[name]
                text = (
                    f"{log.label(name)}: derivative of {log.label(of)} ({100.0 * share:.2f} % of "
                    f"its variance{self._slope_said(of, name, ratio)})"
                )
                if hint.quantity not in ("", "speed", "acceleration"):
                    text += f", although its title says {hint.quantity}"
                said.append(text)
                continue
            if name in used:
                continue
            twin = next((column for column in used if log.same(column, name)[0] > _SAME), None)
            if twin is not None:
                share, ratio = log.same(twin, name)
                kind = " (a set value?)" if hint.command else ""
                said.append(f"{log.label(name)}: {ratio:.6g} times {log.label(twin)}{kind}")
            else:
                what = ("wanted " if hint.command else "") + (hint.quantity or "unknown")
                said.append(f"{log.label(name)}: {what}, not used")
        return said
