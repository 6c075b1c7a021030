"""Which rows of a record without a role are fitted, and which are held out.

By default the first rows are fitted and the others held out. Where a log has one push, one
direction or slow speeds in its first rows, they do not determine what the others need, and no
proof follows. Then blocks of time are taken, of which both parts hold what moves.

The criterion is the mean square error of linear least squares in rows that were not fitted. With
rows x of inverse dynamics (acceleration, speed, its sign, one, and the position where a spring or
gravity may act), n independent values of their force, and the second moments S of the fitted rows
and T of the others, it is 1 + trace(T S^-1) / n times the noise (Montgomery, Peck and Vining,
Introduction to Linear Regression Analysis, section 3.4). The forces themselves are not looked at.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.mechanism import Mechanism, Record
from pymoo_hdte.mechanism.motion import (
    highest_frequency,
    margin_of,
    motion_of,
    smoothed_noise,
)
from pymoo_hdte.mechanism.port_motion import motion_at_port
from pymoo_hdte.mechanism.records import ROLES
from pymoo_hdte.mechanism.rests import STILL
from pymoo_hdte.mechanism.working_rate import FEWEST_BINS, working_rows

Values = NDArray[np.float64]

SPLIT = 0.6
"""Share of a record without a role that is fitted; the rest is held out."""
_MOST_PERIODS = 8
"""Largest number of held-out blocks, but for one that is cut by the ends of the record."""
_PHASES = 20
"""Places at which the first held-out block may begin, in a period of the blocks."""
_ENOUGH = 2.0
"""Ratio of mean square errors up to which a split adds less than what no split avoids."""
_FADING = 0.2
"""Speed at which a friction has faded, in units of the highest: the largest that is tried first."""
_STANDS_OUT = 4.0
"""Least power of a combination of columns over that of its noise, as of a position."""
_ROUNDING = 1e-10


class Block(NamedTuple):
    """Rows of a record from a share of it to another.

    Attributes
    ----------
    role : {"train", "held_out"}
    start, stop : float
        Shares of the rows.
    """

    role: str
    start: float
    stop: float


DEFAULT: tuple[Block, ...] = (Block("train", 0.0, SPLIT), Block("held_out", SPLIT, 1.0))


@dataclass(frozen=True, eq=False)
class Split:
    """The blocks of a record, in the order of time.

    Attributes
    ----------
    blocks : tuple of Block
    beside : float
        Rows beside a block on which smoothing may lean, as a share of the record.
    by_default, chosen : float
        Root mean square error that is expected where a part is predicted from the other, in units
        of the noise: of the default, and of the blocks. The worse of both ways.
    """

    blocks: tuple[Block, ...] = DEFAULT
    beside: float = 0.0
    by_default: float = 1.0
    chosen: float = 1.0


def split_of(mechanism: Mechanism, pieces: Sequence[Record], cutoff: float | None = None) -> Split:
    """Return the blocks of a record: the default, unless others are clearly expected to prove more.

    Of the splits that add to the least error that can be expected no more than this error, the one
    with the fewest blocks is taken, the default first.

    Parameters
    ----------
    mechanism : Mechanism
    pieces : sequence of Record
        The whole record; several where it has gaps.
    cutoff : float, optional
        Hz, up to which the motion is known; by default where it falls below its noise.
    """
    try:
        highest = cutoff or min(_band(mechanism, piece) for piece in pieces)
        moments = _Moments(mechanism, pieces, highest)
    except InvalidInput:
        # What is wrong is told where the record is analysed.
        return Split()
    default = moments.error(DEFAULT)
    best: list[tuple[float, tuple[Block, ...]]] = [(default, DEFAULT)]
    for splits in _splits():
        possible = ((moments.error(split), split) for split in splits if moments.room(split))
        error, split = min(possible, default=(math.inf, DEFAULT))
        if _long_enough(mechanism, pieces, split, moments.beside, cutoff):
            best.append((error, split))
    most = _ENOUGH * min(error for error, _ in best)
    error, blocks = next((error, split) for error, split in best if error <= most)
    beside = 0.0 if blocks == DEFAULT else moments.beside
    return Split(blocks, beside, default**0.5, error**0.5)


def _band(mechanism: Mechanism, record: Record) -> float:
    return min(
        highest_frequency(record.channel(name), record.step, record.noise_of(name))
        for name in mechanism.coordinates
    )


def _splits() -> Iterator[list[tuple[Block, ...]]]:
    """Yield the splits with one period of blocks, with two, and so on."""
    for periods in range(1, _MOST_PERIODS + 1):
        yield [_blocks(periods, phase / _PHASES) for phase in range(_PHASES)]


def _blocks(periods: int, phase: float) -> tuple[Block, ...]:
    """Return blocks of which the held-out ones begin at a phase of equal periods."""
    edges = {0.0, 1.0}
    for period in range(-1, periods + 1):
        for place in (phase, phase + 1.0 - SPLIT):
            edges.add(round(min(max((period + place) / periods, 0.0), 1.0), 9))
    blocks: list[Block] = []
    for start, stop in pairwise(sorted(edges)):
        inside = (0.5 * (start + stop) * periods - phase) % 1.0
        role = "held_out" if inside < 1.0 - SPLIT else "train"
        if blocks and blocks[-1].role == role:
            start = blocks.pop().start
        blocks.append(Block(role, start, stop))
    return tuple(blocks)


def _long_enough(
    mechanism: Mechanism,
    pieces: Sequence[Record],
    blocks: Sequence[Block],
    beside: float,
    cutoff: float | None,
) -> bool:
    """Tell whether each block can be analysed up to the cutoff that the fitted ones will have."""
    if len(pieces) > 1:
        return True
    (record,) = pieces
    rows = len(record.time)
    cut = []
    for role, start, stop in blocks:
        first, last = _with_beside(start, stop, beside)
        inside = slice(round(first * rows), round(last * rows))
        channels = {name: channel[inside] for name, channel in record.channels.items()}
        context = round((start - first) * rows), round((last - stop) * rows)
        time = record.time[inside]
        try:
            cut.append(Record(record.name, role, time, channels, record.noise, context=context))
        except InvalidInput:
            return False
    try:
        highest = cutoff or min(_band(mechanism, one) for one in cut if one.role == "train")
        for one in cut:
            working_rows(mechanism, one, highest)
    except InvalidInput:
        return False
    return True


def _with_beside(start: float, stop: float, beside: float) -> tuple[float, float]:
    """Return the shares of a record from which a block is read, with the rows beside it."""
    return max(start - beside, 0.0), min(stop + beside, 1.0)


class _Moments:
    """Sums of squares of the columns of each force balance, up to each row where a block may end.

    Parameters
    ----------
    mechanism : Mechanism
    pieces : sequence of Record
    cutoff : float
        Hz.
    """

    def __init__(self, mechanism: Mechanism, pieces: Sequence[Record], cutoff: float) -> None:
        self._rows = sum(len(piece.time) for piece in pieces)
        self.beside = max(margin_of(cutoff, piece.step) for piece in pieces) / self._rows
        every = [DEFAULT, *(split for splits in _splits() for split in splits)]
        ends = {0, *(self._row(block.stop) for split in every for block in split)}
        self._ends = np.array(sorted(ends))
        values = np.concatenate([2.0 * cutoff * one.step * _known(one, cutoff) for one in pieces])
        motion = _Motion(mechanism, pieces, cutoff)
        counts = (values > 0.0) & motion.moves
        self._room = self._up_to_ends(values)
        self._values = self._up_to_ends(values * counts)
        self._sums = []
        for name in mechanism.coordinates:
            columns, noise = motion.columns(name, counts)
            self._sums.append(self._squares(columns * counts[:, None], noise**2))

    def _row(self, share: float) -> int:
        return round(share * self._rows)

    def _up_to_ends(self, values: Values) -> Values:
        """Return the sums of values (rows,) up to each end of a block, (ends,)."""
        return np.r_[0.0, np.cumsum(np.add.reduceat(values, self._ends[:-1]))]

    def _squares(self, rows: Values, noise: Values) -> Values:
        """Return sums of squares, (ends, k, k), of the k combinations that stand out, whitened.

        Combinations that the sensor makes, as of two columns that are alike, do not move.
        """
        count = max(int(np.count_nonzero(np.any(rows != 0.0, axis=1))), 1)
        scale = np.linalg.norm(rows, axis=0) / count**0.5
        moves = scale > 0.0
        rows, noise = rows[:, moves] / scale[moves], noise[moves] / scale[moves] ** 2
        power, axes = np.linalg.eigh(rows.T @ rows / count)
        axes = axes[:, power > _ROUNDING] / power[power > _ROUNDING] ** 0.5
        shares, turned = np.linalg.eigh(axes.T @ (noise[:, None] * axes))
        seen = rows @ (axes @ turned[:, shares < 1.0 / _STANDS_OUT])
        k = seen.shape[1]
        squares = np.empty((len(self._ends), k, k))
        for i in range(k):
            for j in range(k):
                squares[:, i, j] = self._up_to_ends(seen[:, i] * seen[:, j])
        return squares

    def room(self, blocks: Sequence[Block]) -> bool:
        """Tell whether each block has as many independent values as a force balance needs."""
        ends = np.searchsorted(self._ends, [0, *(self._row(block.stop) for block in blocks)])
        return bool(np.all(np.diff(self._room[ends]) >= FEWEST_BINS))

    def error(self, blocks: Sequence[Block]) -> float:
        """Return the mean square error expected between the parts, in units of the noise."""
        places = {
            role: [
                tuple(np.searchsorted(self._ends, (self._row(block.start), self._row(block.stop))))
                for block in blocks
                if block.role == role
            ]
            for role in ROLES
        }

        def total(sums: Values, role: str) -> Any:
            return sum(sums[last] - sums[first] for first, last in places[role])

        worst = 1.0
        for sums in self._sums:
            for known, asked in (ROLES, ROLES[::-1]):
                values = float(total(self._values, asked))
                learned = total(sums, known)
                if not len(learned):
                    continue
                if values <= 0.0 or np.linalg.matrix_rank(learned, hermitian=True) < len(learned):
                    return math.inf
                # Of as many rows as there are independent values in each part.
                added = np.trace(np.linalg.solve(learned, total(sums, asked)))
                worst = max(worst, 1.0 + float(added) / values)
        return worst


def _known(record: Record, cutoff: float) -> NDArray[np.bool_]:
    """Return which rows, (n,), smoothing leaves: not those at the ends."""
    known = np.zeros(len(record.time), bool)
    margin = margin_of(cutoff, record.step)
    known[margin : len(known) - margin] = True
    return known


class _Motion:
    """The motion of all pieces of a record, one after the other.

    Parameters
    ----------
    mechanism : Mechanism
    pieces : sequence of Record
    cutoff : float
        Hz.
    """

    def __init__(self, mechanism: Mechanism, pieces: Sequence[Record], cutoff: float) -> None:
        self._mechanism, self._pieces, self._cutoff = mechanism, pieces, cutoff
        motions = {
            name: [motion_of(piece.channel(name), piece.step, cutoff) for piece in pieces]
            for name in mechanism.coordinates
        }
        self._position, self._speed, self._acceleration = (
            {
                name: np.concatenate([getattr(motion, which) for motion in of_pieces])
                for name, of_pieces in motions.items()
            }
            for which in ("position", "speed", "acceleration")
        )

    @property
    def moves(self) -> NDArray[np.bool_]:
        """In which rows, (n,), not all coordinates stand still."""
        moving = [
            np.abs(speed) >= STILL * self._noise({name: 1.0})[1]
            for name, speed in self._speed.items()
        ]
        return np.asarray(np.logical_or.reduce(moving))

    def columns(self, coordinate: str, counts: NDArray[np.bool_]) -> tuple[Values, Values]:
        """Return the columns of a force balance, (n, p), and their noise, (p,).

        The friction of a port is constant, fades with the speed, or grows with it or its square.
        """
        columns, noise = [self._acceleration[coordinate]], [self._noise({coordinate: 1.0})[2]]
        for port in self._mechanism.ports:
            if port.read or not port.motion.get(coordinate):
                continue
            motion = motion_at_port(port, self._position, self._speed)
            of_position, of_speed, _ = self._noise(port.motion)
            fastest = float(np.max(np.abs(motion.speed[counts]), initial=0.0))
            if fastest <= STILL * of_speed:
                continue
            share = motion.speed / fastest
            sign = np.sign(share) * (np.abs(motion.speed) > STILL * of_speed)
            fading = sign * np.exp(-((share / _FADING) ** 2))
            columns += [np.ones_like(share), sign, fading, share, share * np.abs(share)]
            noise += [0.0, 0.0, *(of_speed / fastest * np.array([1.0 / _FADING, 1.0, 1.0]))]
            if port.stiffness.value:
                columns.append(motion.position)
                noise.append(of_position)
            if self._mechanism.turns(port):
                columns += [np.sin(motion.position), np.cos(motion.position)]
                noise += [of_position, of_position]
        return np.column_stack(columns), np.array(noise)

    def _noise(self, shares: Mapping[str, float]) -> tuple[float, float, float]:
        """Return the standard deviations of smoothed position, speed and acceleration of a sum."""
        deviation, step = max(
            (
                math.hypot(*(share * piece.noise_of(name) for name, share in shares.items())),
                piece.step,
            )
            for piece in self._pieces
        )
        position, speed = smoothed_noise(deviation, step, self._cutoff)
        # White noise up to a corner: the mean squares of its derivatives are 1/3 and 1/5 of its
        # power times the second and the fourth power of the corner.
        acceleration = (9.0 / 5.0) ** 0.5 * speed**2 / position if position else 0.0
        return position, speed, acceleration
