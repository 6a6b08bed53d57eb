"""Limits and interpreters of the readers of files."""

import pytest

from patchfem.surface.files import instruments, raw


@pytest.fixture
def use_interpreter(monkeypatch):
    """Return a function that sets the interpreter in which SurfaceTopography reads a file."""

    def use(path) -> None:
        monkeypatch.setattr(instruments, "PYTHON", str(path))

    return use


@pytest.fixture
def one_mebibyte_of_text(monkeypatch):
    """A text may have 1 MiB."""
    monkeypatch.setattr(raw, "MAX_TEXT_BYTES", 1 << 20)
