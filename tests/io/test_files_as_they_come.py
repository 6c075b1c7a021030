"""One table in every encoding and format gives the same numbers, in any spelling of its units."""

import json
import math
import zipfile

import numpy as np
import pytest

from pymoo_hdte._io import array_files, ros_logs
from pymoo_hdte._io.encodings import decoded
from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.layout import Channel, TableLayout, layout_from_fields
from pymoo_hdte._io.tables import read_table
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.units import FOREIGN, UNITS, suggestion, usual_spelling

TIME = np.arange(400) * 1e-3
WAVE = np.sin(9.0 * TIME)
TITLES = "Zeit", "Weg µm"


def layout(form="csv", columns=TITLES, **options):
    time, wave = (Channel(column, unit) for column, unit in zip(columns, "sm", strict=True))
    return TableLayout(form, {"q": wave}, time, None, 0, **options)


def reads_the_wave(path, table_layout):
    table = read_table(path, table_layout)
    # Sheets hold 16 digits.
    np.testing.assert_allclose(table.time, TIME, rtol=1e-15)
    np.testing.assert_allclose(table.channels["q"], WAVE, rtol=1e-15)


def text(title="Prüfstand für Öl\n", titles=True, mark=";"):
    rows = [f"{t!r}{mark}{q!r}" for t, q in zip(TIME.tolist(), WAVE.tolist(), strict=True)]
    return title + (f"{mark.join(TITLES)}\n" if titles else "") + "\n".join(rows) + "\n"


@pytest.mark.parametrize("stated", [True, False])
@pytest.mark.parametrize(
    "code", ["utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le", "utf-16-be"]
)
def test_every_encoding_gives_the_same_numbers(code, stated, tmp_path):
    (tmp_path / "a.csv").write_bytes(text().encode(code))
    name = "cp1252" if code == "cp1252" else code[:6].rstrip("-")
    options = {"encoding": "utf-8" if name.startswith("utf-8") else name} if stated else {}
    reads_the_wave(tmp_path / "a.csv", layout(**options))


def test_an_umlaut_far_below_is_read_as_well(tmp_path):
    remarks = [";Öl" if row % 300 == 299 else ";" for row in range(400)]
    head, *rows = text("").splitlines()
    lines = [f"{head};Ort", *map("".join, zip(rows, remarks, strict=True))]
    (tmp_path / "a.csv").write_bytes("\n".join(lines).encode("cp1252"))
    reads_the_wave(tmp_path / "a.csv", layout())


def test_a_toml_text_in_any_encoding_is_the_same():
    words = 'title = "Prüfstand"\n'
    for code in ("utf-8", "utf-8-sig", "cp1252", "utf-16"):
        assert decoded(words.encode(code)) == words
    with pytest.raises(ValueError, match="surrogates"):
        decoded(b"\x81")


