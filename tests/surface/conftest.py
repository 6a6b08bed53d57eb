"""Measured data for the tests of surfaces."""

import os
from pathlib import Path

import pytest
from command_line import read_json


@pytest.fixture(scope="session")
def data_folder() -> Path:
    """Return the folder of measured data."""
    return Path(os.environ["PATCHFEM_DATA"])


@pytest.fixture(scope="session")
def reference_values(data_folder) -> dict:
    """Return the reference values of the measured data."""
    return read_json(data_folder / "truth.json")
