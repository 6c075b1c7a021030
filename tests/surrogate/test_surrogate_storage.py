"""Saving and loading: the same bytes back, and a clear refusal of everything else."""

import json
import os

import numpy as np
import pytest

from pymoo_hdte._io import whole_file
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.surrogate import Box, ChebyshevSurrogate

BOX = Box(("theta_s", "K"), (0.1, 1 / 3), (0.3, 2 / 3))


@pytest.fixture
def surrogate():
    coefficients = np.random.default_rng(0).normal(size=(3, 4))
    return ChebyshevSurrogate(BOX, coefficients, {"model": "calibrated", "kappa": 0.055})


@pytest.fixture
def path(surrogate, tmp_path):
    path = tmp_path / "surrogate.npz"
    surrogate.save(path)
    return path


def rewrite(path, drop=(), **changes):
    """Write the file anew with some of its header entries or arrays changed."""
    with np.load(path) as arrays:
        header = json.loads(str(arrays["header"]))
        contents = {"coefficients": arrays["coefficients"]}
    contents |= {key: changes.pop(key) for key in ("header", "coefficients") if key in changes}
    kept = {key: value for key, value in (header | changes).items() if key not in drop}
    contents.setdefault("header", np.array(json.dumps(kept)))
    with path.open("wb") as file:
        np.savez(file, **{key: value for key, value in contents.items() if key not in drop})


def test_a_round_trip_returns_the_same_bytes(surrogate, path, tmp_path):
    loaded = ChebyshevSurrogate.load(path)
    assert loaded.coefficients.tobytes() == surrogate.coefficients.tobytes()
    assert loaded.box == surrogate.box
    assert loaded.provenance == {"model": "calibrated", "kappa": 0.055}
    loaded.save(tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == path.read_bytes()


def test_the_name_is_taken_as_given(surrogate, tmp_path):
    surrogate.save(str(tmp_path / "no_suffix"))
    assert [file.name for file in tmp_path.iterdir()] == ["no_suffix"]
    assert ChebyshevSurrogate.load(str(tmp_path / "no_suffix")).box == BOX


def test_a_write_that_fails_leaves_the_former_file(surrogate, path, monkeypatch):
    before = path.read_bytes()

    def fail(descriptor, content):
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(content[: len(content) // 2])
        raise OSError("disk full")

    monkeypatch.setattr(whole_file, "write_all", fail)
    with pytest.raises(OSError, match="disk full"):
        surrogate.save(path)
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


def test_the_new_file_appears_in_one_step(surrogate, path, monkeypatch):
    before = path.read_bytes()

    def fail(source, target):
        assert ChebyshevSurrogate.load(source).provenance == {}
        assert path.read_bytes() == before
        raise OSError("replaced by somebody else")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OSError, match="somebody else"):
        ChebyshevSurrogate(BOX, surrogate.coefficients).save(path)
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


def test_a_truncated_file_is_refused(path):
    whole = path.read_bytes()
    for length in [0, 1, 10, *range(20, len(whole), 97), len(whole) - 1]:
        path.write_bytes(whole[:length])
        with pytest.raises(InvalidInput, match="undamaged"):
            ChebyshevSurrogate.load(path)


def test_a_flipped_bit_is_refused_or_harmless(surrogate, path):
    whole = path.read_bytes()
    refused = 0
    for position in range(len(whole)):
        damaged = bytearray(whole)
        damaged[position] ^= 0x10
        path.write_bytes(bytes(damaged))
        try:
            loaded = ChebyshevSurrogate.load(path)
        except InvalidInput:
            refused += 1
        else:
            assert loaded.coefficients.tobytes() == surrogate.coefficients.tobytes()
            assert loaded.box == surrogate.box
            assert loaded.provenance == surrogate.provenance
    assert refused > 0.8 * len(whole)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"format": "somebody else's"}, "format of the file"),
        ({"drop": ["format"]}, "format of the file"),
        ({"version": 2}, "version of the file"),
        ({"version": "1"}, "version of the file"),
        ({"header": np.array("[1, 2]")}, "format of the file"),
        ({"header": np.array("no json")}, "path"),
        ({"drop": ["header"]}, "path"),
        ({"drop": ["coefficients"]}, "path"),
        ({"drop": ["upper"]}, "header of the file"),
        ({"drop": ["provenance"]}, "header of the file"),
        ({"upper": [0.3]}, "shape of upper"),
        ({"names": ["K", "K"]}, "names"),
        ({"names": 7}, "names"),
        ({"provenance": 7}, "provenance"),
        ({"orders": [2, 2]}, "orders of the coefficients"),
        ({"coefficients": np.ones(12)}, "shape of coefficients"),
        ({"coefficients": np.ones((3, 3))}, "orders of the coefficients"),
        ({"coefficients": np.full((3, 4), np.nan)}, "coefficients[0, 0]"),
        ({"coefficients": np.full((3, 4), None)}, "path"),
    ],
)
def test_other_contents_are_refused_by_name(path, change, field):
    rewrite(path, **change)
    with pytest.raises(InvalidInput) as caught:
        ChebyshevSurrogate.load(path)
    assert caught.value.field == field


def test_a_later_version_says_which_one_is_read(path):
    rewrite(path, version=7)
    with pytest.raises(InvalidInput, match="version of the file is 7, allowed: version 1"):
        ChebyshevSurrogate.load(path)


def test_other_kinds_of_file_are_refused(tmp_path):
    path = tmp_path / "file"
    path.write_text("theta_s,K\n1,2\n")
    with pytest.raises(InvalidInput, match="undamaged"):
        ChebyshevSurrogate.load(path)
    with path.open("wb") as file:
        np.save(file, np.ones(3))
    with pytest.raises(InvalidInput, match="undamaged"):
        ChebyshevSurrogate.load(path)
    with pytest.raises(FileNotFoundError):
        ChebyshevSurrogate.load(tmp_path / "absent")
