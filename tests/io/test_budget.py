"""Files that expand, lines that never end, devices: refused in little memory and time, by name."""

import gzip
import io
import os
import time
import tracemalloc
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from pymoo_hdte._io import tables, text_lines
from pymoo_hdte._io.budget import LARGEST_TOML, Budget
from pymoo_hdte._io.csv_table import read_text_table
from pymoo_hdte._io.toml import read_toml
from pymoo_hdte.checks import InvalidInput

Channel = tables.Channel
SMALL = {"BYTES": 200_000, "ROWS": 5_000, "CHARACTERS": 2_000}
MEMORY = 20_000_000
"""Bytes that may be taken while a file is read whose budget is small: a block and its copies."""


@pytest.fixture(autouse=True)
def small(monkeypatch):
    for unit, most in SMALL.items():
        monkeypatch.setenv(f"PYMOO_HDTE_MOST_{unit}", str(most))


def layout(form):
    names = (0, 1) if form == "plain" else ("t", "q")
    channels = {"q": Channel(names[1], "m")}
    return tables.TableLayout(form, channels, Channel(names[0], "s"), None, 0)


def refused(path, form, *words):
    """Check that a file is refused by name, in little memory."""
    tracemalloc.start()
    try:
        with pytest.raises(InvalidInput) as caught:
            tables.read_table(path, layout(form))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    for word in (path.name, *words):
        assert word in str(caught.value)
    assert len(str(caught.value)) < 1000
    assert peak < MEMORY


HEADER = b"t,q\n"
ROWS = b"".join(b"%d,%d\n" % (row, row) for row in range(40_000))
TEXT_BOMBS = {
    "rows": (lambda: HEADER + ROWS, "MOST_ROWS"),
    "zeros": (lambda: HEADER + bytes(50_000_000), "NUL"),
    "one line": (lambda: HEADER + b"1" * 50_000_000, "MOST_CHARACTERS"),
    "one title": (lambda: b"t" * 50_000_000, "MOST_CHARACTERS"),
    "one line among rows": (lambda: HEADER + b"0,1\n" * 100 + b"1" * 3_000 + b"\n", "line 102"),
    "blank lines": (lambda: HEADER + b"\n" * 50_000_000, "blank lines"),
    "white lines": (lambda: HEADER + b" \t \n" * 10_000_000, "blank lines"),
    "marks": (lambda: HEADER + b"," * 50_000_000, "MOST_CHARACTERS"),
    "wide rows": (
        lambda: b"t,q" + b"," * 1_000 + b"\n" + (b"0,0" + b"," * 1_000 + b"\n") * 9_999,
        "BYTES",
    ),
    "quote": (lambda: HEADER + b'"' + b"1,2\n" * 10_000_000, "t.csv"),
}
"""What makes each, so that it takes memory only in its own test, and a word of the refusal."""


@pytest.mark.parametrize("kind", TEXT_BOMBS)
@pytest.mark.parametrize("packed", [True, False])
def test_texts_that_are_too_large_are_refused(tmp_path, kind, packed):
    make, word = TEXT_BOMBS[kind]
    content = make()
    path = tmp_path / ("t.csv.gz" if packed else "t.csv")
    path.write_bytes(gzip.compress(content, 1) if packed else content)
    if len(content) > SMALL["BYTES"]:
        # Which limit is met first depends on what is read at once.
        word = "t.csv" if packed else "MOST_BYTES"
    refused(path, "csv", word)


def test_a_bomb_of_many_members_is_refused(tmp_path):
    path = tmp_path / "t.csv.gz"
    path.write_bytes(gzip.compress(HEADER) + gzip.compress(b"0,1\n" * 1_000) * 1_000)
    refused(path, "csv", "MOST_")


def matlab(path, **columns):
    scipy.io.savemat(path, columns, appendmat=False, do_compression=True)
    return path


def test_matlab_arrays_that_expand_are_refused_before_they_do(tmp_path):
    path = matlab(tmp_path / "t.mat", t=np.zeros(5_000_000), q=np.zeros(5_000_000))
    assert path.stat().st_size < SMALL["BYTES"]
    refused(path, "matlab", "MOST_ROWS")


