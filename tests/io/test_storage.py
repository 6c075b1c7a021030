"""Stored files of old releases, and hostile files: refused by InvalidInput at low cost."""

import io
import json
import os
import struct
import tracemalloc
import zipfile
from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from places import DOCS, STORED

from pymoo_hdte._io.archive import DEEPEST_HEADER, LARGEST_FILE, LARGEST_HEADER, FileFormat
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.problems import SimulatorProblem
from pymoo_hdte.problems._simulator.stored import FORMAT as PROBLEM
from pymoo_hdte.surrogate import ChebyshevSurrogate

KINDS = {
    "surrogate": (ChebyshevSurrogate, STORED / "surrogate_version_1.npz"),
    "drive model": (DriveModel, STORED / "drive_model_version_1.npz"),
    "robust problem": (SimulatorProblem, STORED / "robust_problem_version_1.npz"),
}
MEMBERS = {"surrogate": {"coefficients"}, "drive": set(), "robust": set(PROBLEM.arrays)}
AT_NIGHT = [
    pytest.param(kind, marks=pytest.mark.nightly) if kind == "robust problem" else kind
    for kind in KINDS
]
"""tests/problems/simulator/test_stored_problem.py has short ones for the third kind."""
SURROGATE = KINDS["surrogate"][1].read_bytes()
fuzz = settings(
    max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)


@pytest.fixture(params=AT_NIGHT)
def kind(request):
    return KINDS[request.param]


@contextmanager
def little_memory(limit=3 * LARGEST_FILE):
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] < limit
    finally:
        tracemalloc.stop()


def refused(load, path, message=""):
    """Check that a file is refused, by the right exception and with little memory."""
    with little_memory(), pytest.raises(InvalidInput, match=message):
        load(path)


def npy(array):
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


def archive(members, compression=zipfile.ZIP_STORED):
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", compression) as file:
        for name, *data in members:
            file.writestr(name, *data)
    return stream.getvalue()


def members_of(contents):
    with zipfile.ZipFile(io.BytesIO(contents)) as file:
        return {entry.filename: file.read(entry) for entry in file.infolist()}


def header_of(contents):
    return json.loads(str(np.load(io.BytesIO(members_of(contents)["header.npy"]))))


def with_members(contents, **changes):
    """Return the file with members replaced, or, by None, left out."""
    members = members_of(contents) | {f"{name}.npy": data for name, data in changes.items()}
    return archive((name, data) for name, data in members.items() if data is not None)


def with_header(contents, text):
    return with_members(contents, header=npy(np.array(text)))


def array_claiming(shape, dtype="'<f8'", data=b"\0" * 96, version=1):
    text = f"{{'descr': {dtype}, 'fortran_order': False, 'shape': {shape}}}\n".encode()
    return b"\x93NUMPY" + bytes([version, 0]) + struct.pack("<H", len(text)) + text + data


# --- years later ------------------------------------------------------------------------------


def test_a_surrogate_of_version_1_still_gives_its_numbers():
    """Saved by the first release; values by hand at the box's centre, where T_n is 1, 0, -1, 0."""
    loaded = ChebyshevSurrogate.load(KINDS["surrogate"][1])
    assert loaded.box.names == ("K", "J_in")
    assert loaded.box.lower.tolist() == [0.1, 1 / 3]
    assert loaded.box.upper.tolist() == [0.3, 2 / 3]
    expected = 1.0 / (1.0 + np.arange(12.0).reshape(3, 4))
    assert loaded.coefficients.tobytes() == expected.tobytes()
    assert loaded.provenance == {"model": "a sample", "kappa": 0.055}
    centre = 1.0 - 1 / 3 - 1 / 9 + 1 / 11
    assert loaded([[0.2, 0.5]]) == pytest.approx([centre], rel=1e-12)
    assert loaded([[0.15, 0.4]]) == pytest.approx([0.7003383838383839], rel=1e-12)


