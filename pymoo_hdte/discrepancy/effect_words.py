"""Names of effects as a reader wants them."""

from __future__ import annotations

import re

_PORT = r"([A-Za-z]\w*(?: of \w+)?)"
_LABEL = re.compile(r"([a-z]+(?:_[a-z]+)*)(?:/([a-z\d.+]+))?:" + _PORT + r"(?:@([\d.e+-]*\d))?")


def in_words(text: str) -> str:
    """Return a text with all labels of candidates, such as ``torque_ripple:input@6``, in words."""
    return _LABEL.sub(_words, text).replace(")+", ") and ")


def _words(label: re.Match[str]) -> str:
    name, form, port, order = label.groups()
    details = [port.replace("_", " "), form, None if order is None else f"order {order}"]
    return f"{name.replace('_', ' ')} ({', '.join(one for one in details if one)})"
