"""A campaign to try ``pymoo-hdte discrepancy`` on: a virtual rig whose motor torque ripples.

    python docs/examples/virtual_campaign.py FOLDER

FOLDER must be new or empty. The nominal drive has no ripple, and its parameters are off within
their tolerances, as those of a real one are. The script needs a copy of the whole repository, since
the rig belongs to its experiments and not to the package.
"""

import sys
from pathlib import Path

import numpy as np

from pymoo_hdte.discrepancy import BelievedDrive, Rig, write_campaign
from pymoo_hdte.units import ARCSEC

# Python looks for modules in the folder of this script, not in that of the repository.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from experiments.studies.virtual_rig.rig import draw_rig, run_campaign, torque_ripple

BELIEVED = BelievedDrive(
    ratio=101.0,
    stiffness=2.6e4,  # N.m/rad
    damping=4.5,  # N.m.s/rad
    input_inertia=2.0e-4,  # kg.m2
    input_damping=1.7e-4,  # N.m.s/rad
    output_damping=5.0e-4,  # N.m.s/rad
    output_inertia=8.5e-4,  # kg.m2
    load_inertia=0.08,  # kg.m2
    error_orders=(1.0, 2.0, 2.02),  # cycles per input turn
    error_amplitudes=(4.0 * ARCSEC, 9.0 * ARCSEC, 5.0 * ARCSEC),
)
RIG = Rig(
    proportional=0.02,  # speed loop of the motor, N.m.s/rad
    integral=0.5,  # N.m/rad
    angle_noise=0.7 * ARCSEC,
    input_torque_noise=0.003,  # N.m
    output_torque_noise=0.2,  # N.m
    repeatability=0.3 * ARCSEC,
    torsion_angle_noise=0.2 * ARCSEC,
)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: virtual_campaign.py FOLDER")
    folder = Path(sys.argv[1])
    if folder.exists() and any(folder.iterdir()):
        sys.exit(f"{folder} is not empty")
    rng = np.random.default_rng(1)
    hidden = torque_ripple(rng)
    campaign = run_campaign(draw_rig(BELIEVED, (hidden,), rng), BELIEVED, RIG, rng)
    write_campaign(campaign, folder)
    ripple, order = (hidden.parameters[name] for name in ("ripple", "ripple_order"))
    number = len(campaign.running)
    print(f"{folder}: {number} records; hidden: a ripple of {ripple:.5f} N.m, order {order:g}")
