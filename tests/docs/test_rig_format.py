"""What the page on the files of a rig says is what is read."""

import re
import tomllib

import numpy as np
import pytest
from places import DOCS

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.discrepancy import read_rig

PAGE = (DOCS / "rig_format.md").read_text(encoding="utf-8")
(EXAMPLE,) = re.findall(r"^```toml\n(.*?)^```$", PAGE, re.M | re.S)


@pytest.fixture
def rig(tmp_path):
    """Return the folder of the example, with its logs."""
    time = np.arange(2000) / 200.0
    wave = 20.0 * np.sin(2.0 * np.pi * 0.7 * time) + 12.0
    table = np.column_stack([time, wave, np.cos(time), 0.0 * time, np.sin(time), wave])
    for name in ("slow.csv", "brake.csv"):
        np.savetxt(tmp_path / name, table, "%.6f", ",", header="t,x,u,f,s,w", comments="")
    (tmp_path / "rig.toml").write_text(EXAMPLE, encoding="utf-8")
    return tmp_path


def test_the_example_is_read(rig):
    read = read_rig(rig)
    (guide, sensor), (motor, brake) = read.mechanism.ports, read.mechanism.inputs
    assert (guide.load, sensor.read, len(sensor.error)) == ({"brake": 1.0}, True, 1)
    assert (motor.gain.value, brake.acts) == (35.15, {"axis": -1.0})
    assert read.mechanism.loops[0].limit == 10.0
    assert read.effects[0].law.level == 20.4
    slow, later = read.records
    assert (slow.name, slow.role, later.role) == ("slow half", "train", "held_out")
    # A record's own zero stands in the place of the table's.
    assert slow.channels["axis"][0] == pytest.approx((12.0 - 12.0) * 1e-3, abs=1e-6)
    assert later.channels["axis"] == pytest.approx(
        1e-3 * (20.0 * np.sin(2.0 * np.pi * 0.7 * later.time) - 0.5), abs=1e-6
    )


def test_the_page_has_every_key_that_a_reader_asks_for(rig, monkeypatch):
    asked = set()
    take, has = Fields.take, Fields.has

    def noted(kept):
        def call(self, field, *rest):
            if not self._path.split(".")[0].startswith(("guide", "coulomb")):
                asked.add(field)
            return kept(self, field, *rest)

        return call

    monkeypatch.setattr(Fields, "take", noted(take))
    monkeypatch.setattr(Fields, "has", noted(has))
    read_rig(rig)
    example = set(tomllib.loads(EXAMPLE)["coordinates"]) | {"guide", "sensor", "motor", "brake"}
    campaign = (DOCS / "campaign_format.md").read_text(encoding="utf-8")
    missing = {
        key
        for key in asked - example - {"wanted", "axis"}
        if not re.search(rf"\b{key}\b", PAGE + campaign)
    }
    # Quantities of an effect are those of its own page.
    assert missing - {"level", "phase", "torque"} == set()
