"""Records of millions of rows: read and fitted within the memory of blocks, with progress told."""

import subprocess
import sys

import numpy as np
import pytest
from small_campaigns import BELIEVED, small_campaign

from pymoo_hdte.discrepancy import read_campaign, write_campaign

ROWS = 100_000
GIGABYTE = 2**30
ROWS_WRITTEN_AT_ONCE = 50_000

READ_AND_FIT = """
import resource, sys
import numpy as np
from pymoo_hdte.discrepancy import order_lines, read_campaign, residual_spectrum
from pymoo_hdte.discrepancy._records.cleaning.cleaning import cleaned_rows

def peak():
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

print(peak())
campaign = read_campaign(sys.argv[1])
record, ratio = campaign.running[0], campaign.believed.ratio
lines = order_lines(record, campaign.rig, ratio, np.arange(1.0, 41.0))
residual_spectrum(record, campaign.rig, ratio, [1.0, 2.0], 0.5)
cleaned_rows(campaign, np.arange(1.0, 21.0))
print(peak(), len(record.time), abs(lines.phasors[0, 1]))
"""

READ_AND_SWEEP = """
import resource, sys
import numpy as np
from pymoo_hdte.discrepancy import read_campaign
from pymoo_hdte.discrepancy._records.cleaning.cleaning import cleaned_rows
from pymoo_hdte.discrepancy._evidence.order_lines.torsion_curve import torsion_points

def peak():
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

print(peak())
campaign, _ = cleaned_rows(read_campaign(sys.argv[1]), [1.0, 2.0, 2.04])
(record,) = campaign.torsion
points = torsion_points(record, campaign.rig)
compliance, _ = np.polyfit(points.torque, points.angle, 1, w=1.0 / points.deviation)
print(peak(), len(record.time), compliance)
"""


def write_large(folder, n_rows):
    """Write a campaign with one record of ten output turns, whose static error has one line."""
    write_campaign(small_campaign(), folder)
    toml = folder / "campaign.toml"
    head = toml.read_text().split("[[record]]")[0]
    turns, minutes = 10.0 * BELIEVED.ratio, 1.0
    rate = n_rows / (60.0 * minutes)
    toml.write_text(
        f'{head}[[record]]\nfile = "long.csv"\ntest = "running"\nrole = "train"\n'
        f"input_speed_rpm = {turns / minutes}\nload_torque_Nm = 20.0\n"
        f"sample_rate_Hz = {rate}\nsamples_averaged = 1\nelapsed_s = 0.0\n"
    )
    rng = np.random.default_rng(5)
    with (folder / "long.csv").open("w") as file:
        file.write("time_s,input_angle_rad,output_angle_rad,input_torque_Nm,output_torque_Nm\n")
        for start in range(0, n_rows, ROWS_WRITTEN_AT_ONCE):
            time = np.arange(start, min(start + ROWS_WRITTEN_AT_ONCE, n_rows)) / rate
            angle = 2.0 * np.pi * turns / 60.0 / minutes * time
            noise = rng.standard_normal((3, len(time)))
            output = angle / BELIEVED.ratio - 20.0 / BELIEVED.stiffness - 5e-5 * np.cos(2.0 * angle)
            columns = [
                *(time, angle, output + 1e-6 * noise[0]),
                *(0.45 + 1e-3 * noise[1], 20.0 + 0.05 * noise[2]),
            ]
            rows = np.column_stack(columns)
            text = "%.6f,%.12f,%.14f,%.8f,%.8f\n" * len(rows)
            file.write(text % tuple(rows.ravel().tolist()))
    return folder / "long.csv"


