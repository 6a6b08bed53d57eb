"""Load a study as a module, and check the contents of its docstring."""

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2] / "studies"


def load_study(name):
    """Return the module of a study, given its path below studies/."""
    path = ROOT / name
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def make_study_fixture(name):
    """Return a fixture that loads a study once for a file of tests."""

    @pytest.fixture(scope="module")
    def module():
        """Return the module of the study."""
        return load_study(name)

    return module


def assert_contains(text, *parts):
    """Assert that a text contains all parts, irrespective of line breaks."""
    text = " ".join(text.split())
    missing = [part for part in parts if part not in text]
    assert not missing, f"{missing} not in: {text}"
