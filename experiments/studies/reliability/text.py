"""Mutations of the text or the bytes of one file."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

Item = TypeVar("Item")
FULL_WIDTH = "\N{FULLWIDTH DIGIT ONE}\N{FULLWIDTH DIGIT TWO}"

WORDS = (
    *("nan", "-nan", "inf", "-inf", "1e999", "-1e999", "-0", "0", "0.0", "1e-320", "1e308"),
    *("-1e308", "1e15", "-1", "9" * 400, "9" * 5000, "true", "false", "text", "", " ", "٣"),
    *(FULL_WIDTH, "1_000", "0x10", "1,5", "1.5.2", "'1'", '"1"', "[1]", "[]", "{}", "1+1j"),
    *("{ value = 1 }", "2020-01-01", "None", "1e3", "0.5", "2", "1" + "0" * 30, "½"),
    "\N{MINUS SIGN}5",
)
"""In the place of a number."""
UNITS = ("rad", "deg", "arcsec", "m", "mm", "um", "N.m", "N/m", "N.m/rad", "kg.m2", "r/min", "")
PATHS = (
    *("../../etc/passwd", "/etc/passwd", "..", ".", "", "/dev/null", "~/x.csv", "a/../../b.csv"),
    *("C:\\\\x.csv", "con", "\\\\\\\\host\\\\share", "x\\u0000.csv", "a" * 300, "rig.toml"),
)
NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])")
QUOTED = re.compile(r'"[^"\n]*"')
FILE = re.compile(r'(?<=file = )"[^"\n]*"')
KEY = re.compile(r"^[ \t]*[\w.-]+(?=[ \t]*=)", re.MULTILINE)
VALUE = re.compile(r"(?<==)[^\n]+")
HEADER = re.compile(r"^\[+[^]\n]*\]+", re.MULTILINE)
DEEPEST = 5000
LONGEST = 1_000_000


def pick(items: Sequence[Item], rng: np.random.Generator) -> Item:
    """Return one of the items."""
    return items[int(rng.integers(len(items)))]


def _replaced(
    pattern: re.Pattern[str], text: str, rng: np.random.Generator, change: Callable[[str], str]
) -> str:
    """Change one match, or now and then up to twenty."""
    matches = list(pattern.finditer(text))
    if not matches:
        return text
    count = 1 if rng.random() < 0.8 else int(rng.integers(2, 21))
    for at in sorted({*rng.integers(len(matches), size=count).tolist()}, reverse=True):
        start, end = matches[at].span()
        text = text[:start] + change(text[start:end]) + text[end:]
    return text


def number_replaced(text: str, rng: np.random.Generator) -> str:
    """Put a word in the place of a number."""
    return _replaced(NUMBER, text, rng, lambda _: pick(WORDS, rng))


def number_scaled(text: str, rng: np.random.Generator) -> str:
    """Change a number to another unit, sign or size."""
    factors = (-1.0, 1e-3, 1e3, 0.5, 2.0, 60.0, 0.9, 1.1, 1.0 + 1e-9, 1e-300, 1e300)
    return _replaced(NUMBER, text, rng, lambda old: repr(float(old) * pick(factors, rng)))


def quoted_replaced(text: str, rng: np.random.Generator) -> str:
    """Put a unit, a name or a path in the place of another."""
    others = QUOTED.findall(text) or ['""']

    def change(_: str) -> str:
        words = pick((UNITS, PATHS, others), rng)
        return f'"{pick(words, rng).strip(chr(34))}"'

    return _replaced(QUOTED, text, rng, change)


def path_replaced(text: str, rng: np.random.Generator) -> str:
    """Name a file elsewhere."""
    return _replaced(FILE, text, rng, lambda _: f'"{pick(PATHS, rng)}"')


def key_renamed(text: str, rng: np.random.Generator) -> str:
    """Make a key another one, misspelt, dotted or strange."""
    others = KEY.findall(text) or ["key"]
    strange = ("x", "a.b.c", '""', '"ключ"', "1", ".".join("a" * 1200))
    return _replaced(
        KEY,
        text,
        rng,
        lambda old: pick((pick(others, rng), old[:-1] + "q", pick(strange, rng)), rng),
    )


def value_nested(text: str, rng: np.random.Generator) -> str:
    """Put a value in brackets or braces, a few or very many."""
    depth = int(pick((1, 2, 50, DEEPEST), rng))
    opening, closing = pick((("[", "]"), ("{a=", "}")), rng)
    return _replaced(VALUE, text, rng, lambda old: opening * depth + old + closing * depth)


def header_changed(text: str, rng: np.random.Generator) -> str:
    """Give a table another name, make it an array, or double it."""
    others = HEADER.findall(text) or ["[table]"]

    def change(old: str) -> str:
        return pick(
            (pick(others, rng), f"[{old}]", old.strip("[]"), f"{old}\n{old}", "[a.b]", old[1:]), rng
        )

    return _replaced(HEADER, text, rng, change)


def lines_deleted(text: str, rng: np.random.Generator) -> str:
    """Leave out some lines."""
    lines = text.split("\n")
    start = int(rng.integers(len(lines)))
    return "\n".join(lines[:start] + lines[start + int(pick((1, 2, 10, 10**6), rng)) :])


def lines_doubled(text: str, rng: np.random.Generator) -> str:
    """Write some lines twice."""
    lines = text.split("\n")
    start = int(rng.integers(len(lines)))
    end = start + int(pick((1, 2, 10), rng))
    return "\n".join(lines[:end] + lines[start:])


def lines_swapped(text: str, rng: np.random.Generator) -> str:
    """Swap two lines."""
    lines = text.split("\n")
    place, second = rng.integers(len(lines), size=2)
    lines[place], lines[second] = lines[second], lines[place]
    return "\n".join(lines)


def line_strange(text: str, rng: np.random.Generator) -> str:
    """Add a line that does not belong here."""
    lines = text.split("\n")
    strange = (
        "#",
        " ",
        ",,,,",
        "x" * LONGEST,
        "1," * (LONGEST // 2),
        "\t",
        '"',
        "'''",
        "=",
        "\ufeff",
    )
    lines.insert(int(rng.integers(len(lines) + 1)), pick(strange, rng))
    return "\n".join(lines)


def cells_changed(text: str, rng: np.random.Generator) -> str:
    """Give one line a cell fewer, more, or elsewhere."""
    lines = text.split("\n")
    rows = [index for index, line in enumerate(lines) if "," in line]
    if rows:
        row = pick(rows, rng)
        lines[row] = ",".join(_rearranged(lines[row].split(","), rng))
    return "\n".join(lines)


def column_changed(text: str, rng: np.random.Generator) -> str:
    """Give all lines a cell fewer, more, or elsewhere, the same in each."""
    seed = int(rng.integers(2**32))
    return "\n".join(
        ",".join(_rearranged(line.split(","), np.random.default_rng(seed))) if "," in line else line
        for line in text.split("\n")
    )


def column_replaced(text: str, rng: np.random.Generator) -> str:
    """Put one word in a whole column below the header."""
    lines = text.split("\n")
    word = pick(WORDS, rng)
    at = int(rng.integers(lines[0].count(",") + 1))
    for index, line in enumerate(lines[1:], start=1):
        cells = line.split(",")
        if at < len(cells) > 1:
            cells[at] = word
            lines[index] = ",".join(cells)
    return "\n".join(lines)


def _rearranged(cells: list[str], rng: np.random.Generator) -> list[str]:
    place, second = rng.integers(len(cells), size=2)
    match rng.integers(3):
        case 0:
            del cells[place]
        case 1:
            cells.insert(second, cells[place])
        case _:
            cells[place], cells[second] = cells[second], cells[place]
    return cells


def spaces_added(text: str, rng: np.random.Generator) -> str:
    """Add blank lines and spaces at the ends of lines, which do no harm."""
    return re.sub("\n", lambda _: pick(("\n", "\n\n", " \n"), rng), text[:3000]) + text[3000:]


def encoded(text: str, rng: np.random.Generator) -> bytes:
    """Encode the text in another way, or end its lines as another system does."""
    ends = pick(("\n", "\n", "\r\n", "\r"), rng)
    encoding = pick(("utf-16", "utf-16-le", "utf-8-sig", "utf-32", "cp037", "utf-8"), rng)
    return text.replace("\n", ends).encode(encoding, "replace")


def bits_flipped(content: bytes, rng: np.random.Generator) -> bytes:
    """Flip a few bits."""
    changed = bytearray(content)
    for at in rng.integers(len(content), size=int(pick((1, 1, 4, 64), rng))) if content else ():
        changed[at] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def cut_off(content: bytes, rng: np.random.Generator) -> bytes:
    """Keep the beginning alone."""
    return content[: int(rng.integers(len(content) + 1))]


def part_deleted(content: bytes, rng: np.random.Generator) -> bytes:
    """Leave out a part in the middle."""
    start, end = sorted(rng.integers(len(content) + 1, size=2).tolist())
    return content[:start] + content[end:]


def part_doubled(content: bytes, rng: np.random.Generator) -> bytes:
    """Write a part twice."""
    start, end = sorted(rng.integers(len(content) + 1, size=2).tolist())
    return content[:end] + content[start:]


def part_zeroed(content: bytes, rng: np.random.Generator) -> bytes:
    """Fill a part with NUL, as file systems do after a loss of power."""
    start, end = sorted(rng.integers(len(content) + 1, size=2).tolist())
    return content[:start] + bytes(end - start) + content[end:]


def noise_inserted(content: bytes, rng: np.random.Generator) -> bytes:
    """Put random bytes in between."""
    at = int(rng.integers(len(content) + 1))
    return content[:at] + rng.bytes(int(pick((1, 16, 4096), rng))) + content[at:]


def emptied(content: bytes, rng: np.random.Generator) -> bytes:
    """Leave nothing at all."""
    return b""


TEXTS = (
    *(number_replaced, number_replaced, number_scaled, number_scaled, quoted_replaced),
    *(path_replaced, key_renamed, value_nested, header_changed, lines_deleted, lines_doubled),
    *(lines_swapped, line_strange, cells_changed, column_changed, column_replaced, spaces_added),
)
BYTES = (
    *(bits_flipped, bits_flipped, cut_off, part_deleted, part_doubled, part_zeroed),
    *(noise_inserted, emptied),
)
