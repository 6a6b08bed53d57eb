"""A study as a module, and what its docstring contains."""

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2] / "studies"


def study(name):
    """The module of a study by its path below studies/."""
    path = ROOT / name
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def study_fixture(name):
    """Return a fixture that is the module of a study, loaded once for a file of tests."""

    @pytest.fixture(scope="module")
    def module():
        return study(name)

    return module


def assert_contains(text, *parts):
    """Require that a text, whose line breaks do not count, contains all parts."""
    text = " ".join(text.split())
    missing = [part for part in parts if part not in text]
    assert not missing, f"{missing} not in: {text}"
