"""The marginal likelihood of a hypothesis: how probable the data are if it is true.

A hypothesis is linearised at its fit. Its whitened residuals, predicted minus measured, are

    r + J d + C a + e.

- d, free unknowns: flat within their tolerance with Gaussian shoulders outside, or Gaussian with
  what is stated of them.
- C a, quantities of unknown size: a is normal with a common scale, which is log-uniform. Strengths
  of effects, relative errors of laws and what no library holds are all of this kind.
- e, noise: normal, with an unknown factor for each channel.

Given scales and factors, everything is Gaussian except for bounds, which are integrated by
expectation propagation (Minka, UAI 2001; of Gaussians within bounds Cunningham, Hennig and
Lacoste-Julien, arXiv 1111.6832). Each scale is then integrated by quadrature along its own axis
through the mode of all of them, and each factor by Laplace's method. Nothing here knows a machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import chi2, ncx2, norm

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

# Settings of the integration: finer ones change no logarithm of odds by 0.1.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)
_REACH = 40.0
"""Logarithm of the density, below its largest, beyond which a tail is left out."""
_GRID = 96
"""Points of a scale's quadrature, even in its logarithm."""
_SWEEPS, _ROUNDS = 40, 12
"""Most rounds over the bounds, and over scales and factors."""
_SETTLED = 1e-3
"""Change of a logarithm that ends them."""


@dataclass(frozen=True, eq=False)
class Free:
    """Unknowns whose prior is stated: bounds with shoulders, or a mean with a deviation.

    Attributes
    ----------
    columns : ndarray, shape (n, k)
        Change of the residuals per unit of each.
    lower, upper : ndarray, shape (k,)
        Bounds, counted from the values at which the hypothesis is linearised; infinite for none.
    shoulder : ndarray, shape (k,)
        Standard deviation of what lies outside of the bounds; above 0.
    mean, deviation : ndarray, shape (k,)
        Of a Gaussian prior, counted from the same values; an infinite deviation for none. An
        unknown has bounds or this.
    """

    columns: Matrix
    lower: Vector
    upper: Vector
    shoulder: Vector
    mean: Vector
    deviation: Vector


@dataclass(frozen=True, eq=False)
class Sized:
    """Coefficients that are normal around 0 with a common scale, of which the logarithm is flat.

    Attributes
    ----------
    name : str
    columns : ndarray, shape (n, m)
        Change of the residuals per unit of each.
    least, most : float
        Range of the scale; equal for a known one.
    at : ndarray, shape (m,)
        Values at which the hypothesis is linearised.
    positive : ndarray of bool, shape (m,)
        Coefficients that cannot be negative.
    cut : bool
        Whether the coefficients themselves, and not only their scale, are at least as large as
        stated, and large enough to be visible: see `VISIBLE`. What is smaller is nothing, and
        belongs to the hypothesis without it. For one coefficient, or two of about the same
        curvature.
    of_effect : bool
        Whether it is a size of an effect, beyond which those that are ``cut`` have to be visible.
    of_form : bool
        Whether it is by how much the form of a law errs: beyond ``most`` it is another law.
    of_records : bool
        Whether it is an error of the records, which may stand for an effect that is missing.
    """

    name: str
    columns: Matrix
    least: float
    most: float
    at: Vector
    positive: NDArray[np.bool_]
    cut: bool = False
    of_effect: bool = False
    of_form: bool = False
    of_records: bool = False


OTHER_LAW = 10.0
"""Largest error of another law in the place of one, as a multiple of what its form may err by: it
is then three times the law."""
VISIBLE = 16.0
"""Chi-square beyond all other unknowns from which on something counts as visible: four standard
deviations of one unknown. Of twenty effects, together as likely as that nothing is missing, noise
alone then makes none as likely as 1 in 20 in 95 % of campaigns; with two standard deviations it
would in half of them. What is smaller is nothing, as far as the data can tell."""


class Member(NamedTuple):
    """Places of what belongs to an effect among the free unknowns and the quantities of a size."""

    free: slice
    sized: slice


