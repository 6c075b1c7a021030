"""What identifies the source of stored outcomes."""

import pytest

from experiments.runner.committed import committed_file, read_origin
from pymoo_hdte._runner import provenance

OF_THE_PAPER = ("anytime.csv", "inference.csv", "calibration.csv")


@pytest.fixture
def source(tmp_path, monkeypatch):
    """Return what writes the one module of a package, and returns its fingerprint."""
    room = tmp_path / "drive"
    room.mkdir()
    monkeypatch.setattr(provenance.pymoo_hdte, "__file__", str(tmp_path / "__init__.py"))
    monkeypatch.setattr(provenance, "_COMPUTES", ("drive",))

    def fingerprint(text):
        (room / "law.py").write_text(text)
        return provenance.source_fingerprint.__wrapped__()

    return fingerprint


def test_only_code_counts(source):
    plain = source("x = 1\n\ndef f():\n    return x\n")
    assert plain == source(
        '"""Say."""\n\nx = 1  # why\n"""What it is."""\n\n\ndef f():\n    """Return it."""\n'
        "    return x\n"
    )
    assert plain != source("x = 2\n\ndef f():\n    return x\n")


def test_a_string_that_is_a_value_counts(source):
    assert source('x = "a"\n') != source('x = "b"\n')


@pytest.mark.parametrize("name", OF_THE_PAPER[1:])
def test_outcomes_of_the_paper_carry_one_fingerprint(name):
    first, this = (
        read_origin(committed_file(file, "anytime"))["source"] for file in (OF_THE_PAPER[0], name)
    )
    assert this == first
