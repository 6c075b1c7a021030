"""What other tools make of a measured rig: least squares, sparse regression, NARMAX, MuJoCo.

They get the smoothed motion and the force of the workflow, train on its training records and
predict its held-out ones. Each imports its package when it is called.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

from experiments.studies.measured import mujoco_study
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import measured_data
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.mechanism import Record
from pymoo_hdte.mechanism.motion import motion_of, smooth

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
_LAGS, _DEGREE, _TERMS = 2, 3, 12
"""Of NARMAX models: past samples, powers, and most terms."""


@dataclass(frozen=True, eq=False)
class Terms:
    """Terms and force of records as coefficients of a cosine transform up to the cutoff.

    Beyond it the motion is not known. Rows at rest are left out as in the force balances.

    Attributes
    ----------
    columns : ndarray, shape (n, k)
    force, constant : ndarray, shape (n,)
        Of the inputs, and of a constant.
    rows : int
        Of the records that are not left out.
    """

    columns: Values
    force: Values
    constant: Values
    rows: int

    @property
    def power(self) -> float:
        """Variance of the force about its mean over all records."""
        mean = (self.constant @ self.force) / (self.constant @ self.constant)
        about = self.force - self.constant * mean
        return float(about @ about / self.rows)

    def explained(self, values: Values) -> float:
        """Return R2 of the force for values (k,) of the terms."""
        residual = self.force - self.columns @ values
        return float(1.0 - residual @ residual / self.rows / self.power)


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
    words : str
        Its terms with their values.
    names : frozenset of str or None
        Effects that its terms stand for; None where they have no such meaning.
    of_force, of_motion : float or None
        R2 of the held-out force, and of the position simulated in the windows of the workflow.
    """

    words: str
    names: frozenset[str] | None = None
    of_force: float | None = None
    of_motion: float | None = None


@dataclass(frozen=True)
class Tool:
    """A tool that is set beside the workflow.

    Attributes
    ----------
    name : str
    package : str
        That it needs; empty for what is there anyway.
    ask : callable
        From a finding on a mechanism of one coordinate and one input to an `Answer`.
    rigs : tuple of str
        That it is asked about; all where empty.
    """

    name: str
    package: str
    ask: Callable[[MechanismFinding], Answer]
    rigs: tuple[str, ...] = ()

    @property
    def version(self) -> str | None:
        """Version of the package; None where it is not installed."""
        if not self.package:
            return ""
        if self.package == "mujoco" and not mujoco_study.installed():
            return None
        try:
            return version(self.package)
        except PackageNotFoundError:
            return None


def least_squares(finding: MechanismFinding) -> Answer:
    """Fit inertia, viscous and Coulomb friction, an offset, and the spring that is believed."""
    names = ["a", "v", "sign v", "1", *(["q"] if _sprung(finding) else [])]
    train, test = terms_of(finding, "train", names), terms_of(finding, "held_out", names)
    values: Values = np.linalg.lstsq(train.columns, train.force, rcond=None)[0].astype(float)
    return Answer(_in_words(names, values), frozenset({"coulomb_friction"}), test.explained(values))


def sparse_regression(finding: MechanismFinding) -> Answer:
    """Name terms by sequentially thresholded least squares of the force (pysindy).

    Brunton, Proctor, Kutz, PNAS 113, 2016. The threshold is the largest that predicts the last part
    of the training records within a tenth of the best one.
    """
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
    return Answer(_in_words(names, values), named, of_force)


def narmax(finding: MechanismFinding) -> Answer:
    """Fit a polynomial NARMAX model by forward regression of orthogonal terms (sysidentpy).

    Of the position from its past and that of the input, at the samples of our simulation, and
    simulated in the same windows. Its terms stand for no effect.
    """
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    simulated = {record.record: record for record in finding.simulated}
    if not simulated:
        return Answer("nothing held out")
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
    return Answer(words, of_motion=of_motion)


def mujoco_sysid(finding: MechanismFinding) -> Answer:
    """Fit what a joint of MuJoCo has to the motion in windows, and a delay (mujoco.sysid)."""
    study = mujoco_study.JointStudy(finding)
    values = study.fitted()
    names = ["a", "v", "sign v"]
    fitted = np.array([values[name] for name in ("armature", "damping", "frictionloss")])
    words = f"{_in_words(names, fitted)}, {1000.0 * values['delay']:.3g} ms of delay"
    of_force = terms_of(finding, "held_out", names).explained(fitted)
    of_motion = _determination(*study.held_out(values))
    return Answer(words, frozenset({"coulomb_friction"}), of_force, of_motion)


SYSID = "mujoco.sysid"
TOOLS = (
    Tool("least squares", "", least_squares),
    Tool("pysindy", "pysindy", sparse_regression),
    Tool("FROLS", "sysidentpy", narmax),
    Tool(SYSID, "mujoco", mujoco_sysid, ("ur10e_joint_1", "tx40_joint_4", "dm4310")),
)


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
    values, count = [], 0
    for record in finding.records:
        if record.role != role:
            continue
        force, angle = _signals(finding, record)
        weight = _weight(finding, record)
        moving = np.flatnonzero(weight)
        first, last = (int(share * len(moving)) for share in part)
        motion, rows = motion_of(angle, record.step, finding.cutoff), moving[first:last]
        state = motion.position[rows], motion.speed[rows], motion.acceleration[rows]
        columns = [TERMS[name](*state) for name in names]
        signals = np.column_stack([*columns, force[rows], np.ones(len(rows))])
        bins = int(2.0 * len(rows) * record.step * finding.cutoff) + 1
        values.append(dct(weight[rows, None] * signals, type=2, norm="ortho", axis=0)[:bins])
        count += len(rows)
    together = np.concatenate(values)
    return Terms(together[:, :-2], together[:, -2], together[:, -1], count)


def _weight(finding: MechanismFinding, record: Record) -> Values:
    """Return the weight of each row of a record in its force balance, shape (n,)."""
    data = measured_data(finding.mechanism, [record], finding.cutoff, finding.data.known)
    (balance,) = data.spectra
    return np.interp(record.time, balance.time, balance.moving.weight, left=0.0, right=0.0)


def _determination(measured: Values, predicted: Values) -> float:
    """Return R2; minus infinity where a model diverges."""
    with np.errstate(all="ignore"):
        residual = float(np.mean((measured - predicted) ** 2))
    return 1.0 - residual / float(np.var(measured)) if np.isfinite(residual) else -np.inf


def _in_words(names: Sequence[str], values: Values) -> str:
    words = (f"{value:.3g} {name}" for name, value in zip(names, values, strict=True) if value)
    return " + ".join(words)
