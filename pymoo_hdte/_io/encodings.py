"""Encodings of text: stated, or recognised by the first bytes and by what decodes.

UTF-8 is tried first. A byte that is none is one of cp1252, in which Windows writes umlauts and
units; the first bytes tell UTF-16, by a mark or by the zeros between ASCII characters.
"""

from __future__ import annotations

import codecs
import re

ENCODINGS = {"utf-8": "utf-8-sig", "cp1252": "cp1252", "utf-16": "utf-16"}
"""Python's names of the encodings that a layout may state, by their names there."""

PROBE = 256
"""Bytes at the start of a file, enough to recognise UTF-16."""

_MARKS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
_ESCAPED = re.compile("[\udc80-\udcff]")


def encoding_of(start: bytes, stated: str | None = None) -> str:
    """Return Python's name of the encoding of a text with these first bytes.

    Parameters
    ----------
    start : bytes
        `PROBE` of them are enough.
    stated : str, optional
        One of `ENCODINGS`; by default it is found out.

    Examples
    --------
    >>> encoding_of("Zeit;Öl".encode("utf-16"))
    'utf-16'
    """
    if stated == "utf-16" or stated is None:
        for mark, name in _MARKS.items():
            if start.startswith(mark) and len(start) > len(mark):
                return name
        pairs = len(start) // 2
        ends = start[0 : 2 * pairs : 2], start[1 : 2 * pairs : 2]
        zeros = [end.count(0) for end in ends]
        if pairs >= 2 and min(zeros) == 0 and 2 * max(zeros) > pairs:
            return "utf-16-le" if zeros[1] else "utf-16-be"
    return ENCODINGS[stated or "utf-8"]


def with_cp1252(text: str) -> str:
    """Return a text whose bytes that are no UTF-8 are characters of cp1252.

    Parameters
    ----------
    text : str
        Decoded with the error handler ``surrogateescape``; a byte that cp1252 has no character for
        stays as it is.
    """
    if text.isascii():
        return text

    def character(escaped: re.Match[str]) -> str:
        byte = bytes([ord(escaped[0]) - 0xDC00])
        return byte.decode("cp1252", "surrogateescape")

    return _ESCAPED.sub(character, text)


def decoded(content: bytes) -> str:
    """Return a whole text that is in UTF-8, UTF-16 or cp1252.

    Raises
    ------
    ValueError
        For bytes in no such encoding.
    """
    encoding = encoding_of(content[:PROBE])
    text = content.decode(encoding, "surrogateescape")
    text = with_cp1252(text) if encoding == ENCODINGS["utf-8"] else text
    text.encode("utf-8")
    return text