@dataclass(frozen=True, eq=False)
class Linearised:
    """A hypothesis linearised at its fit.

    Attributes
    ----------
    residuals : ndarray, shape (n,)
        Predicted minus measured, in standard deviations of the noise, at the fit.
    channels : ndarray of int, shape (n,)
        Channel of each residual; those of one channel share a factor of their noise.
    free : Free
    sized : tuple of Sized
    noise : float
        Standard deviation of the logarithm of a factor: ln 2 where the noise is stated. With 0
        factors are 1.
    shares : ndarray, shape (n,), optional
        Independent values that each residual counts for, at most 1: less where they are correlated.
    members : tuple of Member
        What belongs to each effect of the hypothesis.
    """

    residuals: Vector
    channels: NDArray[np.int_]
    free: Free
    sized: tuple[Sized, ...] = ()
    noise: float = float(np.log(2.0))
    shares: Vector | None = None
    members: tuple[Member, ...] = ()

    def without(self, number: int) -> Linearised:
        """Return it without one of its effects, to first order."""
        member, free, residuals = self.members[number], self.free, self.residuals
        for part in self.sized[member.sized]:
            residuals = residuals - part.columns @ part.at
        values = {
            name: np.delete(getattr(free, name), member.free, axis=-1)
            for name in ("columns", "lower", "upper", "shoulder", "mean", "deviation")
        }
        sized = (*self.sized[: member.sized.start], *self.sized[member.sized.stop :])
        return replace(self, residuals=residuals, free=Free(**values), sized=sized, members=())

    @property
    def other_laws(self) -> tuple[Sized, ...]:
        """Errors of the laws beyond those that their forms may have."""
        return tuple(
            replace(part, least=part.most, most=OTHER_LAW * part.most)
            for part in self.sized
            if part.of_form
        )

    def beside(self, *sized: Sized) -> Linearised:
        """Return it with further quantities of unknown size."""
        return replace(self, sized=(*self.sized, *sized))


@dataclass(frozen=True, eq=False)
class Score:
    """The marginal likelihood of a hypothesis, and where its mode is.

    Attributes
    ----------
    ln : float
        Natural logarithm of the marginal likelihood of the whitened residuals.
    scales : dict of str to float
        Most probable scale of each quantity of unknown size.
    invisible : tuple of str
        Quantities that would be invisible at their largest scale.
    factors : ndarray, shape (n_channels,)
        Most probable factor of the noise of each channel.
    residuals : ndarray, shape (n,)
        What is left at the mode, in standard deviations of the noise with these factors.
    freedom : ndarray, shape (n,)
        Share of each residual that no unknown follows, 0 to 1.
    noise : float
        As of `Linearised`.
    """

    ln: float
    scales: dict[str, float]
    invisible: tuple[str, ...]
    factors: Vector
    residuals: Vector
    freedom: Vector
    noise: float

    def worst_chance(self, groups: Sequence[NDArray[np.int_]]) -> float:
        """Return the least chance of as large a chi-square as a group of residuals has.

        Parameters
        ----------
        groups : sequence of ndarray of int
            Rows of each record and channel. The factor of a channel's noise counts as well.
        """
        chances = [
            float(chi2.sf(np.sum(self.residuals[rows] ** 2), np.sum(self.freedom[rows])))
            for rows in groups
            if np.sum(self.freedom[rows]) >= 1.0
        ]
        if self.noise > 0.0:
            chances += (2.0 * norm.sf(np.log(self.factors) / self.noise)).tolist()
        return min(chances, default=1.0)


def groups_of(*labels: NDArray[np.int_]) -> list[NDArray[np.int_]]:
    """Return the rows of each record, of each channel, or of what else labels (n,) tell apart."""
    return [np.flatnonzero(each == label) for each in labels for label in np.unique(each)]


def score(hypothesis: Linearised) -> Score:
    """Return the marginal likelihood of a hypothesis."""
    return Integral(hypothesis).score()


MOST_PLACES = 12
"""Most places at which something outside of the library is looked for. What needs more leaves more
than noise, which the check of the likeliest explanation sees."""
FURTHER = 3.0
"""Factor by which a place may bring more than to first order, as less of the rest is noise then:
width of the search."""


