"""A commented ``campaign.toml`` for records of a drive on a bench that nobody has described."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io.unstated import UnstatedTable
from pymoo_hdte.checks import InvalidInput, complaints_of
from pymoo_hdte.discrepancy._records.campaign import RATED_STIFFNESS, RATED_TORQUE
from pymoo_hdte.discrepancy._records.campaign_files import read_campaign
from pymoo_hdte.discrepancy._records.campaign_keys import CAMPAIGN_FILE
from pymoo_hdte.discrepancy._records.drafts.column_roles import ColumnGuess, Roles
from pymoo_hdte.discrepancy._records.drafts.log_folder import LogFolder
from pymoo_hdte.discrepancy._records.drafts.rig_draft import (
    EDIT,
    channel_text,
    guess_text,
    remark,
    roles_of,
    toml_value,
)
from pymoo_hdte.mechanism.motion import noise_of
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

Values = NDArray[np.float64]

_STEADY = 0.1
"""Of the mean speed, which a record at one speed leaves by no more."""
_MOST = 0.5
"""Share of the records from which a folder is one of a bench."""
_LEAST_RATIO = 10.0
"""Of a harmonic drive."""
_LOCKED = 0.1
"""Of the output's travel that an input moves, at most, if it is locked: referred to the output."""
_CLOSE = 0.02
"""Relative, of a measured mean from a round number that was likely set."""
_WIDE = 0.9
"""Relative tolerance of values that nothing tells."""
_LIKE_RATED = {
    "damping_output_Nms_per_rad": (4.5, "N.m.s/rad, of the mesh"),
    "input_inertia_kgm2": (1.97e-4, "kg.m2, motor and coupling included"),
    "input_damping_Nms_per_rad": (1.7e-4, "N.m.s/rad, of the input's bearings"),
    "output_damping_Nms_per_rad": (5.0e-4, "N.m.s/rad, of the output's bearings"),
    "output_inertia_kgm2": (8.5e-4, "kg.m2, of the flexspline"),
    "load_inertia_kgm2": (0.08, "kg.m2"),
}
"""Values of a drive of `RATED_TORQUE`, for want of better ones, in proportion to the torque."""


@dataclass(frozen=True, eq=False)
class _Test:
    """A record in SI: angles of input and output, their torques."""

    table: UnstatedTable
    time: Values
    signals: dict[str, Values]
    running: bool

    @property
    def speed(self) -> float:
        """Mean speed of the input, rad/s."""
        angle = self.signals["input_angle"]
        return float((angle[-1] - angle[0]) / (self.time[-1] - self.time[0]))

    @property
    def load(self) -> float:
        """Mean torque of the output, N.m."""
        return float(np.mean(self.signals["output_torque"]))

    @property
    def rate(self) -> float:
        """Hz."""
        # A gap in the rows does not make them slower.
        return 1.0 / float(np.median(np.diff(self.time)))


def is_bench(logs: LogFolder, roles: Roles) -> bool:
    """Tell whether logs are of a drive on a bench: both angles and both torques, at one speed each.

    Parameters
    ----------
    logs : LogFolder
    roles : Roles
    """
    if len(roles.coordinates) < 2 or len(roles.forces) < 2 or roles.time is None or logs.sources:
        return False
    if abs(roles.ratio) < _LEAST_RATIO:
        return False
    tests = _tests(logs, roles)
    steady = [test for test in tests if not test.running or _is_steady(test)]
    return len(steady) > _MOST * len(tests) and any(test.running for test in tests)


