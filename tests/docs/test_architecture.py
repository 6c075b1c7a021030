"""The page on architecture names files that exist."""

from __future__ import annotations

import re

import pytest
from places import DOCS, PACKAGE, ROOT

PAGE = DOCS / "architecture.md"
NAMED = sorted(set(re.findall(r"`([\w/]+/\w+\.py)[` ]", PAGE.read_text())))


def test_the_page_names_files_with_their_rooms():
    assert len(NAMED) > 10


@pytest.mark.parametrize("name", NAMED)
def test_a_named_file_exists(name):
    assert any((root / name).is_file() for root in (ROOT, PACKAGE))