def score_with_outside(
    hypothesis: Linearised,
    places: Sequence[Sized],
    hopeless: float = -np.inf,
    most: int = MOST_PLACES,
) -> tuple[Score, list[str]]:
    """Return the marginal likelihood beside something outside of the library, and where that is.

    It may be at any of the places. A further one is taken as long as that raises the probability;
    each counts as one of all places.

    Parameters
    ----------
    hypothesis : Linearised
    places : sequence of Sized
        What could be at each place.
    hopeless : float
        Logarithm of a likelihood below which nobody asks for it: the search ends where all further
        places together would not reach that if each brought `FURTHER` times as much as the best.
    most : int
        Most places that are taken.

    Returns
    -------
    Score
        With the prior of the places in its logarithm; of the first at least, as the hypothesis is
        that something is outside.
    list of str
        Names of the places.
    """
    price = float(np.log(max(len(places), 1)))
    integral = Integral(hypothesis)
    best, taken, remaining = integral.score(), list[Sized](), list(places)
    while remaining and len(taken) < most:
        gains = integral.gains(remaining)
        if (largest := float(np.max(gains))) <= price:
            if not taken:
                # Nothing there stands out: the mean over all places, none of which is needed.
                mean = largest + float(np.log(np.sum(np.exp(gains - largest)))) - price
                return replace(best, ln=best.ln + mean), []
            break
        if taken and best.ln + FURTHER * (most - len(taken)) * largest < hopeless:
            break
        place = remaining.pop(int(np.argmax(gains)))
        integral = Integral(hypothesis.beside(*taken, place))
        trial = integral.score()
        trial = replace(trial, ln=trial.ln - (len(taken) + 1) * price)
        if taken and trial.ln <= best.ln:
            break
        best, taken = trial, [*taken, place]
    return best, [place.name for place in taken]