def _is_steady(test: _Test) -> bool:
    # Over a twentieth of the record, so that ripple and noise are averaged.
    angle = test.signals["input_angle"]
    part = max(1, len(angle) // 20)
    speeds = (angle[part:] - angle[:-part]) / (test.time[part:] - test.time[:-part])
    return bool(np.max(np.abs(speeds - test.speed)) < _STEADY * abs(test.speed))


def _channels(roles: Roles) -> dict[str, ColumnGuess]:
    names = ("input_angle", "output_angle", "input_torque", "output_torque")
    channels = dict(zip(names, (*roles.coordinates, *roles.forces), strict=True))
    for name in names[2:]:
        # Signs of a bench are not those of a joint: `_signs` finds them.
        options = {key: value for key, value in channels[name].options.items() if key != "scale"}
        channels[name] = replace(channels[name], options=options)
    return channels


def _signs(tests: list[_Test]) -> dict[str, float]:
    """Return the signs of the torques: what drives forward is positive, and so is what opposes it.

    From the records with most torque, in which friction is small beside the load.
    """
    running = [test for test in tests if test.running]
    work = sum(
        float(np.sign(test.speed) * np.mean(test.signals["input_torque"])) for test in running
    )
    load = sum(float(np.mean(test.signals["input_torque"])) * test.load for test in running)
    sign = -1.0 if work < 0.0 else 1.0
    return {"input_torque": sign, "output_torque": -sign if load < 0.0 else sign}


def _tests(logs: LogFolder, roles: Roles) -> list[_Test]:
    """Return the records, those with a locked input included."""
    assert roles.time is not None
    channels = _channels(roles)
    locked = {name: channels[name] for name in ("output_angle", "output_torque")}
    tests = []
    for table in (*logs.tables, *logs.others):
        there = channels if channels["input_angle"].column in table.columns else locked
        columns = [roles.time.column, *(guess.column for guess in there.values())]
        if any(name not in table.columns for name in columns):
            continue
        rows = np.all([np.isfinite(table.columns[name]) for name in columns], axis=0)
        time = table.columns[roles.time.column][rows] * roles.time.factor
        if len(time) < 2 or time[-1] <= time[0]:
            continue
        signals = {}
        for name, guess in there.items():
            # The layout of a campaign has the input as it is, not divided by the ratio.
            factor = guess.factor * (abs(_ratio(roles)) if name == "input_angle" else 1.0)
            values = table.columns[guess.column][rows] * factor
            period = logs.log.periods.get(guess.column)
            if period is not None:
                values = np.unwrap(values, period=abs(period * factor))
            signals[name] = values
        running = False
        if "input_angle" in signals:
            moved = np.ptp(signals["input_angle"]) / abs(_ratio(roles))
            running = bool(moved > _LOCKED * np.ptp(signals["output_angle"]))
        tests.append(_Test(table, time, signals, running))
    return tests


def _ratio(roles: Roles) -> float:
    return float(roles.coordinates[0].options["divided_by"])


def campaign_text(logs: LogFolder, roles: Roles) -> str:
    """Return a ``campaign.toml`` with a comment on each guess.

    Parameters
    ----------
    logs : LogFolder
    roles : Roles
        As `is_bench` has them.

    Returns
    -------
    str
        TOML. Where `read_campaign` refuses the records, a comment at the top says what it refused.
    """
    text = _text(logs, roles, "")
    refusal = _refusal(logs.folder, text)
    return text if refusal is None else _text(logs, roles, refusal)


def _refusal(folder: Path, text: str) -> str | None:
    """Return what `read_campaign` refuses, None if it reads the campaign."""
    with tempfile.TemporaryDirectory() as workshop:
        place = Path(workshop)
        for path in folder.iterdir():
            if path.is_file() and path.name != CAMPAIGN_FILE:
                (place / path.name).symlink_to(path.resolve())
        (place / CAMPAIGN_FILE).write_text(text, encoding="utf-8")
        try:
            read_campaign(place)
        except InvalidInput as error:
            complaint, *further = complaints_of(error)
            return f"{complaint}" + (f" (and {len(further)} more)" if further else "")
    return None


def _text(logs: LogFolder, roles: Roles, refusal: str) -> str:
    tests, signs = _signed(_tests(logs, roles))
    ratio = _ratio(roles)
    load = max((abs(test.load) for test in tests if test.running), default=RATED_TORQUE)
    size = load / RATED_TORQUE if load > 0.0 else 1.0
    stiffness, stiffness_said = _stiffness(tests, abs(ratio), size)
    lines = [
        *remark(
            "Drafted by pymoo-hdte init from the data files here: correct what is wrong, at least "
            f"what is marked {EDIT}. Then: pymoo-hdte discrepancy FOLDER --out FOLDER/report. "
            "After a verdict a second init proposes what to add."
        ),
        *remark(f"{EDIT}: read as it stands, it is refused: {refusal}" if refusal else ""),
        f"title = {toml_value(logs.folder.resolve().name or 'A drive')}",
        f'drive = "unknown"  # {EDIT}: its name',
        "",
        "[believed]",
        *remark(f"likely: the readings show {abs(roles.ratio):.6g}, twist included."),
        f"ratio = {abs(ratio):.12g}",
        *remark(stiffness_said),
        f"stiffness_Nm_per_rad = {stiffness:.3g}",
        *remark(
            f"{EDIT}: nothing here tells the next six. They are those of a drive of "
            f"{RATED_TORQUE:g} N.m, in proportion to the largest torque, {load:.3g} N.m; put those "
            f"of the data sheet. Without, all may be off by {100.0 * _WIDE:g} %."
        ),
        *(f"{key} = {size * value:.3g}  # {said}" for key, (value, said) in _LIKE_RATED.items()),
        *_static_error(tests, abs(ratio)),
        f"tolerance = {_WIDE:g}  # relative, of all values above; narrower as you know them better",
        f"static_error_tolerance = {_WIDE:g}",
        "",
        "[rig]",
        *remark(f"{EDIT}: the gains of the motor's speed loop, which nothing here tells."),
        f"proportional_Nms_per_rad = {0.02 * size:.2g}",
        f"integral_Nm_per_rad = {0.5 * size:.2g}",
        *_noises(tests, abs(ratio)),
        *remark(f"{EDIT}: of the transmission error from record to record, not known."),
        "repeatability_arcsec = 0.3",
        '# output_torque_at = "brake"  # if its sensor sits behind the load; by default "drive"',
        "# motor_poles = 8  # with motor_slots = 12, where both are known: lines at these cog",
        "",
        *_table(logs, roles, signs),
        *_records(logs, roles, tests),
    ]
    return "\n".join(lines) + "\n"


def _signed(tests: list[_Test]) -> tuple[list[_Test], dict[str, float]]:
    """Return records whose torques count as a campaign has them, and the signs that do it."""
    signs = _signs(tests)
    turned = [
        replace(
            test,
            signals={name: signs.get(name, 1.0) * values for name, values in test.signals.items()},
        )
        for test in tests
    ]
    return turned, signs


def _stiffness(tests: list[_Test], ratio: float, size: float) -> tuple[float, str]:
    """Return the stiffness at the output, N.m/rad, and where it comes from."""
    for test in tests:
        if not test.running:
            torque, angle = test.signals["output_torque"], test.signals["output_angle"]
            slope = abs(float(np.polyfit(angle, torque, 1)[0]))
            return slope, f"likely: slope of torque over angle in {test.table.path.name}"
    running = [test for test in tests if test.running]
    loads = np.array([test.load for test in running])
    errors = np.array(
        [
            np.mean(test.signals["input_angle"] / ratio - test.signals["output_angle"])
            for test in running
        ]
    )
    if len(running) > 2 and np.ptp(loads) > 0.0:
        slope, _ = np.polyfit(loads, errors, 1)
        scatter = float(
            np.std(errors - np.polyval([slope, errors.mean() - slope * loads.mean()], loads))
        )
        if slope > 0.0 and scatter < 0.5 * float(np.std(errors)):
            return 1.0 / float(slope), "likely: slope of the mean transmission error over the load"
    usual = RATED_STIFFNESS * size
    return usual, f"{EDIT}: nothing tells it; in proportion to the largest torque"


def _static_error(tests: list[_Test], ratio: float) -> list[str]:
    """Return lines of the static error: orders of every harmonic drive, sizes as measured."""
    orders = [1.0, 2.0, round(2.0 * (ratio + 1.0) / ratio, 4)]
    running = [test for test in tests if test.running]
    slowest = min(running, key=lambda test: abs(test.speed))
    angle = slowest.signals["input_angle"]
    error = angle / ratio - slowest.signals["output_angle"]
    phases = np.outer(angle, orders)
    time = (slowest.time - slowest.time.mean()) / np.ptp(slowest.time)
    basis = np.column_stack([np.cos(phases), np.sin(phases), np.ones_like(time), time])
    coefficients, *_ = np.linalg.lstsq(basis, error, rcond=None)
    sizes = np.hypot(coefficients[:3], coefficients[3:6]) / ARCSEC
    shown = [f"{max(size, 0.1):.3g}" for size in sizes]
    return [
        *remark(
            "likely: orders of a harmonic drive in cycles per input turn, with the sizes that "
            f"{slowest.table.path.name} shows by least squares"
        ),
        f"static_error_orders = [{', '.join(f'{order:g}' for order in orders)}]",
        f"static_error_amplitudes_arcsec = [{', '.join(shown)}]",
    ]


def _noises(tests: list[_Test], ratio: float) -> list[str]:
    running = [test for test in tests if test.running]

    def of(name: str, scale: float = 1.0, records: list[_Test] = running) -> float:
        return float(np.median([noise_of(test.signals[name]) for test in records])) / scale

    locked = [test for test in tests if not test.running]
    angle = max(of("output_angle"), of("input_angle", ratio)) / ARCSEC
    torsion = of("output_angle", records=locked) / ARCSEC if locked else angle
    torques = [of("input_torque"), of("output_torque")]
    return [
        *remark(
            "likely: from third differences of the records, one sample each; raise "
            "samples_averaged and these where rows are means of several samples"
        ),
        f"angle_noise_arcsec = {max(angle, 1e-3):.3g}",
        f"input_torque_noise_Nm = {max(torques[0], 1e-6):.3g}",
        f"output_torque_noise_Nm = {max(torques[1], 1e-6):.3g}",
        f"torsion_angle_noise_arcsec = {max(torsion, 1e-3):.3g}",
    ]


def _table(logs: LogFolder, roles: Roles, signs: Mapping[str, float]) -> list[str]:
    assert roles.time is not None
    table = logs.tables[0]
    lines = ["[table]", f"format = {toml_value(table.format)}"]
    for key in ("delimiter", "decimal"):
        if (stated := getattr(table, key)) is not None:
            lines += [f"{key} = {toml_value(stated)}"]
    lines += remark(guess_text(roles.time, "time"))
    lines += [f"time = {channel_text(roles.time)}", "[table.channels]"]
    for name, guess in _channels(roles).items():
        options = {key: value for key, value in guess.options.items() if key != "divided_by"}
        sign = float(guess.options.get("divided_by", 1.0)) if name == "input_angle" else 1.0
        if sign * signs.get(name, 1.0) < 0.0:
            options["scale"] = -1.0
        lines += remark(guess_text(guess, name))
        lines += [f"{name} = {channel_text(guess, options)}"]
    for said in roles.remarks:
        lines += remark(f"- {said}")
    return [*lines, ""]


def _records(logs: LogFolder, roles: Roles, tests: list[_Test]) -> list[str]:
    running = tuple(test.table for test in tests if test.running)
    parts = roles_of(running, logs)
    largest = max(abs(test.load) for test in tests if test.running)
    lines: list[str] = []
    for said in logs.left_out([test.table for test in tests]):
        lines += remark(said)
    for test in tests:
        load = 0.0 if abs(test.load) < _CLOSE * largest else test.load
        lines += ["[[record]]", f"file = {toml_value(test.table.path.name)}"]
        if not test.running:
            lines += [
                'test = "torsion"  # likely: the input does not move',
                'role = "train"',
                f"sample_rate_Hz = {test.rate:.6g}",
                "",
            ]
            continue
        speed = test.speed / REVOLUTION_PER_MINUTE
        lines += [
            'test = "running"',
            f"role = {toml_value(parts[test.table.path.name])}",
            f"input_speed_rpm = {_set(speed)}  # mean {speed:.6g}",
            f"load_torque_Nm = {_set(load)}  # mean {test.load:.4g}",
            f"sample_rate_Hz = {test.rate:.6g}",
            "samples_averaged = 1",
            "elapsed_s = 0  # from the start of the session, not known: no drift is sought",
            "",
        ]
    return lines[:-1]


def _set(mean: float) -> str:
    """Return the round number that was likely set, for a measured mean."""
    for digits in (1, 2):
        rounded = float(f"{mean:.{digits}g}")
        if abs(rounded - mean) < _CLOSE * abs(mean):
            return f"{rounded:g}"
    return f"{mean:.3g}"
