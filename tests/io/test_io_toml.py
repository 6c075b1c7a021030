"""TOML: what is written is read back equal, and an error names the line it is about."""

import json
import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_hdte._io.toml import toml_text, toml_with_lines
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import hs_20_100, load_datasheet
from pymoo_hdte.drive.toml_text import sheet_toml

NAMES = st.text(min_size=1, max_size=6)
PLAIN = st.text() | st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False)
VALUES = st.recursive(
    PLAIN,
    lambda inside: st.lists(inside, max_size=3) | st.dictionaries(NAMES, inside, max_size=3),
    max_leaves=12,
)


@given(st.dictionaries(NAMES, VALUES, max_size=5))
def test_any_table_is_read_back_equal(table):
    # JSON tells apart what == does not: 1, 1.0 and true.
    read = tomllib.loads(toml_text(table))
    assert json.dumps(read, sort_keys=True) == json.dumps(table, sort_keys=True)


def test_numbers_of_numpy_are_numbers():
    table = {"whole": np.int32(3), "real": np.float32(0.5), "list": (np.float64(0.1), np.bool_(1))}
    read = tomllib.loads(toml_text(table))
    assert repr(read) == repr({"whole": 3, "real": 0.5, "list": [0.1, True]})


def read_errors(path):
    with toml_with_lines(path) as top:
        for row in top.tables("error_source"):
            row.quantity("std", "length", at_least=0.0)


def test_a_fault_in_a_written_file_is_named_with_its_line(tmp_path):
    path = tmp_path / "sheet.toml"
    lines = sheet_toml(hs_20_100()).split("\n")
    header = [at for at, line in enumerate(lines) if line == "[error_source.std]"][2]
    lines[header + 1] = "value = -1.0"
    path.write_text("\n".join(lines))
    place = rf"sheet\.toml, line {header + 2}: error_source\[2\]\.std\.value is -1"
    with pytest.raises(InvalidInput, match=place):
        read_errors(path)
    with pytest.raises(InvalidInput, match=r"error_source\[2\]\.std\.value is -1"):
        load_datasheet(path)