def test_what_is_saved_today_is_what_was_saved_then(kind, tmp_path):
    thing, stored = kind
    thing.load(stored).save(tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == stored.read_bytes()


def test_a_file_is_read_by_numpy_alone(kind):
    _, stored = kind
    with np.load(stored, allow_pickle=False) as arrays:
        header = json.loads(str(arrays["header"]))
        assert header["version"] == 1
        assert set(arrays) - {"header"} == MEMBERS[stored.stem.partition("_")[0]]


def test_the_documented_reading_by_numpy_gives_the_surrogate_s_value(tmp_path, monkeypatch, capsys):
    document = DOCS / "file_format.md"
    snippet = document.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
    (tmp_path / "surrogate.npz").write_bytes(SURROGATE)
    monkeypatch.chdir(tmp_path)
    exec(compile(snippet, str(document), "exec"), {})
    surrogate = ChebyshevSurrogate.load("surrogate.npz")
    point = surrogate.box.lower + 0.3 * (surrogate.box.upper - surrogate.box.lower)
    assert float(capsys.readouterr().out) == pytest.approx(surrogate([point])[0], rel=1e-12)


def test_earlier_versions_are_read_and_later_ones_named(tmp_path):
    first, second = (FileFormat("a test", version, ("size",)) for version in (1, 2))
    first.write(tmp_path / "first", {"size": 1})
    second.write(tmp_path / "second", {"size": 2})
    assert second.read(tmp_path / "first") == ({"size": 1}, {})
    with pytest.raises(InvalidInput, match="version of the file is 2, allowed: version 1"):
        first.read(tmp_path / "second")


def test_one_kind_is_not_taken_for_another():
    with pytest.raises(InvalidInput, match="format of the file is 'pymoo_hdte drive model'"):
        ChebyshevSurrogate.load(KINDS["drive model"][1])
    with pytest.raises(InvalidInput, match="format of the file is 'pymoo_hdte Chebyshev"):
        DriveModel.load(KINDS["surrogate"][1])


# --- no file, or no ordinary one --------------------------------------------------------------


def test_folders_pipes_and_devices_are_not_read(kind, tmp_path):
    load = kind[0].load
    refused(load, tmp_path, "a regular file")
    refused(load, "/dev/zero", "a regular file")
    os.mkfifo(tmp_path / "pipe")
    refused(load, tmp_path / "pipe", "a regular file")
    with pytest.raises(FileNotFoundError):
        load(tmp_path / "absent")


def test_a_huge_file_is_not_read(kind, tmp_path):
    path = tmp_path / "huge"
    with path.open("wb") as file:
        file.truncate(2**40)
    refused(kind[0].load, path, "size of the file is 1099511627776")


@pytest.mark.parametrize("more", [0, 1])
def test_a_file_of_the_largest_size_is_read_and_no_larger_one(more, tmp_path):
    path, form = tmp_path / "large", FileFormat("a test", 1, ("text",), ("numbers",))

    def written(characters, numbers):
        form.write(path, {"text": " " * characters}, numbers=np.zeros(numbers))
        return path.stat().st_size

    # A number takes eight bytes and a character four, beside what does not change.
    count, odd = divmod(LARGEST_FILE - written(10, 400_000), 8)
    count += 400_000
    if more:
        with pytest.raises(InvalidInput, match=f"at most {LARGEST_FILE} bytes"):
            written(10 + odd // 4, count + 1)
    else:
        assert written(10 + odd // 4, count) == LARGEST_FILE
        assert form.read(path)[1]["numbers"].shape == (count,)


# --- archives ---------------------------------------------------------------------------------

HEADER = members_of(SURROGATE)["header.npy"]
NUMBERS = members_of(SURROGATE)["coefficients.npy"]
BOMB = b"\0" * (4 * LARGEST_FILE)


def stating(contents, size):
    """Return a zip file whose directory states another size of its last member."""
    at = contents.rindex(b"PK\1\2") + 20
    return contents[:at] + struct.pack("<LL", size, size) + contents[at + 8 :]


def end_of_directory(size, comment=0):
    return b"PK\5\6" + struct.pack("<4H2LH", 0, 0, 1, 1, size, 0, comment)


def end_of_zip64(directory):
    """Return a zip file whose large directory the plain last record denies."""
    record = b"PK\6\6" + struct.pack("<Q2H2L4Q", 44, 45, 45, 0, 0, 1, 1, len(directory), 0)
    locator = b"PK\6\7" + struct.pack("<LQL", 0, len(directory), 1)
    return directory + record + locator + end_of_directory(len(ENTRY))


ENTRY = b"PK\1\2" + struct.pack("<4B4HL2L5H2L", *[20, 3, 20, 0] + [0] * 7 + [1] + [0] * 6) + b"a"
CROWD = ENTRY * 80_000
STORED_AND_NOT = [("header.npy", HEADER, zipfile.ZIP_STORED), ("coefficients.npy", NUMBERS, 8)]
BARE = [(name.removesuffix(".npy"), data) for name, data in members_of(SURROGATE).items()]
WHOLE = list(members_of(SURROGATE).items())

ARCHIVES = {
    "nothing": (b"", "unpack requires"),
    "a text": (b"theta_s,K\n1,2\n" * 10, "does not end as"),
    "an array": (npy(np.ones(100)), "does not end as"),
    "an empty archive": (archive([]), "'header'"),
    "a bomb": (archive([("header.npy", HEADER), ("x.npy", BOMB)], 8), "is compressed"),
    "bzip2": (archive(WHOLE, zipfile.ZIP_BZIP2), "is compressed"),
    "one compressed member": (archive(STORED_AND_NOT), "'coefficients.npy' is compressed"),
    "a size beyond the file": (stating(SURROGATE, 2**31), ""),
    "a size of zip64": (stating(SURROGATE, 2**32 - 1), ""),
    "a member that takes in the next": (stating(SURROGATE, 300), ""),
    "many members": (CROWD + end_of_directory(len(CROWD)), "too many members"),
    "many members by zip64": (end_of_zip64(CROWD), "does not end as"),
    "a comment": (SURROGATE[:-2] + b"\3\0hi!", "does not end as"),
    "a directory before the file": (SURROGATE[:-10] + b"\xff\x0f" + SURROGATE[-8:], ""),
    "another member": (archive([*WHOLE, ("more.npy", NUMBERS)]), "its arrays are"),
    "a member elsewhere": (archive([*WHOLE, ("../../x.npy", NUMBERS)]), "its arrays are"),
    "a member that is no array": (archive([*WHOLE, ("run.py", b"1")]), "or no array"),
    "arrays of other names": (archive(BARE), "or no array"),
    "no header": (with_members(SURROGATE, header=None), "'header'"),
    "no coefficients": (with_members(SURROGATE, coefficients=None), "its arrays are"),
}


@pytest.mark.parametrize("name", ARCHIVES)
def test_other_archives_are_refused(name, tmp_path):
    contents, reason = ARCHIVES[name]
    (tmp_path / "file").write_bytes(contents)
    refused(ChebyshevSurrogate.load, tmp_path / "file", f"undamaged file.*{reason}")


def test_a_member_twice_is_refused(tmp_path):
    with pytest.warns(UserWarning, match="Duplicate name"):
        twice = archive([*members_of(SURROGATE).items(), ("header.npy", HEADER)])
    (tmp_path / "file").write_bytes(twice)
    refused(ChebyshevSurrogate.load, tmp_path / "file", "'header.npy' is there twice")


# --- arrays -----------------------------------------------------------------------------------

ARRAYS = {
    "pickled objects": npy(np.full((3, 4), None)),
    "a pickled object that acts": npy(np.array([[os.system]], dtype=object)),
    "single precision": npy(np.ones((3, 4), dtype=np.float32)),
    "big-endian": npy(np.ones((3, 4), dtype=">f8")),
    "whole numbers": npy(np.ones((3, 4), dtype=np.int64)),
    "complex": npy(np.ones((3, 4), dtype=complex)),
    "words": npy(np.array([["a"] * 4] * 3)),
    "records": npy(np.zeros((3, 4), dtype=[("a", "<f8")])),
    "dates": npy(np.zeros((3, 4), dtype="<M8[s]")),
    "more numbers than there are": array_claiming((10**12, 10**6)),
    "fewer numbers than there are": array_claiming((3, 3)),
    "negative lengths": array_claiming((-3, -4)),
    "a length to be guessed": array_claiming((-1, 4)),
    "lengths that are no numbers": array_claiming(("3", 4)),
    "lengths of other types": array_claiming((3.0, 4)),
    "a type of huge size": array_claiming((), dtype="'V99999999999'"),
    "no type": array_claiming((3, 4), dtype="'nonsense'"),
    "code for a type": array_claiming((3, 4), dtype="__import__('os')"),
    "many axes": array_claiming((1,) * 40 + (12,)),
    "a deep array header": array_claiming((3, 4), dtype="(" * 3000 + ")" * 3000),
    "a later array format": array_claiming((3, 4), version=2),
    "half an array": NUMBERS[: len(NUMBERS) // 2],
    "an empty member": b"",
}


@pytest.mark.parametrize("name", ARRAYS)
def test_other_arrays_are_refused(name, tmp_path):
    (tmp_path / "file").write_bytes(with_members(SURROGATE, coefficients=ARRAYS[name]))
    refused(ChebyshevSurrogate.load, tmp_path / "file", "undamaged file")


@pytest.mark.parametrize(
    ("coefficients", "field"),
    [
        (np.full((3, 4), np.nan), r"coefficients\[0, 0\]"),
        (np.array([[0.0] * 4, [0.0] * 4, [0.0, 0.0, -np.inf, 0.0]]), r"coefficients\[2, 2\]"),
        (np.full((3, 4), 1e308), "largest coefficient"),
        (np.ones((4, 3)), "orders of the coefficients"),
        (np.ones((3, 4, 1)), "shape of coefficients"),
        (np.ones((3, 0)), "orders of the coefficients"),
        (np.ones(()), "shape of coefficients"),
    ],
)
def test_coefficients_of_no_surrogate_are_refused(coefficients, field, tmp_path):
    (tmp_path / "file").write_bytes(with_members(SURROGATE, coefficients=npy(coefficients)))
    refused(ChebyshevSurrogate.load, tmp_path / "file", f"^({field}|shape of {field}) ")


def test_fortran_s_order_of_memory_is_kept(tmp_path):
    loaded = ChebyshevSurrogate.load(KINDS["surrogate"][1])
    turned = ChebyshevSurrogate(loaded.box, np.asfortranarray(loaded.coefficients))
    turned.save(tmp_path / "file")
    assert np.array_equal(
        ChebyshevSurrogate.load(tmp_path / "file").coefficients, loaded.coefficients
    )


# --- headers ----------------------------------------------------------------------------------


def header_text(contents, **changes):
    return json.dumps(header_of(contents) | changes)


@pytest.mark.parametrize(
    "text",
    ["", "{", "\x00", "no JSON", "[" * 100_000, '{"a":' * 5000 + "1" + "}" * 5000],
)
def test_headers_that_are_no_json_are_refused(kind, text, tmp_path):
    thing, stored = kind
    (tmp_path / "file").write_bytes(with_header(stored.read_bytes(), text))
    refused(thing.load, tmp_path / "file", "undamaged file")


@pytest.mark.parametrize("text", ["null", "[1, 2]", '"words"', "{}", '{"format": 7}'])
def test_headers_of_no_format_are_refused(kind, text, tmp_path):
    thing, stored = kind
    (tmp_path / "file").write_bytes(with_header(stored.read_bytes(), text))
    refused(thing.load, tmp_path / "file", "format of the file")


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ("NaN", "NaN is not finite"),
        ("-Infinity", "-Infinity is not finite"),
        ("1e999", "1e999 is not finite"),
        ("9" * 400, "9{20} is not finite"),
        ("9" * 5000, "9{20} is not finite"),
        ('1, "kappa": 1', "a field is there twice"),
        ("[" * DEEPEST_HEADER + "]" * DEEPEST_HEADER, "nested deeper"),
        ('"%s"' % (" " * LARGEST_HEADER), "no text of at most"),
    ],
)
def test_the_rest_of_a_header_does_not_hide_what_is_no_value(value, reason, tmp_path):
    text = header_text(SURROGATE).replace('"kappa": 0.055', f'"kappa": {value}')
    (tmp_path / "file").write_bytes(with_header(SURROGATE, text))
    refused(ChebyshevSurrogate.load, tmp_path / "file", f"undamaged file.*{reason}")


def test_a_header_as_deep_as_allowed_is_read(tmp_path):
    value = "[" * (DEEPEST_HEADER - 2) + "]" * (DEEPEST_HEADER - 2)
    text = header_text(SURROGATE).replace("0.055", value)
    (tmp_path / "file").write_bytes(with_header(SURROGATE, text))
    ChebyshevSurrogate.load(tmp_path / "file").save(tmp_path / "again")
    deeper = {"kappa": [json.loads(value)]}
    loaded = ChebyshevSurrogate.load(tmp_path / "again")
    with pytest.raises(InvalidInput, match="nested deeper"):
        ChebyshevSurrogate(loaded.box, loaded.coefficients, deeper).save(tmp_path / "again")


def texts_claiming(*codes, dtype=None):
    data = struct.pack(f"<{len(codes)}L", *codes)
    return array_claiming((), dtype=dtype or f"'<U{len(codes)}'", data=data)


@pytest.mark.parametrize(
    "header",
    [
        npy(np.array(b"{}")),
        npy(np.frombuffer(b"{}", np.uint8)),
        npy(np.array(["{}"])),
        npy(np.array(1.0)),
        texts_claiming(0x110000, 0x7D),
        texts_claiming(0xD800, 0x7D),
        texts_claiming(0xFFFFFFFF),
        texts_claiming(0x7B, 0x7D, dtype="'<U2000000000'"),
        texts_claiming(0x7B, 0x7D, dtype="'>U2'"),
    ],
)
def test_headers_that_are_no_text_are_refused(kind, header, tmp_path):
    thing, stored = kind
    (tmp_path / "file").write_bytes(with_members(stored.read_bytes(), header=header))
    refused(thing.load, tmp_path / "file", "undamaged file")


@pytest.mark.parametrize("version", [0, 2, 10**30, -1, True, 1.0, "1", None, [1]])
def test_other_versions_are_refused(kind, version, tmp_path):
    thing, stored = kind
    contents = stored.read_bytes()
    (tmp_path / "file").write_bytes(with_header(contents, header_text(contents, version=version)))
    refused(thing.load, tmp_path / "file", "version of the file")


def test_fields_more_or_less_are_refused(kind, tmp_path):
    thing, stored = kind
    contents = stored.read_bytes()
    for name in set(header_of(contents)) - {"format", "version"}:
        fewer = {key: value for key, value in header_of(contents).items() if key != name}
        (tmp_path / "file").write_bytes(with_header(contents, json.dumps(fewer)))
        refused(thing.load, tmp_path / "file", "header of the file")
    (tmp_path / "file").write_bytes(with_header(contents, header_text(contents, more=1)))
    refused(thing.load, tmp_path / "file", "header of the file")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"names": "KJ"}, "names is 'KJ'"),
        ({"names": ["K", 2]}, "names is"),
        ({"names": {"K": 1, "J_in": 2}}, "names is"),
        ({"names": ["K", ["J_in"]]}, "names is"),
        ({"names": ["K", "K"]}, "names is"),
        ({"names": []}, "names is"),
        ({"lower": [False, 0.1]}, r"lower\[0\] is False"),
        ({"lower": ["0.1", 0.1]}, r"lower\[0\] is '0.1'"),
        ({"lower": [[0.1], [0.1]]}, r"lower\[0\] is \[0.1\]"),
        ({"lower": {"K": 0.1}}, "lower is"),
        ({"lower": None}, "lower is None"),
        ({"lower": [0.1]}, "shape of lower"),
        ({"upper": [0.05, 1]}, r"upper\['K'\] is 0.05"),
        ({"upper": [0.3, 1e308]}, "bounds of 'J_in'"),
        ({"lower": [0, 0.1], "upper": [5e-324, 0.2]}, "bounds of 'K'"),
        ({"orders": [2, 3.0]}, r"orders\[1\] is 3.0"),
        ({"orders": [2, True]}, r"orders\[1\] is True"),
        ({"orders": "23"}, "orders is '23'"),
        ({"orders": [3, 3]}, "orders of the coefficients"),
        ({"orders": [2, -1]}, r"orders\[1\] is -1"),
        ({"provenance": [1]}, "provenance is"),
        ({"provenance": None}, "provenance is None"),
    ],
)
def test_surrogates_with_fields_of_other_types_are_refused(changes, message, tmp_path):
    (tmp_path / "file").write_bytes(with_header(SURROGATE, header_text(SURROGATE, **changes)))
    refused(ChebyshevSurrogate.load, tmp_path / "file", message)


