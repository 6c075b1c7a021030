"""The page of a report, and how numbers look in it."""

from __future__ import annotations

import re
from decimal import ROUND_CEILING, Decimal
from html import unescape
from typing import Any

import numpy as np
from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

from pymoo_hdte._reports.glossary import terms_in


def page(package: str, template: str, **values: Any) -> str:
    """Return a page from a template of a package; it may include templates of `_reports`."""
    environment = Environment(
        loader=ChoiceLoader(
            [PackageLoader(name, ".") for name in (package, "pymoo_hdte._reports")]
        ),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    filters = (change, number, percent, with_error, without_tags)
    environment.filters |= {function.__name__: function for function in filters}
    environment.globals |= {"digits": digits, "terms_in": terms_in}
    return environment.get_template(template).render(**values)


def number(value: float | None, digits: int = 3) -> str:
    """Return a number for the reader, without an exponent where possible."""
    if value is None or not np.isfinite(value):
        return "\N{EN DASH}"
    size = abs(value)
    if value == 0.0 or 1e-3 <= size < 1e5:
        shown = np.format_float_positional(value, digits, fractional=False, trim="-")
        return shown.replace("-", "\N{MINUS SIGN}")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    power = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{mantissa}·10{power}".replace("-", "\N{MINUS SIGN}")


def change(percent: float) -> str:
    """Return a relative change with its sign.

    Parameters
    ----------
    percent : float
        100 times the relative change.

    Examples
    --------
    >>> change(-25.0), change(3.14)
    ('−25.0 %', '+3.1 %')
    """
    return f"{percent:+.1f} %".replace("-", "\N{MINUS SIGN}")


def percent(share: float) -> str:
    """Return a share in per cent, rounded down, so that only a full share becomes 100 %.

    >>> percent(0.99962), percent(1.0)
    ('99.9 %', '100 %')
    """
    return f"{np.floor(1000.0 * share + 1e-9) / 10.0:g} %".replace("-", "\N{MINUS SIGN}")


def with_error(value: float, half_width: float) -> str:
    """Return a value and its half interval, both to the second digit of the half interval.

    The half is rounded up: an interval is never shown narrower than it is. Above 100 both are to
    the unit.

    >>> with_error(6.04123, 0.00261), with_error(6.04123, 0.0)
    ('6.0412 ± 0.0027', '6.041')
    """
    if not np.isfinite(half_width) or half_width <= 0.0:
        return number(value, 4)
    half = Decimal(repr(float(half_width)))
    places = max(0, 1 - half.adjusted())
    half = half.quantize(Decimal(1).scaleb(-places), ROUND_CEILING)
    shown = f"{value:.{places}f} ± {half:f}"
    return shown.replace("-", "\N{MINUS SIGN}")


def digits(lower: float | None, upper: float | None) -> int:
    """Return the digits worth showing of a value: two of its interval's width, 2 to 12 in all.

    Without an interval there are 4.
    """
    if lower is None or upper is None or not lower < upper:
        return 4
    places = np.log10(max(abs(lower), abs(upper)) / (upper - lower))
    return int(np.clip(np.ceil(places) + 2, 2, 12)) if np.isfinite(places) else 4


def without_tags(markup: str) -> str:
    """Return the text of a page without its tags, which separate words.

    >>> without_tags("<b>found</b>The stiffness").split()
    ['found', 'The', 'stiffness']
    """
    return unescape(re.sub("<[^>]*>", " ", markup))
