"""Limits of the file readers."""

import pytest

from patchfem.surface.files import content


@pytest.fixture
def small_text_limit(monkeypatch):
    """Limit the size of a text file to 1 MiB."""
    monkeypatch.setattr(content, "MAX_TEXT_BYTES", 1 << 20)
