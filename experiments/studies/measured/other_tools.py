"""What other tools make of a measured rig: sparse regression, NARMAX, and least squares.

They get the smoothed motion and the force of the workflow, train on its training records and
predict its held-out ones. Each imports its package when it is called.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

from pymoo_hdte.discrepancy._answers.descriptive_model import descriptive_model
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.mechanism import Record
from pymoo_hdte.mechanism.motion import margin_of, motion_of, smooth

Values = NDArray[np.float64]
Part = tuple[float, float]
"""First and last share of a record."""

_MOST_ROWS = 4000
"""Of a NARMAX model."""
_VALIDATED = 0.3
"""Last share of the training records, by which a threshold is chosen."""
_AS_GOOD = 1.1
"""Ratio of mean squares up to which the model with fewer terms is taken."""
_THRESHOLDS = np.geomspace(1e-3, 0.3, 12)
_SIDES = "descriptive", "six_terms"
_LAGS, _DEGREE, _TERMS = 2, 3, 12
"""Of NARMAX models: past samples, powers, and most terms."""


@dataclass(frozen=True, eq=False)
class Terms:
    """Terms and force of records as coefficients of a cosine transform up to the cutoff.

    Beyond it the motion is not known.

    Attributes
    ----------
    columns : ndarray, shape (n, k)
    force, constant : ndarray, shape (n,)
        Of the inputs, and of a constant.
    """

    columns: Values
    force: Values
    constant: Values

    @property
    def power(self) -> float:
        """Variance of the force about its mean over all records."""
        samples = self.constant @ self.constant
        about = self.force - self.constant * (self.constant @ self.force) / samples
        return float(about @ about / samples)

    def explained(self, values: Values) -> float:
        """Return R2 of the force for values (k,) of the terms."""
        residual = self.force - self.columns @ values
        return float(1.0 - residual @ residual / (self.constant @ self.constant) / self.power)


TERMS: dict[str, Callable[[Values, Values, Values], Values]] = {
    "a": lambda q, v, a: a,
    "v": lambda q, v, a: v,
    "q": lambda q, v, a: q,
    "1": lambda q, v, a: np.ones(len(q)),
    "sign v": lambda q, v, a: np.sign(v),
    "v |v|": lambda q, v, a: v * np.abs(v),
    "v^(1/3)": lambda q, v, a: np.cbrt(v),
    "q^2": lambda q, v, a: q**2,
    "q^3": lambda q, v, a: q**3,
    "sin q": lambda q, v, a: np.sin(q),
    "cos q": lambda q, v, a: np.cos(q),
}
MEANS = {
    "1": "force_offset",
    "sign v": "coulomb_friction",
    "v |v|": "nonlinear_drag",
    "v^(1/3)": "nonlinear_drag",
    "q": "linear_stiffness",
    "q^3": "hardening_stiffness",
    "sin q": "gravity",
    "cos q": "gravity",
}
"""The effect that a term stands for."""


@dataclass(frozen=True)
class Answer:
    """What a tool says.

    Attributes
    ----------
    tool : str
    words : str
        Its terms with their values.
    names : frozenset of str or None
        Effects that its terms stand for; None where they have no such meaning.
    of_force, of_motion : float or None
        R2 of the held-out force, and of the position simulated in the windows of the workflow.
    seconds : float
        CPU time.
    """

    tool: str
    words: str
    names: frozenset[str] | None
    of_force: float | None
    of_motion: float | None
    seconds: float


def answers(finding: MechanismFinding) -> list[Answer]:
    """Return the answers of all tools on a mechanism of one coordinate and one input."""
    given = []
    for tool in (least_squares, six_terms, descriptive, sparse_regression, narmax):
        began = time.process_time()
        answer = tool(finding)
        given.append(Answer(*answer, time.process_time() - began))
    return given


Said = tuple[str, str, frozenset[str] | None, float | None, float | None]


def least_squares(finding: MechanismFinding) -> Said:
    """Fit inertia, viscous and Coulomb friction, an offset, and the spring that is believed."""
    names = ["a", "v", "sign v", "1", *(["q"] if _sprung(finding) else [])]
    return _least_squares("least squares", finding, names)


def six_terms(finding: MechanismFinding) -> Said:
    """Fit what a practitioner fits to a joint: the same, and gravity whether it can pull or not."""
    return _least_squares("six terms", finding, ["a", "v", "sign v", "sin q", "cos q", "1"])


def _least_squares(tool: str, finding: MechanismFinding, names: Sequence[str]) -> Said:
    train, test = terms_of(finding, "train", names), terms_of(finding, "held_out", names)
    values: Values = np.linalg.lstsq(train.columns, train.force, rcond=None)[0].astype(float)
    named = frozenset({"coulomb_friction"})
    return tool, _in_words(names, values), named, test.explained(values), None


def descriptive(finding: MechanismFinding) -> Said:
    """Describe the records by all terms that predict better, whatever the verdict (our own)."""
    model = descriptive_model("", finding)
    (coordinate,) = finding.mechanism.coordinates
    errors = [one for one in model.held_out if one.quantity == coordinate]
    words = " + ".join(dict.fromkeys(effect.name for effect, _ in model.effects)).replace("_", " ")
    # Both were judged on the same rows, which are fewer than those of the other tools.
    ours, theirs = (sum(getattr(one, name) ** 2 for one in errors) for name in _SIDES)
    of_force = 1.0 - ours / theirs * (1.0 - (six_terms(finding)[3] or 0.0))
    return "descriptive model", words or "nothing", None, of_force, None


def sparse_regression(finding: MechanismFinding) -> Said:
    """Name terms by sequentially thresholded least squares of the force (pysindy).

    Brunton, Proctor, Kutz, PNAS 113, 2016. The threshold is the largest that predicts the last part
    of the training records within a tenth of the best one.
    """
    if find_spec("pysindy") is None:
        return "pysindy", "not installed", None, None, None
    from pysindy.optimizers import STLSQ

    turning = any(finding.mechanism.turns(port) for port in finding.mechanism.ports)
    names = [term for term in TERMS if turning or term not in ("sin q", "cos q")]
    parts = (0.0, 1.0 - _VALIDATED), (1.0 - _VALIDATED, 1.0), (0.0, 1.0)
    first, last, whole = (terms_of(finding, "train", names, part) for part in parts)

    def fitted(threshold: float, given: Terms) -> Values:
        scale = np.sqrt(np.mean(given.columns**2, axis=0))
        size = np.sqrt(np.mean(given.force**2))
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore")
            model = STLSQ(threshold=threshold, alpha=1e-9)
            model.fit(given.columns / scale, given.force[:, None] / size)
        return np.asarray(model.coef_[0] * size / scale)

    explained = [last.explained(fitted(threshold, first)) for threshold in _THRESHOLDS]
    least = 1.0 - _AS_GOOD * (1.0 - max(explained))
    near = zip(_THRESHOLDS.tolist(), explained, strict=True)
    values = fitted(max(threshold for threshold, share in near if share >= least), whole)
    selected = [name for name, value in zip(names, values, strict=True) if value != 0.0]
    believed = {"linear_stiffness"} if _sprung(finding) else set()
    named = frozenset(MEANS[name] for name in selected if name in MEANS) - believed
    of_force = terms_of(finding, "held_out", names).explained(values)
    return "pysindy", _in_words(names, values), named, of_force, None


def narmax(finding: MechanismFinding) -> Said:
    """Fit a polynomial NARMAX model by forward regression of orthogonal terms (sysidentpy).

    Of the position from its past and that of the input, at the samples of our simulation, and
    simulated in the same windows. Its terms stand for no effect.
    """
    if find_spec("sysidentpy") is None:
        return "FROLS", "not installed", None, None, None
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    simulated = {record.record: record for record in finding.simulated}
    if not simulated:
        return "FROLS", "nothing held out", None, None, None
    stride = next(iter(simulated.values())).rows[0].step
    (train, *_), held = (
        [record for record in finding.records if record.role == role]
        for role in ("train", "held_out")
    )
    scales = [float(np.std(signal)) for signal in _signals(finding, train)]
    model = FROLS(
        order_selection=True,
        n_info_values=_TERMS,
        ylag=_LAGS,
        xlag=_LAGS,
        basis_function=Polynomial(degree=_DEGREE),
        estimator=LeastSquares(),
    )
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.filterwarnings("ignore")
        last = min(len(train.time), _MOST_ROWS * stride)
        force, angle = (
            (signal[:last:stride] / scale)[:, None]
            for signal, scale in zip(_signals(finding, train), scales, strict=True)
        )
        model.fit(X=force, y=angle)
        measured, predicted = [], []
        for record in held:
            signals = _signals(finding, record)
            for rows in simulated[record.name].rows:
                x, y = (
                    (signal[rows] / scale)[:, None]
                    for signal, scale in zip(signals, scales, strict=True)
                )
                measured.append(y[_LAGS:, 0])
                predicted.append(model.predict(X=x, y=y)[_LAGS:, 0])
    of_motion = _determination(np.concatenate(measured), np.concatenate(predicted))
    words = f"{len(model.final_model)} terms of a NARMAX model of degree {_DEGREE}"
    return "FROLS", words, None, None, of_motion


def _sprung(finding: MechanismFinding) -> bool:
    return any(port.stiffness.value > 0.0 for port in finding.mechanism.ports if not port.read)


def _signals(finding: MechanismFinding, record: Record) -> tuple[Values, Values]:
    """Return force and position of a record, shape (n,), SI."""
    (coordinate,) = finding.mechanism.coordinates
    force = np.sum(
        [
            drive.acts[coordinate] * drive.gain.value * record.channels[drive.name]
            for drive in finding.mechanism.inputs
        ],
        axis=0,
    )
    return smooth(force, record.step, finding.cutoff), record.channels[coordinate]


def terms_of(
    finding: MechanismFinding, role: str, names: Sequence[str], part: Part = (0.0, 1.0)
) -> Terms:
    """Return terms and force of a part of the records of a role.

    Parameters
    ----------
    finding : MechanismFinding
    role : {"train", "held_out"}
    names : sequence of str
        Of `TERMS`.
    part : (float, float)
        First and last share of each record.
    """
    values = []
    for record in finding.records:
        if record.role != role:
            continue
        force, angle = _signals(finding, record)
        margin, n = margin_of(finding.cutoff, record.step), len(force)
        first, last = (margin + int(share * (n - 2 * margin)) for share in part)
        motion, rows = motion_of(angle, record.step, finding.cutoff), slice(first, last)
        state = motion.position[rows], motion.speed[rows], motion.acceleration[rows]
        columns = [TERMS[name](*state) for name in names]
        signals = np.column_stack([*columns, force[rows], np.ones(last - first)])
        bins = int(2.0 * (last - first) * record.step * finding.cutoff) + 1
        values.append(dct(signals, type=2, norm="ortho", axis=0)[:bins])
    together = np.concatenate(values)
    return Terms(together[:, :-2], together[:, -2], together[:, -1])


def _determination(measured: Values, predicted: Values) -> float:
    """Return R2; minus infinity where a model diverges."""
    with np.errstate(all="ignore"):
        residual = float(np.mean((measured - predicted) ** 2))
    return 1.0 - residual / float(np.var(measured)) if np.isfinite(residual) else -np.inf


def _in_words(names: Sequence[str], values: Values) -> str:
    words = (f"{value:.3g} {name}" for name, value in zip(names, values, strict=True) if value)
    return " + ".join(words)