def test_matlab_arrays_that_expand_together_are_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("PYMOO_HDTE_MOST_BYTES", "50_000")
    refused(
        matlab(tmp_path / "t.mat", t=np.zeros(4_000), q=np.zeros(4_000)), "matlab", "MOST_BYTES"
    )


def test_matlab_arrays_that_nobody_asked_for_are_not_expanded(tmp_path):
    time_ = np.arange(300) / 1000.0
    huge = {f"more{k}": np.zeros(5_000_000) for k in range(3)}
    path = matlab(tmp_path / "t.mat", a=np.zeros(5_000_000), t=time_, q=np.sin(time_), **huge)
    tracemalloc.start()
    try:
        table = tables.read_table(path, layout("matlab"))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    np.testing.assert_array_equal(table.channels["q"], np.sin(time_))
    assert peak < MEMORY


def test_a_matlab_array_that_expands_beyond_what_its_shape_says_is_refused(tmp_path):
    """A stream of zeros behind a good array: 4 MB to 4 GB in a real attack."""
    good = matlab(tmp_path / "t.mat", q=np.arange(300.0)).read_bytes()
    inner = zlib.decompress(good[136:])
    bomb = zlib.compress(inner + bytes(50_000_000))
    path = tmp_path / "t.mat"
    path.write_bytes(good[:132] + len(bomb).to_bytes(4, "little") + bomb)
    channels = {"q": Channel("q", "m")}
    tracemalloc.start()
    try:
        with pytest.raises(InvalidInput, match="intact MATLAB"):
            tables.read_table(path, tables.TableLayout("matlab", channels, None, 100.0, 0))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < MEMORY


def written(folder, form, t, q):
    """Return a file of two columns."""
    path = folder / {"npz": "t.npz", "hdf5": "t.h5", "xlsx": "t.xlsx"}.get(form, "t.jsonl")
    if form == "npz":
        np.savez_compressed(path, t=t, q=q)
    elif form == "hdf5":
        with pytest.importorskip("h5py").File(path, "w") as file:
            file.create_dataset("t", data=t, compression="gzip")
            file.create_dataset("q", data=q, compression="gzip")
    elif form == "xlsx":
        book = pytest.importorskip("openpyxl").Workbook(write_only=True)
        sheet = book.create_sheet()
        for row in (("t", "q"), *zip(t.tolist(), q.tolist(), strict=True)):
            sheet.append(row)
        book.save(path)
    elif form == "json_lines":
        lines = (f'{{"t": {a}, "q": {b}}}\n' for a, b in zip(t.tolist(), q.tolist(), strict=True))
        path.write_text("".join(lines))
    else:
        path = matlab(folder / "t.mat", t=t, q=q)
    return path


ARRAYS = ["npz", "hdf5", "xlsx", "json_lines", "matlab"]


@pytest.mark.parametrize("form", ARRAYS)
def test_rows_of_arrays_keep_the_budget_however_small_their_numbers_are(
    tmp_path, monkeypatch, form
):
    monkeypatch.setenv("PYMOO_HDTE_MOST_BYTES", str(10**9))
    rows = np.zeros(SMALL["ROWS"] + 2, np.uint8)
    refused(written(tmp_path, form, rows, rows), form, "MOST_ROWS")


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="no list of open files here")
def test_a_sheet_is_closed_while_its_refusal_is_still_held(tmp_path, monkeypatch):
    monkeypatch.setenv("PYMOO_HDTE_MOST_BYTES", str(10**9))
    rows = np.zeros(SMALL["ROWS"] + 2, np.uint8)
    path = written(tmp_path, "xlsx", rows, rows)
    with pytest.raises(InvalidInput, match="rows") as refusal:
        tables.read_table(
            path, tables.TableLayout("xlsx", {"q": Channel("q", "m")}, None, 100.0, 0)
        )
    opened = {link.resolve() for link in Path("/proc/self/fd").iterdir()}
    assert refusal.value.__traceback__ is not None
    assert path.resolve() not in opened


@pytest.mark.parametrize("form", ["npz", "hdf5", "matlab"])
def test_arrays_of_a_file_keep_the_budget_together(tmp_path, monkeypatch, form):
    path = written(tmp_path, form, np.zeros(4_000), np.zeros(4_000))
    monkeypatch.setenv("PYMOO_HDTE_MOST_BYTES", "50_000")
    refused(path, form, "MOST_BYTES")
    monkeypatch.setenv("PYMOO_HDTE_MOST_BYTES", "70_000")
    channels = {"q": Channel("q", "m")}
    read = tables.read_table(path, tables.TableLayout(form, channels, None, 100.0, 0))
    assert len(read.time) == 4_000