def replaced(tree, path, value):
    """Return a copy of nested tables and lists with another value at ``path``."""
    if not path:
        return value
    copy = tree.copy()
    copy[path[0]] = replaced(tree[path[0]], path[1:], value)
    return copy


def places(tree, path=()):
    yield path
    if isinstance(tree, (dict, list)):
        for key in tree if isinstance(tree, dict) else range(len(tree)):
            yield from places(tree[key], (*path, key))


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)


@pytest.mark.slow
@pytest.mark.parametrize("name", AT_NIGHT)
@fuzz
@given(data=st.data())
def test_any_value_anywhere_in_a_header_is_refused_or_harmless(name, data, tmp_path):
    thing, stored = KINDS[name]
    contents = stored.read_bytes()
    header = header_of(contents)
    path = data.draw(st.sampled_from(list(places(header))))
    text = json.dumps(replaced(header, path, data.draw(json_values)))
    (tmp_path / "file").write_bytes(with_header(contents, text))
    try:
        loaded = thing.load(tmp_path / "file")
    except InvalidInput:
        return
    # Values in other units come back in SI, so the text may differ; what was loaded may not.
    loaded.save(tmp_path / "again")
    thing.load(tmp_path / "again").save(tmp_path / "third")
    assert (tmp_path / "third").read_bytes() == (tmp_path / "again").read_bytes()


@pytest.mark.parametrize("name", AT_NIGHT)
@fuzz
@given(
    cuts=st.lists(
        st.tuples(st.floats(0, 1), st.integers(0, 40), st.binary(max_size=40)), max_size=4
    )
)
def test_any_damage_is_refused_or_harmless(name, cuts, tmp_path):
    thing, stored = KINDS[name]
    damaged = stored.read_bytes()
    for where, length, instead in cuts:
        at = int(where * len(damaged))
        damaged = damaged[:at] + instead + damaged[at + length :]
    (tmp_path / "file").write_bytes(damaged)
    try:
        loaded = thing.load(tmp_path / "file")
    except InvalidInput:
        return
    loaded.save(tmp_path / "again")
    assert (tmp_path / "again").read_bytes() == stored.read_bytes()
