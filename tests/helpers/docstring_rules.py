"""What a machine can check of a docstring: parameters, shapes, units, errors and sources.

The sections are read by docstring_parser, a library without dependencies; numpydoc, which also
validates docstrings, brings all of Sphinx, and its checks know no shapes, units or sources.
"""

import ast
import dataclasses
import functools
import inspect
import re
from collections.abc import Iterator

import docstring_parser
from docstring_parser import DocstringParam, DocstringRaises, DocstringStyle
from docstring_parser.common import DocstringExample
from public_names import HERE, members, public_objects
from raised_errors import ancestors, nodes, raised

ARRAY = re.compile(
    r"NDArray|ArrayLike|\b(Values|Phasors|Vector)\b|(tuple|Sequence)\[float(, \.\.\.)?\]"
)
QUANTITY = re.compile(rf"\bfloat\b|{ARRAY.pattern}")
COUNTED = re.compile(r"NDArray\[np\.(bool_|int_)\]|tuple\[str, float[^]]*\]")
"""Arrays that are no quantities."""

_LENGTH = r"(?:\d+|[a-zA-Z]|[a-zA-Z]_\w+|\.\.\.|size)(?: ?[-+*] ?\w+| \w)*"
SHAPE = re.compile(
    rf"shape \([^)]*\)|\({_LENGTH}(?:,|(?:, ?{_LENGTH})+,?)\)"
    r"|length (?:\d|[a-z]\b|[a-z]_)|(?:same|any|one) shape"
)

_SYMBOLS = (
    r"rad2?(?:/s(?:\^?[2-4])?)?|arcsec|N\.m(?:\.s2?)?(?:/rad[23]?)?|kg\.m2"
    r"|N(?:\.s)?(?:/m)?|m|s(?:\^k)?|Hz|J"
)
_WORDS = (
    "SI|units?|dimensionless|pure number|relative|ratios?|share|factors?|cycles|probability|"
    "per cent|percent|weight|(?:micro)?metres|seconds|kelvin"
)
UNIT = re.compile(
    rf"(?:^|[,;:(] *|\bin |\band |\bor |\bby )(?:{_SYMBOLS})(?=[,;:.)]?(?:\s|$))|\b(?i:{_WORDS})\b"
)

LAW = re.compile(r"\b\w+(?:\([^)]*\))?'* = [^.,;]*?(?: [-+/*] |\^|\(|[A-Z] [A-Z]\b)")
SOURCE = re.compile(r"Eqs?\. ?\(?\d|Tables? \d|Sections? \d|Fig\. \d|\b(?:1[89]|20)\d\d\b")


def annotations(target: object) -> dict[str, str]:
    """Return the annotations of what has to be listed: parameters, or attributes of a class."""
    fields = {}
    if inspect.isclass(target):
        fields = class_attributes(target)
        if dataclasses.is_dataclass(target):
            fields |= {field.name: _written(field.type) for field in dataclasses.fields(target)}
        target = vars(target).get("__init__")
        if not inspect.isfunction(target) or target.__module__ == "typing":
            return fields
    parameters = list(inspect.signature(target).parameters.values())
    named = {one.name: one for one in parameters if one.name not in ("self", "cls")}
    return fields | {name: _written(one.annotation) for name, one in named.items()}


def _written(annotation: object) -> str:
    """Return an annotation as it is written, which only a postponed one tells."""
    if not isinstance(annotation, str):
        raise TypeError(f"{annotation!r} is no text: from __future__ import annotations is missing")
    return annotation


def class_attributes(kind: type) -> dict[str, str]:
    """Return the types of the public attributes of a class that are no methods or properties."""
    return {
        name: type(value).__name__
        for base in kind.__mro__
        if base.__module__.startswith(HERE)
        for name, value in vars(base).items()
        if not name.startswith("_") and not hasattr(value, "__get__")
    }


def docstring(target: object) -> str:
    """Return the docstring of a target itself, not one it inherits."""
    return inspect.cleandoc(getattr(target, "__doc__", None) or "")


@functools.cache
def entries(target: object) -> dict[str, str]:
    """Return type and description of all that a docstring lists, by name."""
    found = {}
    if inspect.isclass(target):
        for base in reversed(target.__mro__):
            if dataclasses.is_dataclass(base) or base is target:
                found |= _entries(docstring_parser.parse_from_object(base, DocstringStyle.NUMPYDOC))
    return found | _entries(_parsed(target))


def _entries(parsed: docstring_parser.Docstring) -> dict[str, str]:
    return {
        name.strip().lstrip("*"): f"{one.type_name or ''}; {one.description or ''}"
        for one in parsed.meta
        if isinstance(one, DocstringParam)
        for name in one.arg_name.split(",")
    }


def _parsed(target: object) -> docstring_parser.Docstring:
    return docstring_parser.parse(docstring(target), DocstringStyle.NUMPYDOC)


@functools.cache
def prose(target: object) -> str:
    """Return a docstring without its lists of parameters and errors, on one line."""
    parsed = _parsed(target)
    parts = [parsed.short_description, parsed.long_description]
    for one in parsed.meta:
        # Examples are code, not prose.
        if not isinstance(one, DocstringParam | DocstringRaises | DocstringExample):
            parts += [getattr(one, "type_name", None), one.description]
    return re.sub(r"\s+", " ", " ".join(part for part in parts if part))


def referred(target: object, owner: object, name: str) -> object | None:
    """Return what a name in backticks stands for: a member of the owner, of a module, or public."""
    name = "__call__" if name == "a call" else name
    for place in (owner, inspect.getmodule(target)):
        found = members(place).get(name) if inspect.isclass(place) else getattr(place, name, None)
        if found is not None:
            return found
    public = {full.partition(".")[2]: one for full, one in public_objects().items()}
    return public.get(name)