def write_long_sweep(folder, n_rows):
    """Write a campaign whose torsion sweep goes up, down and up again in three minutes."""
    write_campaign(small_campaign(), folder)
    rate = n_rows / 180.0
    toml, swept = folder / "campaign.toml", "sample_rate_Hz = 10"
    head, _, sweep = toml.read_text().rpartition("[[record]]")
    assert swept in sweep
    toml.write_text(f"{head}[[record]]{sweep.replace(swept, f'sample_rate_Hz = {rate}')}")
    rng = np.random.default_rng(6)
    (folder / "torsion.csv.gz").unlink()
    toml.write_text(toml.read_text().replace("torsion.csv.gz", "torsion.csv"))
    with (folder / "torsion.csv").open("w") as file:
        file.write("time_s,output_angle_rad,output_torque_Nm\n")
        for start in range(0, n_rows, ROWS_WRITTEN_AT_ONCE):
            time = np.arange(start, min(start + ROWS_WRITTEN_AT_ONCE, n_rows)) / rate
            torque = np.interp(time, [0.0, 36.0, 108.0, 180.0], [0.0, 40.0, -40.0, 40.0])
            noise = rng.standard_normal((2, len(time)))
            angle = 1e-3 - torque / BELIEVED.stiffness + 1e-6 * noise[0]
            rows = np.column_stack([time, angle, torque + 0.2 * noise[1]])
            text = "%.7f,%.12f,%.8f\n" * len(rows)
            file.write(text % tuple(rows.ravel().tolist()))
    return folder / "torsion.csv"


def peaks(folder, script=READ_AND_FIT):
    """Return the memory before and the largest of a script on a campaign, and what it found."""
    # A process begins with the peak of its parent, so that a small one has to be in between.
    shell = ["sh", "-c", '"$@"; exit $?', "sh"]
    command = [*shell, sys.executable, "-c", script, str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=True)
    before, most, n_rows, found = done.stdout.split()
    return int(before), int(most), int(n_rows), float(found)


@pytest.mark.nightly
def test_a_long_record_takes_the_memory_of_its_columns_and_of_a_block(tmp_path):
    write_large(tmp_path / "rig", ROWS)
    before, most, n_rows, line = peaks(tmp_path / "rig")
    assert line == pytest.approx(5e-5, rel=1e-2)
    assert n_rows == ROWS
    # All rows by the 82 columns of the fit, held at once and several times over, took 0.4 GB.
    assert most - before < 0.25 * GIGABYTE


@pytest.mark.nightly
def test_2500000_rows_of_150_megabytes_stay_below_a_gigabyte(tmp_path):
    file = write_large(tmp_path / "rig", 2_500_000)
    assert file.stat().st_size > 150e6
    _, most, n_rows, line = peaks(tmp_path / "rig")
    file.unlink()
    assert line == pytest.approx(5e-5, rel=1e-2)
    assert n_rows == 2_500_000
    assert most < GIGABYTE


@pytest.mark.nightly
def test_a_long_torsion_sweep_takes_the_memory_of_its_columns(tmp_path):
    write_long_sweep(tmp_path / "rig", ROWS)
    before, most, n_rows, compliance = peaks(tmp_path / "rig", READ_AND_SWEEP)
    assert n_rows == ROWS
    assert compliance == pytest.approx(1.0 / BELIEVED.stiffness, rel=1e-4)
    # Points of 24 rows, 4,166 of them with their covariance, took a gigabyte.
    assert most - before < 0.1 * GIGABYTE


@pytest.mark.nightly
def test_a_torsion_sweep_of_2500000_rows_stays_far_below_a_gigabyte(tmp_path):
    file = write_long_sweep(tmp_path / "rig", 2_500_000)
    _, most, n_rows, compliance = peaks(tmp_path / "rig", READ_AND_SWEEP)
    file.unlink()
    assert n_rows == 2_500_000
    assert compliance == pytest.approx(1.0 / BELIEVED.stiffness, rel=2e-5)
    assert most < 0.7 * GIGABYTE


def test_the_bytes_read_are_told_up_to_the_last(tmp_path):
    write_campaign(small_campaign(), tmp_path / "rig")
    told = []
    read_campaign(tmp_path / "rig", progress=lambda done, total: told.append((done, total)))
    total = sum(path.stat().st_size for path in (tmp_path / "rig").glob("*.gz"))
    assert told[-1] == (total, total)
    assert [done for done, _ in told] == sorted(done for done, _ in told)
