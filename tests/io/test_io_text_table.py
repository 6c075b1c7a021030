"""The reader of text tables: what is read is what was written, and a fault has file and line."""

import gzip

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.io.text_table import csv_text, read_text_table, write_columns

FILES = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=50)
LETTERS = st.characters(exclude_categories=["Cs"], exclude_characters="\0\r")
# White space around a cell is not kept.
CELLS = st.text(LETTERS, max_size=8).map(str.strip)


@FILES
@given(rows=st.lists(st.tuples(CELLS, CELLS.filter(bool)), min_size=1, max_size=5))
def test_texts_with_marks_quotes_and_lines_are_read_back(rows, tmp_path):
    path = tmp_path / "texts.csv"
    path.write_text(csv_text(["one", "two"], rows), encoding="utf-8", newline="")
    assert [tuple(row.values()) for row in read_text_table(path).texts()] == rows


@FILES
@given(rows=st.lists(st.tuples(*[st.floats()] * 3), min_size=1, max_size=5))
def test_numbers_are_read_back_to_the_last_bit(rows, tmp_path):
    path = tmp_path / "numbers.csv"
    path.write_text(csv_text(["a", "b", "c"], rows))
    read = read_text_table(path).numbers(["c", "a"], gaps=True)
    np.testing.assert_array_equal(np.column_stack([read["a"], read["c"]]), np.array(rows)[:, ::2])


@pytest.mark.parametrize("mark", [",", ";"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("start", [b"", b"\xef\xbb\xbf"])
def test_every_writer_of_csv_is_understood(mark, end, start, tmp_path):
    lines = ["time_s", '"operator, shift"', "torque_Nm"], ["0", '"Ann; late"', "1.5"]
    text = end.join(mark.join(line) for line in lines) + end
    path = tmp_path / "record.csv.gz"
    path.write_bytes(gzip.compress(start + text.encode()))
    table = read_text_table(path)
    assert table.titles == ["time_s", "operator, shift", "torque_Nm"]
    assert table.texts()[0]["operator, shift"] == "Ann; late"
    assert table.numbers(["torque_Nm"])["torque_Nm"].tolist() == [1.5]


def test_a_row_below_a_cell_of_several_lines_is_named_with_its_own_line(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text('a,remark\n1,"of\ntwo lines"\nx,\n')
    with pytest.raises(InvalidInput, match=r"^record\.csv, line 4: a is 'x', allowed: a finite"):
        read_text_table(path).numbers(["a"])


def test_columns_of_numbers_are_read_beside_others(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("# by hand\n\nname,b\nx,2\n  # later\ny,3\n")
    table = read_text_table(path, by_hand=True)
    assert (table.title_line, list(table.lines)) == (3, [4, 6])
    assert table.numbers(["b"])["b"].tolist() == [2.0, 3.0]
    with pytest.raises(InvalidInput, match=r"line 3: columns is \['name', 'b'\], allowed: b, each"):
        table.require(["b"], no_others=True)


def test_equal_columns_give_equal_bytes(tmp_path):
    columns = {"t": (np.array([0.0, 0.25]), 3), "q": (np.array([1.0, -1.0]), 1)}
    for name in ("a.csv.gz", "b.csv.gz"):
        write_columns(tmp_path / name, columns)
    assert (tmp_path / "a.csv.gz").read_bytes() == (tmp_path / "b.csv.gz").read_bytes()
    read = read_text_table(tmp_path / "a.csv.gz").numbers(["q", "t"])
    assert [read["t"].tolist(), read["q"].tolist()] == [[0.0, 0.25], [1.0, -1.0]]