@dataclass(eq=False)
class Integral:
    """The integral over all unknowns of a hypothesis, with the state of its approximation."""

    hypothesis: Linearised
    least: list[float] = field(init=False)

    def __post_init__(self) -> None:
        hypothesis = self.hypothesis
        free, sized = hypothesis.free, hypothesis.sized
        residuals = hypothesis.residuals - sum(
            (part.columns @ part.at for part in sized), np.zeros(len(hypothesis.residuals))
        )
        columns = np.column_stack([free.columns, *(part.columns for part in sized)])
        # Columns of one size, so that no factorisation loses digits.
        self.units = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        self.units[self.units == 1e-300] = 1.0
        self.columns, self.shift = columns / self.units, residuals
        self.n_free = free.columns.shape[1]
        ends = np.cumsum([self.n_free, *(part.columns.shape[1] for part in sized)])
        self.places = [slice(*pair) for pair in pairwise(ends)]
        n_channels = int(hypothesis.channels.max(initial=-1)) + 1
        self.rows = [np.flatnonzero(hypothesis.channels == k) for k in range(n_channels)]
        whole = np.column_stack([self.columns, residuals])
        shares = np.ones(len(residuals)) if hypothesis.shares is None else hypothesis.shares
        self.weights = np.sqrt(shares)
        whole *= self.weights[:, None]
        self.grams = np.array([(part := whole[rows]).T @ part for rows in self.rows])
        self.counts = np.array([np.sum(shares[rows]) for rows in self.rows])
        self.factors = np.ones(n_channels)
        self._set_priors()
        self.least = [self._least(number) for number in range(len(sized))]
        self.log_scales = [
            np.linspace(np.log(least), np.log(max(part.most, least)), _GRID)
            if part.most > least
            else np.array([np.log(part.most)])
            for least, part in zip(self.least, sized, strict=True)
        ]
        self.scales = np.array([np.exp(grid[len(grid) // 2]) for grid in self.log_scales])
        self.corrections = np.zeros(len(sized))

    def _set_priors(self) -> None:
        """Set Gaussian priors, and where the approximations of bounds start."""
        free, k = self.hypothesis.free, self.columns.shape[1]
        units = self.units[: self.n_free]
        self.precision, self.linear = np.zeros(k), np.zeros(k)
        stated = np.isfinite(free.deviation)
        self.precision[: self.n_free][stated] = 1.0 / (free.deviation * units)[stated] ** 2
        self.linear[: self.n_free][stated] = (free.mean / free.deviation**2 / units)[stated]
        constant = 0.5 * np.log(self.precision[: self.n_free][stated] / (2.0 * np.pi))
        constant -= 0.5 * ((free.mean / free.deviation)[stated]) ** 2
        self.constant = float(np.sum(constant))
        bounded = np.isfinite(free.lower) & np.isfinite(free.upper) & ~stated
        self.boxed = np.flatnonzero(bounded)
        signs = [
            place.start + np.flatnonzero(part.positive)
            for place, part in zip(self.places, self.hypothesis.sized, strict=True)
        ]
        self.signed = np.concatenate([np.empty(0, dtype=int), *signs]).astype(int)
        # A size is no larger than its fit may be.
        largest = [
            np.full(len(places), part.most if part.of_effect else np.inf)
            for places, part in zip(signs, self.hypothesis.sized, strict=True)
        ]
        self.largest = np.concatenate([np.empty(0), *largest]) * self.units[self.signed]
        lower, upper, width = (
            (array * units)[self.boxed] for array in (free.lower, free.upper, free.shoulder)
        )
        self.bounds = lower, upper, width
        self.sites = np.concatenate([self.boxed, self.signed])
        middle, size = (lower + upper) / 2.0, upper - lower + 2.0 * width
        self.site_precision = np.concatenate([12.0 / size**2, np.zeros(len(self.signed))])
        self.site_linear = np.concatenate([12.0 * middle / size**2, np.zeros(len(self.signed))])
        self.site_constant = np.zeros(len(self.sites))

    def _least(self, number: int) -> float:
        """Return the least scale of a quantity: as stated, and visible if it is ``cut``.

        Visible is a chi-square of `VISIBLE` beyond all free unknowns, and beyond all other
        quantities that are cut or sizes of effects, up to their largest scale: friction that falls
        with speed is none as long as a level can do what its fall does.
        """
        sized = self.hypothesis.sized
        if not sized[number].cut:
            return sized[number].least
        precision = self.precision.copy()
        precision[self.boxed] += self.site_precision[: len(self.boxed)]
        # Shapes of an effect that is not there do nothing.
        own = [m.free for m in self.hypothesis.members if m.sized.start <= number < m.sized.stop]
        others = [np.delete(np.arange(self.n_free), np.r_[tuple(own)] if own else [])]
        for other, (place, part) in enumerate(zip(self.places, sized, strict=True)):
            if other != number and (part.cut or part.of_effect):
                precision[place] = 1.0 / (part.most * self.units[place]) ** 2
                others.append(np.arange(place.start, place.stop))
        gram, place = self.grams.sum(axis=0), self.places[number]
        rows = np.concatenate(others)
        curvature, units = gram[place, place], self.units[place]
        if len(rows):
            across = gram[rows, place]
            inner = gram[np.ix_(rows, rows)] + np.diag(precision[rows])
            curvature = curvature - across.T @ _inverse(inner) @ across
        largest = float(np.linalg.eigvalsh(curvature * np.outer(units, units)).max())
        visible = np.sqrt(VISIBLE / largest) if largest > 0.0 else np.inf
        return max(sized[number].least, visible)

    def score(self) -> Score:
        """Return the marginal likelihood."""
        sized = self.hypothesis.sized
        invisible = tuple(
            part.name
            for part, least in zip(sized, self.least, strict=True)
            if part.cut and least >= part.most
        )
        before = -np.inf
        for _ in range(_ROUNDS):
            self._integrate_bounds()
            self._set_scales()
            of_factors = self._set_factors()
            ln = self._ln() + float(self.corrections.sum()) + of_factors
            if abs(ln - before) < _SETTLED:
                break
            before = ln
        self._integrate_bounds()
        ln = self._ln() + float(self.corrections.sum()) + of_factors
        _, covariance, _, scaled, left = self._at_mode()
        followed = np.sum(scaled @ covariance * scaled, axis=1)
        return Score(
            ln,
            {part.name: float(scale) for part, scale in zip(sized, self.scales, strict=True)},
            invisible,
            self.factors.copy(),
            left,
            np.clip(self.weights**2 - followed, 0.0, 1.0),
            self.hypothesis.noise,
        )

    def _gram(self) -> tuple[Matrix, Vector, float]:
        """Return curvature, slope and constant of the likelihood with the present factors."""
        gram = np.tensordot(1.0 / self.factors**2, self.grams, axes=1)
        return gram[:-1, :-1], -gram[:-1, -1], float(gram[-1, -1])

    def _natural(self) -> tuple[Matrix, Vector]:
        """Return precision and linear term of the posterior."""
        curvature, slope, _ = self._gram()
        precision, linear = self.precision.copy(), slope + self.linear
        for place, scale in zip(self.places, self.scales, strict=True):
            precision[place] += 1.0 / (scale * self.units[place]) ** 2
        precision[self.sites] += self.site_precision
        linear[self.sites] += self.site_linear
        return curvature + np.diag(precision), linear

    def _posterior(self) -> tuple[Vector, Matrix]:
        """Return mean and covariance of all unknowns in their units."""
        precision, linear = self._natural()
        inverse = _inverse(precision)
        return inverse @ linear, inverse

    def _at_mode(self) -> tuple[Vector, Matrix, Vector, Matrix, Vector]:
        """Return what `_posterior` does, and rows in standard deviations of their noise.

        These are that deviation (n,), the columns (n, k) and the residuals (n,) in units of it.
        """
        mean, covariance = self._posterior()
        by_row = self.factors[self.hypothesis.channels] / self.weights
        left = (self.shift + self.columns @ mean) / by_row
        return mean, covariance, by_row, self.columns / by_row[:, None], left

    def _ln(self) -> float:
        """Return the logarithm of the integral at the present scales and factors."""
        precision, linear = self._natural()
        size = np.sqrt(np.diag(precision))
        factor = cho_factor(precision / np.outer(size, size), lower=True)
        solved = cho_solve(factor, linear / size)
        ln_det = 2.0 * np.sum(np.log(np.diag(factor[0]))) + 2.0 * np.sum(np.log(size))
        ln = 0.5 * float((linear / size) @ solved) - 0.5 * float(ln_det)
        ln += 0.5 * len(linear) * np.log(2.0 * np.pi) - 0.5 * self._gram()[2]
        ln -= float(self.counts @ (np.log(self.factors) + 0.5 * np.log(2.0 * np.pi)))
        for place, part, scale in zip(self.places, self.hypothesis.sized, self.scales, strict=True):
            m = place.stop - place.start
            ln -= float(np.sum(np.log(scale * self.units[place]))) + 0.5 * m * np.log(2.0 * np.pi)
            ln += float(np.sum(part.positive)) * np.log(2.0)
        return float(ln + self.constant + np.sum(self.site_constant))

    def _integrate_bounds(self) -> None:
        """Approximate each bound by the Gaussian of the same moments beside all others."""
        if not len(self.sites):
            return
        n_boxed, damping = len(self.boxed), 1.0
        before = np.inf
        precision, linear = self._natural()
        precision[self.sites, self.sites] -= self.site_precision
        linear[self.sites] -= self.site_linear
        precision, linear = _marginal(precision, linear, self.sites)
        for sweep in range(_SWEEPS):
            covariance = _inverse(precision + np.diag(self.site_precision))
            variance = np.diag(covariance)
            centre = covariance @ (linear + self.site_linear)
            cavity = np.maximum(1.0 / variance - self.site_precision, 1e-12 / variance)
            away = (centre / variance - self.site_linear) / cavity
            ln, first, second = np.empty((3, len(self.sites)))
            boxed, signed = slice(0, n_boxed), slice(n_boxed, None)
            ln[boxed], first[boxed], second[boxed] = _within(
                away[boxed], 1.0 / cavity[boxed], *self.bounds
            )
            if len(self.signed):
                ln[signed], first[signed], second[signed] = _piece(
                    away[signed], 1.0 / cavity[signed], 0.0, self.largest
                )
            wanted = np.maximum(1.0 / second - cavity, 0.0)
            wanted_linear = first * (wanted + cavity) - away * cavity
            damping = 1.0 if sweep < 8 else 0.5
            new = self.site_precision + damping * (wanted - self.site_precision)
            new_linear = self.site_linear + damping * (wanted_linear - self.site_linear)
            self.site_precision, self.site_linear = new, new_linear
            total = cavity + wanted
            of_cavity = 0.5 * np.log(cavity / total) + 0.5 * (
                (away * cavity + wanted_linear) ** 2 / total - away**2 * cavity
            )
            self.site_constant = ln - of_cavity
            change = np.max(np.abs(first - centre) / np.sqrt(variance))
            if change < _SETTLED and abs(change - before) < 1.0:
                break
            before = change

    def _set_scales(self) -> None:
        """Move all scales to their modes, one after the other."""
        precision, linear = self._natural()
        covariance = _inverse(precision)
        for number, place in enumerate(self.places):
            before = 1.0 / (self.scales[number] * self.units[place]) ** 2
            self._set_scale(number, covariance[place, place], (covariance @ linear)[place])
            change = 1.0 / (self.scales[number] * self.units[place]) ** 2 - before
            if np.any(change):
                # The inverse with another prior, by Woodbury's formula.
                root = np.eye(len(change)) + change[:, None] * covariance[place, place]
                solved = np.linalg.solve(root, change[:, None] * covariance[place])
                covariance = covariance - covariance[:, place] @ solved

    def _set_scale(self, number: int, covariance: Matrix, mean: Vector) -> None:
        """Move one scale to its mode; keep what its integral is beyond the value there.

        ``covariance`` and ``mean`` are those of its coefficients at the present scale.
        """
        place, grid = self.places[number], self.log_scales[number]
        if len(grid) == 1:
            return
        units = self.units[place]
        precision = _inverse(covariance)
        along = precision @ mean
        block = precision - np.diag(1.0 / (self.scales[number] * units) ** 2)
        values, vectors = np.linalg.eigh(block * np.outer(units, units))
        values = np.maximum(values, 0.0)
        projected = (vectors.T @ (along * units)) ** 2
        part = self.hypothesis.sized[number]
        cut = self.least[number] if part.cut else 0.0
        one_sided = bool(part.positive.all())
        whole, largest, at = _mean_over_scales(grid, values, projected, cut, one_sided)
        self.scales[number] = np.exp(at)
        self.corrections[number] = whole - largest

    def gains(self, places: Sequence[Sized], renewed: bool = False) -> Vector:
        """Return by how much each further quantity alone would raise the logarithm, (n_places,).

        To first order; minus infinity for one that would be invisible at its largest scale. The
        noise stays, or is ``renewed`` as it would be beside the most probable sizes. Then each
        error of the records, which may stand for what the quantity does, may be at its least, too.
        """
        gains = self._gains_at(places, renewed)
        if renewed:
            ln = self._ln()
            for number, part in enumerate(self.hypothesis.sized):
                if part.of_records and self.scales[number] > self.least[number]:
                    quiet = self._with_least(number)
                    others = quiet._gains_at(places, renewed) + quiet._ln() - ln
                    gains = np.maximum(gains, others)
        return gains

    def _with_least(self, number: int) -> Integral:
        """Return it with one scale at its least."""
        quiet = copy(self)
        quiet.scales = self.scales.copy()
        quiet.scales[number] = self.least[number]
        quiet._integrate_bounds()
        return quiet

    def _gains_at(self, places: Sequence[Sized], renewed: bool) -> Vector:
        """Return `gains` at the present scales."""
        _, covariance, by_row, scaled, left = self._at_mode()
        gains = np.full(len(places), -np.inf)
        every = np.column_stack([part.columns for part in places]) / by_row[:, None]
        shared = scaled.T @ every
        followed = covariance @ shared
        freedom = self._freedom(covariance)
        ends = np.cumsum([0, *(part.columns.shape[1] for part in places)])
        for number, part in enumerate(places):
            place = slice(ends[number], ends[number + 1])
            columns = every[:, place]
            along = -columns.T @ left
            curvature = columns.T @ columns - shared[:, place].T @ followed[:, place]
            values, vectors = np.linalg.eigh(curvature)
            values = np.maximum(values, 0.0)
            least = part.least
            if part.cut:
                largest = float(values.max(initial=0.0))
                least = max(least, np.sqrt(VISIBLE / largest) if largest > 0.0 else np.inf)
            if least >= part.most:
                continue
            grid = np.linspace(np.log(least), np.log(part.most), _GRID)
            cut, one_sided = least if part.cut else 0.0, bool(part.positive.all())
            projected = vectors.T @ along
            gains[number], _, at = _mean_over_scales(grid, values, projected**2, cut, one_sided)
            if renewed:
                sizes = vectors @ (projected / (values + np.exp(-2.0 * at)))
                after = left + columns @ sizes - scaled @ (followed[:, place] @ sizes)
                gains[number] += self._gain_of_noise(after, freedom)
        return gains

    def losses(self) -> Vector:
        """Return by how much the logarithm would fall without each effect, (n_members,).

        To first order, with renewed noise, at the present scales: by the ratio of the densities of
        its coefficients at nothing (Dickey, Ann. Math. Statist. 42, 1971).
        """
        mean, covariance, _, scaled, left = self._at_mode()
        freedom = self._freedom(covariance)
        losses = np.zeros(len(self.hypothesis.members))
        for number, member in enumerate(self.hypothesis.members):
            own = range(member.sized.start, member.sized.stop)
            if not own:
                continue
            rows = np.r_[tuple(self.places[k] for k in own)]
            precision = _inverse(covariance[np.ix_(rows, rows)])
            along = precision @ mean[rows]
            priors = np.concatenate([self.scales[k] * self.units[self.places[k]] for k in own])
            losses[number] = 0.5 * float(mean[rows] @ along) - 0.5 * float(
                np.linalg.slogdet(precision * np.outer(priors, priors))[1]
            )
            after = left - scaled @ (covariance[:, rows] @ along)
            losses[number] -= self._gain_of_noise(after, freedom)
        return losses

    def _gain_of_noise(self, left: Vector, freedom: Vector) -> float:
        """Return by how much factors that fit residuals (n,), in units of them, are likelier.

        ``freedom`` is that of each channel, as of `_freedom`.
        """
        spread, channels = self.hypothesis.noise, self.hypothesis.channels
        if spread <= 0.0:
            return 0.0
        before = np.log(self.factors)
        power = np.zeros_like(before)
        np.add.at(power, channels, left**2)
        after = before + _log_factor(power, freedom, before, spread)
        of_prior = (before**2 - after**2) / (2.0 * spread**2)
        ratio = after - before
        of_data = -freedom * ratio + 0.5 * power * (1.0 - np.exp(-2.0 * ratio))
        return float(np.sum(of_data + of_prior))

    def _freedom(self, covariance: Matrix) -> Vector:
        """Return the number of values of each channel that no unknown follows, (n_channels,)."""
        followed = np.tensordot(self.grams[:, :-1, :-1], covariance, axes=2) / self.factors**2
        return np.asarray(np.maximum(self.counts - followed, 0.0))

    def _set_factors(self) -> float:
        """Move the factors of the noise to their mode; return the logarithm of their integral."""
        spread = self.hypothesis.noise
        if spread <= 0.0 or not len(self.counts):
            return 0.0
        mean, covariance = self._posterior()
        whole = np.append(mean, 1.0)
        left = self.grams @ whole @ whole
        freedom = self._freedom(covariance)
        log = np.log(self.factors)
        log += _log_factor(left / self.factors**2, freedom, log, spread)
        self.factors = np.exp(log)
        power = left / self.factors**2
        root = np.sqrt(2.0 * power + 1.0 / spread**2)
        return float(np.sum(-0.5 * (log / spread) ** 2 - np.log(spread * root)))


def _log_factor(power: Vector, freedom: Vector, log: Vector, spread: float) -> Vector:
    """Return by how much logarithms of factors have to change to be most probable, (n_channels,).

    For residuals of a ``power`` in units of the present factors, whose logarithms are ``log``. By
    Newton's method: freedom = power / ratio^2 - log / spread^2.
    """
    step, change = np.zeros_like(log), np.zeros_like(log)
    for _ in range(20):
        scaled = power * np.exp(-2.0 * change)
        step = (scaled - freedom - (log + change) / spread**2) / (2.0 * scaled + 1.0 / spread**2)
        change = change + np.clip(step, -1.0, 1.0)
        if np.max(np.abs(step), initial=0.0) < 1e-6:
            break
    return change


def _mean_over_scales(
    grid: Vector,
    values: Vector,
    projected: Vector,
    cut: float = 0.0,
    one_sided: bool = False,
) -> tuple[float, float, float]:
    """Return ln of the mean likelihood ratio over logarithms of a scale, its largest, and where.

    The ratio is that to a scale of 0, for curvatures ``values`` of the likelihood along orthogonal
    directions, and squares of its slopes along them. With a ``cut`` coefficients are at least that
    large together: the mean is times the probability of this afterwards, over that beforehand.
    """
    square = np.exp(2.0 * grid)[:, None]
    ln = 0.5 * np.sum(
        square * projected / (1.0 + square * values) - np.log1p(square * values), axis=1
    )
    best = int(np.argmax(ln))
    shares = np.exp(ln - ln[best])
    if cut > 0.0:
        variance = square / (1.0 + square * values)
        away = np.sqrt(np.sum(projected * variance**2, axis=1))
        spread = np.sqrt(variance.mean(axis=1))
        before = _chance_beyond(cut, 0.0 * spread, np.exp(grid), len(values), one_sided)
        after = _chance_beyond(cut, away, spread, len(values), one_sided)
        shares, divisor = shares * after, np.trapezoid(before, grid)
    else:
        divisor = grid[-1] - grid[0]
    mean = max(float(np.trapezoid(shares, grid) / divisor), 1e-300)
    return float(ln[best] + np.log(mean)), float(ln[best]), float(grid[best])


def _chance_beyond(cut: float, away: Vector, spread: Vector, m: int, one_sided: bool) -> Vector:
    """Return the chance that m normal values, of a mean this far away, are beyond a distance."""
    if m == 1:
        other = np.where(away > 0.0, 0.0, 1.0) if one_sided else 1.0
        return np.asarray(
            norm.cdf((away - cut) / spread) + other * norm.cdf((-away - cut) / spread)
        )
    distance, centre = np.broadcast_arrays(cut / spread, away / spread)
    # Far out a sphere is flat. There the series of the exact chance overflows, or has no end.
    chance = norm.sf(distance - np.hypot(centre, np.sqrt(m - 1.0)))
    curved = (centre < _FLAT) & (distance > centre - _INSIDE) & (distance < centre + _SURE)
    chance[curved] = ncx2.sf(distance[curved] ** 2, m, np.maximum(centre[curved] ** 2, 1e-12))
    return np.asarray(chance)


_FLAT = 100.0
"""Radius of a sphere, in deviations, from which on the chance to be beyond it is that to be beyond
a plane, to some hundredths of itself."""
_INSIDE, _SURE = 10.0, 30.0
"""Deviations within a sphere, and beyond it, at which the chance is 1 and 0 to all digits."""


def _marginal(precision: Matrix, linear: Vector, rows: NDArray[np.int_]) -> tuple[Matrix, Vector]:
    """Return precision and linear term of some unknowns, integrated over all others."""
    others = np.setdiff1d(np.arange(len(linear)), rows)
    inner, slope = precision[np.ix_(rows, rows)], linear[rows]
    if not len(others):
        return inner, slope
    across = precision[np.ix_(others, rows)]
    size = np.sqrt(np.diag(precision)[others])
    factor = cho_factor(precision[np.ix_(others, others)] / np.outer(size, size), lower=True)
    solved = cho_solve(factor, across / size[:, None]) / size[:, None]
    return inner - across.T @ solved, slope - solved.T @ linear[others]


def _inverse(matrix: Matrix) -> Matrix:
    """Return the inverse of a positive definite matrix, whatever the sizes of its unknowns."""
    size = np.sqrt(np.diag(matrix))
    inverse = cho_solve(cho_factor(matrix / np.outer(size, size), lower=True), np.eye(len(size)))
    return np.asarray(inverse / np.outer(size, size))


def _within(
    mean: Vector, variance: Vector, lower: Vector, upper: Vector, shoulder: Vector
) -> tuple[Vector, Vector, Vector]:
    """Return ln of the integral, mean and variance of Gaussians within bounds with shoulders (k,).

    The density is flat between the bounds, falls outside as a Gaussian, and integrates to 1.
    """
    pieces = [_piece(mean, variance, lower, upper)]
    for bound, below in ((lower, True), (upper, False)):
        total = variance + shoulder**2
        centre = (mean * shoulder**2 + bound * variance) / total
        limits = (-np.inf, bound) if below else (bound, np.inf)
        ln, first, second = _piece(centre, variance * shoulder**2 / total, *limits)
        ln = ln - 0.5 * (mean - bound) ** 2 / total + 0.5 * np.log(shoulder**2 / total)
        pieces.append((ln, first, second))
    lns, firsts, seconds = (np.array(values) for values in zip(*pieces, strict=True))
    largest = lns.max(axis=0)
    weights = np.exp(lns - largest)
    whole = weights.sum(axis=0)
    weights = weights / whole
    first = np.sum(weights * firsts, axis=0)
    second = np.sum(weights * (seconds + (firsts - first) ** 2), axis=0)
    width = upper - lower + np.sqrt(2.0 * np.pi) * shoulder
    return largest + np.log(whole) - np.log(width), first, second


def _piece(
    mean: Vector, variance: Vector, lower: Vector | float, upper: Vector | float
) -> tuple[Vector, Vector, Vector]:
    """Return ln of the integral, mean and variance of Gaussians between limits, all (k,).

    By Gauss-Legendre quadrature where the density is not negligible, however far in a tail.
    """
    top = np.clip(mean, lower, upper)
    away = np.abs(mean - top)
    reach = np.sqrt(away**2 + 2.0 * _REACH * variance) - away
    begin, end = np.maximum(lower, top - reach), np.minimum(upper, top + reach)
    half = (end - begin) / 2.0
    points = ((begin + end) / 2.0)[:, None] + half[:, None] * _NODES
    exponent = -((points - mean[:, None]) ** 2 - away[:, None] ** 2) / (2.0 * variance[:, None])
    weights = np.exp(exponent) * _WEIGHTS * half[:, None]
    whole = np.maximum(weights.sum(axis=1), 1e-300)
    first = (weights * points).sum(axis=1) / whole
    second = (weights * (points - first[:, None]) ** 2).sum(axis=1) / whole
    ln = np.log(whole) - away**2 / (2.0 * variance) - 0.5 * np.log(2.0 * np.pi * variance)
    return ln, first, np.maximum(second, 1e-300)