def delegates(target: object, owner: object, word: str) -> Iterator[object]:
    """Yield what a sentence such as "Parameters and errors as in `steady_state`." refers to."""
    for sentence in re.split(r"(?<=[.;]) ", prose(target)):
        if re.search(rf"\b{word}\b", sentence, re.IGNORECASE):
            for name in re.findall(r"`([\w.]+)`|\b(a call)\b", sentence):
                found = referred(target, owner, "".join(name))
                if found is not None and found is not target:
                    yield found


def described(target: object, owner: object, name: str) -> str | None:
    """Return what is said of a parameter, here or where the docstring sends the reader."""
    said = entries(target).get(name)
    if said is None:
        others = delegates(target, owner, "parameters|arguments")
        return next((found for one in others if (found := described(one, owner, name))), None)
    sent = re.search(r"; As (?:in|for|of) `([\w.]+)`", said)
    other = referred(target, owner, sent[1]) if sent else None
    return said if other is None else described(other, owner, name)


def told(target: object, owner: object) -> set[str]:
    """Return the names of the errors that a docstring tells of."""
    # A class tells in its prose what its methods raise, too.
    spoken = "" if inspect.isclass(target) else prose(target)
    found = set(re.findall(r"\b\w*(?:Input|Error|Drive)\b", spoken))
    for one in _parsed(target).meta:
        if isinstance(one, DocstringRaises) and one.type_name:
            found |= {name.strip() for name in one.type_name.split(",")}
    for other in delegates(target, owner, "errors"):
        found |= told(other, owner)
    return found


def faults(target: object, owner: object = None) -> list[str]:
    """Return what a docstring lacks, a sentence each."""
    return [
        *_undocumented(target, owner),
        *_without_shape(target, owner),
        *_without_unit(target, owner),
        *_untold_errors(target, owner),
        *_without_source(target, owner),
    ]


def _undocumented(target: object, owner: object) -> Iterator[str]:
    if not docstring(target):
        yield "has no docstring"
    names = annotations(target)
    for name in [*names, *(one for one in _set_by_constructor(target) if one not in names)]:
        if described(target, owner, name) is None:
            plain = name.rstrip("s").replace("_", "[ _]")
            in_prose = re.search(rf"\b{plain}s?\b", prose(target), re.IGNORECASE)
            if not (_may_stay_in_prose(target) and in_prose):
                yield f"does not document {name}"


def _set_by_constructor(target: object) -> list[str]:
    """Return the public attributes that the constructor of a class sets."""
    constructor = vars(target).get("__init__") if inspect.isclass(target) else None
    stored = [node for node in nodes(constructor) if isinstance(node, ast.Attribute)]
    stored = [one for one in stored if isinstance(one.ctx, ast.Store)]
    return [
        one.attr
        for one in stored
        if getattr(one.value, "id", None) == "self" and not one.attr.startswith("_")
    ]


def _may_stay_in_prose(target: object) -> bool:
    return not inspect.isclass(target) and len(annotations(target)) == 1


def _without_shape(target: object, owner: object) -> Iterator[str]:
    needed = 0
    for name, annotation in annotations(target).items():
        if ARRAY.search(annotation):
            said = described(target, owner, name)
            needed += said is None and _may_stay_in_prose(target)
            if said is not None and not SHAPE.search(said):
                yield f"does not say the shape of {name}"
    if ARRAY.search(result(target)):
        arrays = [one for one in returned(target) if re.search("array|tuple", one)]
        needed += not arrays
        if not all(SHAPE.search(one) for one in arrays):
            yield "does not say the shape of what it returns"
    if len(SHAPE.findall(prose(target))) < needed:
        yield "does not say the shape of what it takes or returns"


def _without_unit(target: object, owner: object) -> Iterator[str]:
    said_in_prose = False
    for name, annotation in annotations(target).items():
        if QUANTITY.search(COUNTED.sub("", annotation)):
            said = described(target, owner, name)
            said_in_prose |= said is None and _may_stay_in_prose(target)
            if said is not None and not UNIT.search(SHAPE.sub("", said)):
                yield f"does not say the unit of {name}"
    if QUANTITY.search(COUNTED.sub("", result(target))):
        values = [one for one in returned(target) if re.search("array|float", one)]
        said_in_prose |= not values
        if not all(UNIT.search(SHAPE.sub("", one)) for one in values):
            yield "does not say the unit of what it returns"
    if said_in_prose and not UNIT.search(SHAPE.sub("", prose(target))):
        yield "does not say the unit of what it takes or returns"


def returned(target: object) -> list[str]:
    """Return type and description of all that a docstring lists as returned."""
    return [f"{one.type_name}; {one.description}" for one in _parsed(target).many_returns]


def result(target: object) -> str:
    """Return the annotation of what a function returns."""
    if inspect.isclass(target):
        return ""
    return _written(inspect.signature(target).return_annotation)


def _untold_errors(target: object, owner: object) -> Iterator[str]:
    functions = [target]
    if inspect.isclass(target):
        functions = [vars(target).get(name) for name in ("__init__", "__post_init__")]
        functions = [one for one in functions if getattr(one, "__module__", "") != "typing"]
    module = inspect.getmodule(target)
    for function in functions:
        if inspect.isfunction(function):
            for name in sorted(raised(function)):
                if not ancestors(module, name) & told(target, owner):
                    yield f"does not tell that it raises {name}"


def _without_source(target: object, owner: object) -> Iterator[str]:
    law = LAW.search(prose(target))
    texts = docstring(target) + (docstring(owner) if owner else "")
    if law and not SOURCE.search(texts):
        yield f"does not say where {law[0]!r} is from"
