"""A campaign of three short records and a sweep, made without a simulation."""

import numpy as np

from pymoo_hdte.discrepancy import BelievedDrive, Campaign, Rig, RunningRecord, TorsionRecord
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

BELIEVED = BelievedDrive(
    ratio=50.0,
    stiffness=2.583e4,
    damping=4.5,
    input_inertia=1.97e-4,
    input_damping=1.7e-4,
    output_damping=5e-4,
    output_inertia=8.5e-4,
    load_inertia=0.08,
    error_orders=(1.0, 2.0, 2.04),
    error_amplitudes=(4.0 * ARCSEC, 9.0 * ARCSEC, 5.0 * ARCSEC),
)
RIG = Rig(0.02, 0.5, 0.7 * ARCSEC, 0.003, 0.2, 0.3 * ARCSEC, 0.2 * ARCSEC)


def running(name, speed_rpm, load, role, rng):
    speed = speed_rpm * REVOLUTION_PER_MINUTE
    time = np.arange(301) / 50.0
    angle = 12.0 + speed * time
    error = load / 2.6e4 + 9.0 * ARCSEC * np.sin(2.0 * angle)
    noise = rng.standard_normal((3, len(time)))
    friction = 0.05 * np.sign(speed)
    return RunningRecord(
        name=name,
        role=role,
        input_speed=speed,
        load_torque=load,
        sample_rate=50.0,
        samples_averaged=20,
        elapsed=100.0,
        time=time,
        input_angle=angle + 1e-4 * noise[0],
        output_angle=angle / 50.0 - error,
        input_torque=load / 50.0 + friction + 1e-3 * noise[1],
        output_torque=load + 0.05 * noise[2],
    )


def sweep(rng):
    torque = 40.0 * np.sin(np.linspace(0.0, 7.0, 200))
    angle = -torque / 2.6e4 + 1e-6 * rng.standard_normal(200)
    return TorsionRecord("torsion", "train", 10.0, np.arange(200) / 10.0, angle, torque)


def small_campaign() -> Campaign:
    """Return a campaign of 301 rows a record."""
    rng = np.random.default_rng(3)
    records = (
        running("slow", 500.0, 20.0, "train", rng),
        running("empty", 600.0, 0.0, "train", rng),
        running("back", -600.0, 10.0, "held_out", rng),
    )
    return Campaign("a rig", "HS-20-50", BELIEVED, RIG, records, (sweep(rng),))
