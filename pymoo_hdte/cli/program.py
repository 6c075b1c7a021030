"""A program as a simulator: called without a shell, in a folder of its own for every run."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import stat
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems._simulator.children import SCRATCH

LARGEST_OUTPUT = 2**24
"""Bytes of an output that are read; a program that writes more has failed."""
_LARGEST_PROGRAM = 2**28
"""Bytes of a file by which a program is told from others."""
_STANDARD_OUTPUT, _STANDARD_ERROR = "stdout.txt", "stderr.txt"
_NUMBER = re.compile(
    r"[-+]?(?:(?:\d++(?:\.\d*+|(?!,\d))|\.\d++)(?:[ed][-+]?\d++)?+(?![-+.]\d)"
    r"|(?:nan|inf(?:inity)?)\b)",
    re.IGNORECASE,
)
"""Never the beginning of one: of 2,5, of 1.5.2, or of Fortran's 0.12-102 for 0.12E-102."""
_LINE = re.compile(r"\s*([A-Za-z_]\w*)\s*[=:,\s]\s*(\S+)\s*")
_SAFELY = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
"""A link is not followed, and a pipe not waited for."""
_SHOWN = 200
"""Characters of the last line on the error stream that an error shows."""


@dataclass(frozen=True)
class Program:
    """A program whose arguments or input file hold the inputs, and whose output the responses.

    Parameters
    ----------
    command : tuple of str
        The program, an absolute path, and its arguments. ``${name}`` stands for an input,
        ``${input_file}`` and ``${output_file}`` for these files, ``${study}`` for the folder of the
        study.
    study : str
        Folder of the study.
    responses : tuple of (str, str or None)
        Name of each response, and the text behind whose last occurrence its number stands; None for
        a line ``name = number``, or a JSON object of all.
    input_file, output_file : str or None
        Names of files in the folder of a run; no output file stands for standard output.
    template : str or None
        Text of the input file with ``${name}`` for inputs; None for a JSON object of all.
    digest : str
        Tells the program's files from others, so that finished runs of others are not taken.

    Raises
    ------
    RuntimeError
        When called: if the program ends with another code than 0, or its output lacks a response.
    OSError
        When called: if the program cannot be started.
    """

    command: tuple[str, ...]
    study: str
    responses: tuple[tuple[str, str | None], ...]
    input_file: str | None = None
    output_file: str | None = None
    template: str | None = None
    digest: str = ""

    def __call__(self, **inputs: float) -> dict[str, float]:
        """Make one run; return the responses by name."""
        # A process that is killed over the time limit does not remove the folder itself.
        parent = os.environ.get(SCRATCH)
        with tempfile.TemporaryDirectory(prefix="pymoo-hdte-run-", dir=parent) as name:
            folder = Path(name)
            values = {key: repr(float(value)) for key, value in inputs.items()}
            words = values | {"study": self.study}
            for word, file in self._files():
                words[word] = str(folder / file)
            if self.input_file is not None:
                numbers = {key: float(value) for key, value in inputs.items()}
                text = json.dumps(numbers)
                if self.template is not None:
                    text = Template(self.template).substitute(words)
                (folder / self.input_file).write_text(text, encoding="utf-8")
            self._run([Template(part).substitute(words) for part in self.command], folder)
            output = folder / (self.output_file or _STANDARD_OUTPUT)
            return responses_in(_text_of(output), self.responses)

    def _files(self) -> Iterator[tuple[str, str]]:
        for word, file in (("input_file", self.input_file), ("output_file", self.output_file)):
            if file is not None:
                yield word, file

    def _run(self, arguments: Sequence[str], folder: Path) -> None:
        output, errors = folder / _STANDARD_OUTPUT, folder / _STANDARD_ERROR
        with output.open("wb") as stdout, errors.open("wb") as stderr:
            done = subprocess.run(
                arguments,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=stdout,
                stderr=stderr,
                check=False,
            )
        if done.returncode:
            lines = _text_of(errors).split("\n")
            last = next((line.strip() for line in reversed(lines) if line.strip()), "")
            ending = f": {last[:_SHOWN]}" if last else ""
            raise RuntimeError(f"the program ended with code {done.returncode}{ending}")


