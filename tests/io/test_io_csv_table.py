"""The reader of text tables: what is read is what was written, and a fault has file and line."""

import gzip

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pymoo_hdte._io import csv_table
from pymoo_hdte._io.csv_table import csv_text, read_text_table, write_columns
from pymoo_hdte.checks import InvalidInput

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


@FILES
@given(
    rows=st.lists(st.tuples(CELLS, CELLS.filter(bool)), min_size=1, max_size=5),
    size=st.integers(1, 40),
)
def test_blocks_of_any_size_give_the_same_rows_and_lines(rows, size, tmp_path):
    path = tmp_path / "texts.csv"
    path.write_text(csv_text(["one", "two"], rows), encoding="utf-8", newline="")
    whole = read_text_table(path)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(csv_table, "BLOCK", size)
        pieces = read_text_table(path)
        assert pieces.texts() == whole.texts()
        assert list(pieces.lines) == list(whole.lines)


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_a_fault_has_its_line_in_blocks_of_any_size(size, tmp_path, monkeypatch):
    monkeypatch.setattr(csv_table, "BLOCK", size)
    path = tmp_path / "record.csv"
    for text, words in {
        b"a,b\n1,2\n3,4\n5,x\n": "line 4: b is 'x', allowed: a finite number",
        b"a,b\n1,2\n3,4\n5\n": "line 4: number of cells is 1, allowed: 2",
        b"a,b\n1,2\n\n5,6\n": "line 3: number of cells is 0|1, allowed: 2",
        b"a,b\n1,2\n3,4\n5,\x81\n": "line 4 is '5,\ufffd', allowed: CSV text in UTF-8",
    }.items():
        path.write_bytes(text)
        with pytest.raises(InvalidInput, match=words):
            read_text_table(path).numbers(["a", "b"])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        # A thousand in some countries, one with decimals in others.
        ("a;b\n1,5;2\n1.000;3\n", r"line 3: a is '1\.000', allowed: .*decimal comma"),
        ("a;b\n1.5;2\n1,000;3\n", r"line 3: a is '1,000', allowed: .*decimal point"),
        ("a;b\n1.234,5;2\n", r"line 2: a is '1\.234,5'"),
        ("a\tb\n1,5\t2\t3\n", "line 2: number of cells is 3, allowed: 2"),
        ("a,b\n1,5,2\n", "line 2: number of cells is 3, allowed: 2"),
    ],
)
def test_a_mark_of_decimals_holds_for_the_whole_file(text, words, tmp_path):
    path = tmp_path / "record.csv"
    path.write_text(text)
    with pytest.raises(InvalidInput, match=words):
        read_text_table(path, wanted=["a", "b"]).numbers(["a", "b"])


def test_titles_are_found_below_other_lines_and_missing_ones_are_shown(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("Bench, 3\n\nx;a;b\n[1];[m];[s]\n0,5;1,5;2\n0;2;3\n")
    table = read_text_table(path, wanted=["b", "a"])
    assert (table.title_line, table.units["a"], list(table.lines)) == (3, "[m]", [5, 6])
    assert table.numbers(["a"])["a"].tolist() == [1.5, 2.0]
    missing = read_text_table(path, wanted=["a", "c"])
    with pytest.raises(InvalidInput, match=r"line 3: columns is \['x', 'a', 'b'\], allowed: a, c"):
        missing.numbers(["a", "c"])