@pytest.mark.parametrize("rows", [5_001, 10**9, 10**18])
def test_an_array_that_states_more_than_it_holds_is_refused_before_it_is_made(tmp_path, rows):
    path = written(tmp_path, "npz", np.zeros(300), np.zeros(300))
    with zipfile.ZipFile(path) as packed:
        parts = {name: packed.read(name) for name in packed.namelist()}
    old, new = b"(300,), }", f"({rows},), }}".encode()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, part in parts.items():
            end = part.index(b"\n")
            head = part[:end].replace(old, new).rstrip().ljust(end)
            packed.writestr(name, head + part[end:])
    refused(path, "npz", "MOST_ROWS")


def test_a_chunk_that_is_larger_than_its_data_set_is_refused(tmp_path):
    """HDF5 expands whole chunks: 10 rows in one of 40 MB take 40 MB."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "t.h5"
    with h5py.File(path, "w") as file:
        for name in ("t", "q"):
            file.create_dataset(
                name, data=np.arange(300.0), maxshape=(None,), chunks=(5_000_000,),
                compression="gzip",
            )  # fmt: skip
    refused(path, "hdf5", "MOST_BYTES")


@pytest.mark.parametrize("form", ["csv", "matlab", "plain"])
@pytest.mark.parametrize("kind", ["device", "pipe"])
def test_devices_and_pipes_are_refused_at_once(tmp_path, form, kind):
    path = tmp_path / "t.dat"
    if kind == "device":
        path.symlink_to("/dev/zero")
    else:
        os.mkfifo(path)
    refused(path, form, "regular file")
    with pytest.raises(InvalidInput, match="regular file"):
        tables.check_sha256(path, "12345678")
    with pytest.raises(InvalidInput, match="regular file"):
        read_toml(path)


@pytest.mark.parametrize(
    "part", [b"\n" * 12_000, b'"x",2\n' * 12_000, b'"' + b"1,2\n" * 6_000 + b'",2\n']
)
def test_each_character_is_looked_at_once_by_each_step(tmp_path, monkeypatch, part):
    """Of blank lines, of quotes and of a cell of many blocks: each once took work by the square."""
    monkeypatch.setenv("PYMOO_HDTE_MOST_CHARACTERS", "1_000_000_000")
    monkeypatch.setenv("PYMOO_HDTE_MOST_BYTES", "1_000_000_000")
    monkeypatch.setenv("PYMOO_HDTE_MOST_ROWS", "1_000_000_000")
    monkeypatch.setattr("pymoo_hdte._io.csv_table.BLOCK", 1_000)
    path = tmp_path / "t.csv"
    path.write_bytes(HEADER + part * 2 + b"0,1\n")
    table, seen = read_text_table(path), dict.fromkeys(("_check", "_quotes", "_cut"), 0)

    def counted(name, texts_of):
        original = getattr(text_lines, name)

        def step(*arguments):
            seen[name] += sum(len(text) + 1 for text in texts_of(*arguments))
            return original(*arguments)

        monkeypatch.setattr(text_lines, name, step)

    counted("_check", lambda _path, _kind, text, _done: [text])
    counted("_quotes", lambda lines: lines)
    counted("_cut", lambda _file, _numbers, rows, _mark: rows)
    for _ in table.blocks():
        pass
    # A block counts one end of a line more than it has.
    assert max(seen.values()) <= 1.01 * path.stat().st_size


def test_a_quoted_cell_across_blocks_is_one_cell(tmp_path, monkeypatch):
    """Blocks of a few lines, cells of several: every cut between them is tried."""
    monkeypatch.setattr("pymoo_hdte._io.csv_table.BLOCK", 7)
    rows = [(f"a\n{'b' * k}\n", str(k)) for k in range(40)]
    path = tmp_path / "t.csv"
    path.write_text("t,q\n" + "".join(f'"{text}",{number}\n' for text, number in rows))
    assert [tuple(row.values()) for row in read_text_table(path).texts()] == rows


def test_a_stray_quote_in_a_long_file_is_read_as_it_stands(tmp_path, monkeypatch):
    monkeypatch.setattr("pymoo_hdte._io.csv_table.BLOCK", 1_000)
    lines = [f"{row},{row}" for row in range(4_000)]
    lines[3] = '3,3" pipe'
    path = tmp_path / "t.csv"
    path.write_text("t,q\n" + "\n".join(lines))
    read = read_text_table(path).texts()
    assert [row["t"] for row in read] == [str(row) for row in range(4_000)]
    assert read[3]["q"] == '3" pipe'


def test_too_little_memory_is_told(tmp_path, monkeypatch):
    path = tmp_path / "t.csv"
    path.write_bytes(HEADER + ROWS[:1000])

    def without_memory(*_, **__):
        raise MemoryError

    monkeypatch.setattr(np, "loadtxt", without_memory)
    refused(path, "csv", "memory")


def test_the_budget_is_set_by_the_environment_and_refuses_nonsense(tmp_path, monkeypatch):
    assert Budget.now() == Budget(*SMALL.values())
    path = tmp_path / "t.csv"
    path.write_bytes(HEADER + ROWS)
    monkeypatch.setenv("PYMOO_HDTE_MOST_ROWS", "40_001")
    monkeypatch.setenv("PYMOO_HDTE_MOST_BYTES", str(10**9))
    assert len(tables.read_table(path, layout("csv")).time) == 40_000
    for wrong in ("", "0", "-1", "1e6", "many", "\u0663", "9" * 9999):
        monkeypatch.setenv("PYMOO_HDTE_MOST_ROWS", wrong)
        if wrong.startswith("9"):
            assert Budget.now().rows > 10**18
            continue
        with pytest.raises(InvalidInput, match="PYMOO_HDTE_MOST_ROWS"):
            Budget.now()
    monkeypatch.delenv("PYMOO_HDTE_MOST_ROWS")
    assert Budget.now().rows == Budget().rows


TOML_BOMBS = {
    "long": b"a = 1\n" * (LARGEST_TOML // 6 + 1),
    "deep key": b"a." * 50_000 + b"a = 1",
    "deep key with white space": b"a \t." * 50_000 + b"a = 1",
    "deep quoted key": b"\"a\".'b'." * 50_000 + b"a = 1",
    "deep table": b"[" + b"a." * 50_000 + b"a]",
    "deep array": b"a = " + b"[" * 100_000,
    "deep inline table": b"a = " + b"{a = " * 100_000,
    "one long word": b"a" * (LARGEST_TOML - 10) + b"!",
    "many digits": b"a = 1" + b"0" * 100_000,
    "NUL": bytes(1000),
    "quotes": b"a = '" + b"\"'" * 100_000,
}


@pytest.mark.parametrize("kind", TOML_BOMBS)
def test_hostile_toml_is_refused_in_no_time(tmp_path, kind):
    path = tmp_path / "rig.toml"
    path.write_bytes(TOML_BOMBS[kind])
    begin = time.process_time()
    with pytest.raises(InvalidInput):
        read_toml(path)
    assert time.process_time() - begin < 3.0


def test_ordinary_keys_and_texts_with_dots_are_read(tmp_path):
    path = tmp_path / "rig.toml"
    dots = ".".join("abc" for _ in range(45))
    path.write_text(f'title = "{"." * 500} and {"1.5, " * 500}"\n[{dots}]\nx = 1\n')
    assert read_toml(path).names() == ("title", "abc")


def test_line_ends_of_any_kind_are_read_as_before(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_bytes(b'a = 1\r\nb = """x\r\ny"""\r\n')
    assert read_toml(path).take("b", "") == "x\ny"


def test_the_file_object_of_the_standard_library_agrees(tmp_path):
    """Rows that were packed and read are those that were written."""
    path = tmp_path / "t.csv.gz"
    path.write_bytes(gzip.compress(HEADER + ROWS[:10_000].rsplit(b"\n", 1)[0]))
    read = tables.read_table(path, layout("csv"))
    with gzip.open(path) as file:
        expected = np.loadtxt(io.BytesIO(file.read()), delimiter=",", skiprows=1)
    np.testing.assert_array_equal(read.channels["q"], expected[:, 1])