def responses_in(text: str, responses: Sequence[tuple[str, str | None]]) -> dict[str, float]:
    """Return the responses that stand in an output.

    Parameters
    ----------
    text : str
        The output.
    responses : sequence of (str, str or None)
        As in `Program`.

    Raises
    ------
    RuntimeError
        If one is missing.

    Examples
    --------
    >>> responses_in("max stress = 2.5e8 Pa", [("stress", "max stress =")])
    {'stress': 250000000.0}
    """
    by_name = _named_numbers(text) if any(mark is None for _, mark in responses) else {}
    values = {}
    for name, mark in responses:
        if mark is None:
            found = by_name.get(name)
        else:
            _, there, behind = text.rpartition(mark)
            match = _NUMBER.match(behind.lstrip(" \t=:,")) if there else None
            found = None if match is None else _number(match[0])
        if found is None:
            wanted = f"a line {name} = number" if mark is None else f"a number behind {mark!r}"
            raise RuntimeError(f"the output has no {name}: {wanted} is missing")
        values[name] = found
    return values


def _named_numbers(text: str) -> Mapping[str, float]:
    """Return what a JSON object, or the lines ``name = number`` of a text, give by name."""
    try:
        table = json.loads(text)
    except (ValueError, RecursionError):
        table = None
    if isinstance(table, dict):
        numbers = {name: value for name, value in table.items() if type(value) in (int, float)}
        return {name: float(value) for name, value in numbers.items()}
    matches = map(_LINE.fullmatch, text.splitlines())
    pairs = ((match[1], _NUMBER.fullmatch(match[2])) for match in matches if match)
    return {name: _number(number[0]) for name, number in pairs if number}


def _number(text: str) -> float:
    """Return a number, also one with Fortran's letter for the exponent."""
    return float(re.sub("[dD]", "e", text))


def _text_of(path: Path) -> str:
    """Return the text of a file that a program wrote, which may be a link, a pipe or endless.

    Raises
    ------
    RuntimeError
        If it is missing, no regular file or larger than `LARGEST_OUTPUT`.
    """
    try:
        descriptor = os.open(path, _SAFELY)
    except OSError as error:
        raise RuntimeError(f"the output {path.name} cannot be read: {error.strerror}") from None
    with open(descriptor, "rb") as stream:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise RuntimeError(f"the output {path.name} is no regular file")
        content = stream.read(LARGEST_OUTPUT + 1)
    if len(content) > LARGEST_OUTPUT:
        raise RuntimeError(f"the output {path.name} has more than {LARGEST_OUTPUT} bytes")
    return content.decode("utf-8", "replace")


def program_at(field: str, given: str, study: Path) -> Path:
    """Return the absolute path of a program.

    Parameters
    ----------
    field : str
        Name of the field, for an error.
    given : str
        A name that is looked for on PATH, or a path, a relative one from the folder of the study.
    study : Path
        Folder of the study.

    Raises
    ------
    InvalidInput
        If there is no such file, it is no regular one or may not be executed.
    """
    if os.sep in given or (os.altsep and os.altsep in given):
        # Links are kept: a program may look at the name by which it is called.
        path: Path | None = Path(os.path.abspath(study / given))
    else:
        # Absolute entries of PATH alone: not what lies in the folder one happens to be in.
        folders = [part for part in os.get_exec_path() if os.path.isabs(part)]
        named = shutil.which(given, path=os.pathsep.join(folders))
        path = None if named is None else Path(named)
    if path is None or not path.is_file() or not os.access(path, os.X_OK):
        allowed = "a program on PATH, or the path of an executable file"
        raise InvalidInput(field, given, allowed)
    return path


def digest_of(paths: Sequence[Path]) -> str:
    """Return a digest of the contents of files; of large ones size and time stand for them."""
    digest = hashlib.sha256()
    for path in paths:
        status = path.stat()
        if status.st_size <= _LARGEST_PROGRAM:
            digest.update(hashlib.sha256(path.read_bytes()).digest())
        else:
            digest.update(f"{status.st_size} {status.st_mtime_ns}".encode())
    return digest.hexdigest()
