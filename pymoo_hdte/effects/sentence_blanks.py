"""Sentences of effects as reports print them, and labels of candidates in words.

Each effect brings its own sentence (`Effect.sentence`, beside its law); here its blanks are filled.
"""

from __future__ import annotations

import re
import string
from collections.abc import Sequence

from pymoo_hdte.checks import InvalidInput, one_of

BLANKS = ("port", "order", "force")
"""What a sentence may leave open: the port, the orders, and the word for what acts there."""
_PORT = r"([A-Za-z]\w*(?:\.\w+)*(?: of \w+)?)"
_FORM = r"(?:/([a-z\d.+]+(?: s)?))?"
"""A form of an effect; that of a new zero is its time."""
_LABEL = re.compile(r"([a-z]+(?:_[a-z]+)*)" + _FORM + ":" + _PORT + r"(?:@([\d.e+-]*\d))?")


def check_sentence(field: str, sentence: str) -> None:
    """Refuse a sentence that is empty or has a blank that nothing fills.

    Raises
    ------
    InvalidInput
    """
    if not str(sentence).strip():
        raise InvalidInput(field, sentence, "a sentence")
    try:
        blanks = [blank for _, blank, _, _ in string.Formatter().parse(sentence)]
    except ValueError:
        raise InvalidInput(field, sentence, "a sentence with every { closed by a }") from None
    for blank in blanks:
        if blank is not None:
            one_of(f"blank of {field}", blank, BLANKS)


def sentence_at(sentence: str, port: str, orders: str, force: str) -> str:
    """Return the sentence of an effect with its blanks filled.

    Parameters
    ----------
    sentence : str
        Sentence of an effect or of one of its guesses.
    port, orders : str
        Where it is, and its orders in words; empty for an effect that has none.
    force : str
        Word for what acts at the port, ``"torque"`` in a drive.

    Examples
    --------
    >>> sentence_at("A {force} ripple at the {port}.", "input", "", "torque")
    'A torque ripple at the input.'
    """
    return sentence.format(port=port, order=orders, force=force)


def out_of_tolerance_sentence(parameter: str) -> str:
    """Return the sentence for a base parameter, given in words, that is out of tolerance."""
    return f"The {parameter} lies outside its tolerance."


def listed(words: Sequence[str]) -> str:
    """Return words as a list with commas and a final "and"; a single word as it is."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def orders_in_words(orders: Sequence[float]) -> str:
    """Return orders in words.

    >>> orders_in_words([200.0]), orders_in_words([200.0, 400.0])
    ('order 200', 'orders 200 and 400')
    """
    return f"order{'s' if len(orders) > 1 else ''} {listed([f'{order:.5g}' for order in orders])}"


def in_words(text: str) -> str:
    """Return a text with all labels of candidates, such as ``torque_ripple:input@6``, in words."""
    return _LABEL.sub(_words, text).replace(")+", ") and ")


def _words(label: re.Match[str]) -> str:
    name, form, port, order = label.groups()
    # Dots stand between the words of a known effect's number, and in its order.
    port = re.sub(r"_|(?<!\d)\.|\.(?!\d)", " ", port)
    if name == "parameter":
        return f"{port} (out of tolerance)"
    details = [port, form, None if order is None else f"order {order}"]
    return f"{name.replace('_', ' ')} ({', '.join(detail for detail in details if detail)})"
