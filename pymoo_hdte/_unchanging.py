"""What never changes once it is made."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Self


class Unchanging:
    """A base of what never changes: deep copies share it, and pickles hold nothing computed."""

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return itself."""
        return self

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: not what a cached property computes anew."""
        kind = type(self)
        return {
            name: value
            for name, value in vars(self).items()
            if not isinstance(getattr(kind, name, None), cached_property)
        }
