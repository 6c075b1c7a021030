"""A single joint fitted by ``mujoco.sysid``: armature, damping, dry friction, and a delay.

The study starts from the joint that our export writes. It has no list of effects: whoever starts
it knows what is missing.
"""

from __future__ import annotations

from contextlib import redirect_stdout
from importlib import import_module
from io import StringIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy import MechanismModel
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.export import to_mujoco
from pymoo_hdte.mechanism import LawAt, Record
from pymoo_hdte.mechanism.motion import SmoothedMotion, motion_of, smooth

Values = NDArray[np.float64]

_LATEST = 0.05
"""s. Largest delay of the torque, and largest time by which it may come too early."""
_FITTED = "armature", "damping", "frictionloss"


def installed() -> bool:
    """Tell whether mujoco has its extra ``sysid``; without it the module is empty."""
    try:
        from mujoco import sysid
    except ImportError:
        return False
    return hasattr(sysid, "optimize")


class JointStudy:
    """Windows of the records of a joint, as ``mujoco.sysid`` takes them.

    Parameters
    ----------
    finding : MechanismFinding
        Of a mechanism of one coordinate that turns, one port and one input.
    """

    def __init__(self, finding: MechanismFinding) -> None:
        sysid: Any = import_module("mujoco.sysid")
        self._sysid = sysid
        self.finding = finding
        mechanism = finding.mechanism
        (self.coordinate,) = mechanism.coordinates
        (self.input,) = mechanism.inputs
        (port,) = mechanism.ports
        self.window = min(record.extent.length for record in finding.simulated)
        force = np.concatenate([self._signals(one)[0] for one in finding.records])
        largest = float(np.abs(force).max() * abs(self.input.gain.value))
        friction = LawAt("coulomb_friction", port.name, CoulombFriction(0.1 * largest))
        exported = to_mujoco(MechanismModel("joint", mechanism, (friction,)))
        self.spec: Any = import_module("mujoco").MjSpec.from_string(exported.text)
        self.model: Any = self.spec.compile()
        limits = {
            "armature": mechanism.inertias[self.coordinate].fit_limits,
            "damping": port.damping.fit_limits,
            "frictionloss": (0.0, largest),
        }
        self.parameters: Any = sysid.ParameterDict()
        for name in _FITTED:
            start = float(getattr(self.model, f"dof_{name}")[0])
            change = _setter(self.coordinate, name)
            self.parameters.add(sysid.Parameter(name, start, *limits[name], modifier=change))
        self.parameters.add(sysid.Parameter("delay", 0.0, -_LATEST, _LATEST))

    def fitted(self) -> dict[str, float]:
        """Return the values that predict the windows of the training records best, SI."""
        windows = [
            window
            for record in self.finding.records
            if record.role == "train"
            for window in self._consecutive(record)
        ]
        with redirect_stdout(StringIO()):  # its optimiser prints each step
            parameters, _ = self._sysid.optimize(
                initial_params=self.parameters,
                residual_fn=self._residual(windows),
                verbose=False,
            )
        return {name: float(parameters[name].value[0]) for name in (*_FITTED, "delay")}

    def held_out(self, values: dict[str, float]) -> tuple[Values, Values]:
        """Return measured and predicted positions, (n,), in the windows of the workflow."""
        rows = {one.record: one.rows for one in self.finding.simulated}
        windows = [
            (record, window)
            for record in self.finding.records
            for window in rows.get(record.name, ())
        ]
        vector = np.array([values[name] for name in (*_FITTED, "delay")])
        _, predicted, measured = self._residual(windows)(
            vector, self.parameters.copy(), return_pred_all=True
        )
        true, ours = (
            np.concatenate([series[0].data[:, 0] for series in every])
            for every in (measured, predicted)
        )
        return true, ours

    def _signals(self, record: Record) -> tuple[Values, SmoothedMotion]:
        """Return the smoothed control and the motion of a record."""
        cutoff = self.finding.cutoff
        control = smooth(record.channels[self.input.name], record.step, cutoff)
        return control, motion_of(record.channels[self.coordinate], record.step, cutoff)

    def _consecutive(self, record: Record) -> list[tuple[Record, slice]]:
        length = round(self.window / record.step)
        firsts = range(0, len(record.time) - length, length)
        return [(record, slice(first, first + length + 1)) for first in firsts]

    def _residual(self, windows: list[tuple[Record, slice]]) -> Any:
        series, states, controls, measured = self._sysid.TimeSeries, [], [], []
        signals = {record.name: self._signals(record) for record, _ in windows}
        for record, rows in windows:
            control, motion = signals[record.name]
            clock = record.time[rows] - record.time[rows.start]
            angle = record.channels[self.coordinate][rows, None]
            start = (motion.position[rows.start, None], motion.speed[rows.start, None])
            states.append(self._sysid.create_initial_state(self.model, *start))
            controls.append(series.from_control_names(clock, control[rows, None], self.model))
            measured.append(series.from_names(clock, angle, self.model))
        names = [f"{record.name} from {rows.start}" for record, rows in windows]
        study = self._sysid.ModelSequences("joint", self.spec, names, states, controls, measured)
        return self._sysid.build_residual_fn(
            models_sequences=[study],
            modify_residual=_difference,
            custom_rollout=_delayed,
            n_threads=1,
        )


def _setter(joint: str, name: str) -> Any:
    """Return what writes a value into the description of a joint."""

    def change(spec: Any, parameter: Any) -> None:
        values = np.atleast_1d(getattr(spec.joint(joint), name)).copy()
        values[0] = parameter.value[0]  # damping is a polynomial in MuJoCo 4
        setattr(spec.joint(joint), name, values if values.size > 1 else values[0])

    return change


def _difference(
    parameters: Any, predicted: Any, measured: Any, model: Any, whole: bool, **state: Any
) -> tuple[Values, Any, Any]:
    """Return measured minus predicted positions but the first, which is given, and both."""
    measured = type(measured)(measured.times[1:], measured.data[1:], measured.signal_mapping)
    predicted = predicted.resample(measured.times)
    return measured.data - predicted.data, predicted, measured


def _delayed(control_signal: Any, param_dicts: Any, **rollout: Any) -> Any:
    """Roll out with controls that act later by the parameter ``delay``."""
    sysid = import_module("mujoco.sysid")
    share = len(control_signal) // len(param_dicts)
    moved = []
    for place, control in enumerate(control_signal):
        delay = float(param_dicts[place // share]["delay"].value[0])
        times = np.clip(control.times - delay, control.times[0], control.times[-1])
        data = np.interp(times, control.times, control.data[:, 0])[:, None]
        moved.append(sysid.TimeSeries(control.times, data, control.signal_mapping))
    names = "rollout_signal_mapping", "rollout_state_mapping", "ctrl_mapping"
    states, mappings = rollout["initial_states"], {name: rollout[name] for name in names}
    return sysid.sysid_rollout(rollout["models"], rollout["datas"], moved, states, **mappings)
