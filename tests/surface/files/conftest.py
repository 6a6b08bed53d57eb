"""Limits and interpreters of the file readers."""

import pytest

from patchfem.surface.files import instruments, raw


@pytest.fixture
def use_interpreter(monkeypatch):
    """Return a function that sets the interpreter in which SurfaceTopography reads a file."""

    def set_interpreter(path) -> None:
        """Set the interpreter."""
        monkeypatch.setattr(instruments, "PYTHON", str(path))

    return set_interpreter


@pytest.fixture
def small_text_limit(monkeypatch):
    """Limit the size of a text file to 1 MiB."""
    monkeypatch.setattr(raw, "MAX_TEXT_BYTES", 1 << 20)
