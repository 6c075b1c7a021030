"""The examples of the README, each run once for all tests, and the pictures that come of them."""

import io
import sys
from importlib import import_module

from kept_results import kept
from places import DOCS

sys.path.insert(0, str(DOCS))
pictures = import_module("readme_pictures")


@kept
def example(picture: str) -> tuple[str, bytes]:
    """Return what the example of a picture prints, and the picture of this run."""
    figure, printed = pictures.drawn(picture)
    file = io.BytesIO()
    pictures.save(figure, printed, file)
    return printed, file.getvalue()