@pytest.mark.parametrize("head", ["", "Bench 3\n", "Bench, 3\n\n"])
@pytest.mark.parametrize("titles", [True, False])
def test_columns_of_csv_are_called_by_numbers(head, titles, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(text(head, titles), encoding="utf-8")
    reads_the_wave(path, layout(columns=(0, 1)))
    with pytest.raises(InvalidInput, match="column 7"):
        read_table(path, layout(columns=(0, 7)))
    fields = {"format": "csv", "time": {"column": 0, "unit": "s"}}
    fields["channels"] = {"q": {"column": 1, "unit": "m"}}
    reads_the_wave(path, layout_from_fields(Fields(fields, "a.toml")))


def write(path, form):
    if form == "json_lines":
        rows = zip(TIME.tolist(), WAVE.tolist(), strict=True)
        path.write_text("\n".join(json.dumps(dict(zip(TITLES, row, strict=True))) for row in rows))
    elif form == "npz":
        np.savez_compressed(path, **dict(zip(TITLES, (TIME, WAVE[None, :]), strict=True)))
    elif form in ("hdf5", "matlab"):
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w", userblock_size=512 if form == "matlab" else 0) as file:
            file[TITLES[0]], file[TITLES[1]] = TIME[None, :], WAVE[:, None]
    else:
        openpyxl = pytest.importorskip("openpyxl")
        book = openpyxl.Workbook()
        for row in (["Prüfstand"], TITLES, ["s", "m"], *zip(TIME, WAVE, strict=True)):
            book.active.append([x.item() if isinstance(x, np.generic) else x for x in row])
        book.save(path)


ENDINGS = {
    # Logs of ROS have columns of their own: test_ros_logs.
    form: endings[0]
    for form, (endings, _) in array_files.READERS.items()
    if form not in ros_logs.ENDINGS
}


@pytest.mark.parametrize("form", ENDINGS)
def test_every_format_of_arrays_gives_the_same_numbers(form, tmp_path):
    path = tmp_path / f"a{ENDINGS[form]}"
    write(path, form)
    for stated in (form, "csv"):
        reads_the_wave(path, layout(stated))
    with pytest.raises(InvalidInput, match="a speed"):
        read_table(path, layout(form, (TITLES[0], "a speed")))


@pytest.mark.parametrize("form", ENDINGS)
def test_a_damaged_file_of_arrays_is_refused(form, tmp_path):
    path = tmp_path / f"a{ENDINGS[form]}"
    write(path, form)
    whole, rng = path.read_bytes(), np.random.default_rng(3)
    for content in (b"", b"\0", whole[: len(whole) // 2], rng.bytes(3000)):
        path.write_bytes(content)
        with pytest.raises(InvalidInput, match=path.name):
            read_table(path, layout(form))


@pytest.mark.parametrize(("form", "name"), [("xlsx", "openpyxl"), ("hdf5", "h5py")])
def test_without_its_library_a_file_is_refused_with_the_extra(form, name, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, name, None)
    path = tmp_path / f"a{ENDINGS[form]}"
    path.write_bytes(b"PK")
    with pytest.raises(InvalidInput, match=r"pip install .pymoo-hdte\[formats\]"):
        read_table(path, layout(form))


def test_an_archive_that_expands_is_refused_before_it_does(tmp_path, monkeypatch):
    monkeypatch.setenv("PYMOO_HDTE_MOST_BYTES", "1000000")
    path = tmp_path / "a.npz"
    np.savez_compressed(path, **dict.fromkeys(TITLES, np.zeros(10**6)))
    assert path.stat().st_size < 10**5
    with pytest.raises(InvalidInput, match="PYMOO_HDTE_MOST_BYTES"):
        read_table(path, layout("npz"))
    with zipfile.ZipFile(tmp_path / "a.xlsx", "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("xl/worksheets/sheet1.xml", bytes(10**7))
    pytest.importorskip("openpyxl")
    with pytest.raises(InvalidInput, match="PYMOO_HDTE_MOST_BYTES"):
        read_table(tmp_path / "a.xlsx", layout("xlsx"))


def test_pickled_objects_are_not_loaded(tmp_path):
    np.savez(tmp_path / "a.npz", **dict.fromkeys(TITLES, np.array([{}] * 400, dtype=object)))
    with pytest.raises(InvalidInput, match="npz"):
        read_table(tmp_path / "a.npz", layout("npz"))


@pytest.mark.parametrize(
    ("written", "unit"),
    [
        *(("Nm", "N.m"), ("N·m", "N.m"), ("N m", "N.m"), ("mNm", "mN.m"), ("Nmm", "N.mm")),
        *(("°", "deg"), ("[°]", "deg"), ("µm", "um"), ("μm", "um"), ("°C", "C"), ("1/min", "rpm")),
    ],
)
def test_spellings_of_a_unit(written, unit):
    assert usual_spelling(written) == unit
    channel = {"column": "a", "unit": written}
    table = {"sample_rate": 10.0, "channels": {"q": channel}}
    assert layout_from_fields(Fields(table, "a.toml")).channels["q"] == Channel("a", unit)


def test_a_spelling_of_this_package_stays_what_it_is():
    for units in UNITS.values():
        assert all(usual_spelling(unit) == unit for unit in units)


def test_another_unit_is_told_with_its_factor():
    known = {unit: size for units in UNITS.values() for unit, size in units.items()}
    for unit, (base, factor, _) in FOREIGN.items():
        words = suggestion(unit, [base])
        assert f'unit = "{base}"' in words
        assert math.isclose(float(words.split("= ")[-1]), factor, rel_tol=1e-5)
    # One pound-force at the end of one foot.
    foot_pound = FOREIGN["lbf.ft"][1] * known["N.m"]
    assert math.isclose(foot_pound, 0.45359237 * 9.80665 * 0.3048, rel_tol=1e-15)
    assert "'N.m'" in suggestion("nM", ["N.m", "mN.m"])


def test_a_comma_of_decimals_separates_no_numbered_columns(tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"{0.01 * i:.2f};{i + 0.5}".replace(".", ",") for i in range(40)]
    path.write_text("\n".join(rows) + "\n")
    layout = TableLayout("csv", {"q": Channel(1, "m")}, Channel(0, "s"), None, 0, decimal="comma")
    table = read_table(path, layout)
    np.testing.assert_allclose(table.channels["q"], np.arange(40) + 0.5)


def test_a_row_of_units_in_another_spelling_is_held_against_the_layout(tmp_path):
    path = tmp_path / "a.csv"
    rows = "\n".join(f"{0.01 * i},{i}" for i in range(40))
    path.write_text(f"t,u\n[s],[mNm]\n{rows}\n")
    layout = TableLayout("csv", {"u": Channel("u", "N.m")}, Channel("t", "s"), None, 0)
    with pytest.raises(InvalidInput, match="unit of u"):
        read_table(path, layout)


def test_a_sheet_is_read_to_its_end_whatever_it_says_of_its_size(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    path, small = tmp_path / "a.xlsx", tmp_path / "b.xlsx"
    book = openpyxl.Workbook()
    for row in [("t", "q"), *((0.01 * i, float(i)) for i in range(50))]:
        book.active.append(row)
    book.save(path)
    with zipfile.ZipFile(path) as whole, zipfile.ZipFile(small, "w") as cut:
        for name in whole.namelist():
            text = whole.read(name)
            cut.writestr(name, text.replace(b'ref="A1:B51"', b'ref="A1:B20"'))
    layout = TableLayout("xlsx", {"q": Channel("q", "m")}, Channel("t", "s"), None, 0)
    assert len(read_table(small, layout).time) == 50


@pytest.mark.parametrize("ending", ["npz", "xlsx"])
def test_damaged_bytes_of_a_packed_file_are_refused_or_read(ending, tmp_path):
    path = tmp_path / f"a.{ending}"
    columns = {"t": 0.01 * np.arange(60), "q": np.sin(np.arange(60.0))}
    if ending == "npz":
        np.savez_compressed(path, **columns)
    else:
        book = pytest.importorskip("openpyxl").Workbook()
        for row in [tuple(columns), *zip(*(one.tolist() for one in columns.values()), strict=True)]:
            book.active.append(row)
        book.save(path)
    content, rng = path.read_bytes(), np.random.default_rng(1)
    layout = TableLayout(ending, {"q": Channel("q", "m")}, Channel("t", "s"), None, 0)
    refused = 0
    for _ in range(60):
        damaged = bytearray(content)
        for at in rng.integers(len(content), size=3):
            damaged[at] = rng.integers(256)
        path.write_bytes(damaged)
        try:
            read_table(path, layout)
        except InvalidInput:
            refused += 1
    assert refused > 0
