"""Results of one run, shared by the tests of exports."""

import pytest
from chromium import Chromium, find_chromium
from command_line import run_successfully
from scene_texts import CROWNED_BENCH as CROWNED


@pytest.fixture(scope="session")
def bench_folder(tmp_path_factory):
    """Return the results folder of a crowned, coated pair that slips."""
    base = tmp_path_factory.mktemp("bench")
    (base / "bench.toml").write_text(CROWNED, "utf-8")
    run_successfully("run", base / "bench.toml", "-o", base / "out", "-q")
    return base / "out"


@pytest.fixture(scope="session")
def chromium(tmp_path_factory):
    """Return a headless browser; skip the test if none is installed."""
    if find_chromium() is None:
        pytest.skip("Chromium is not installed")
    browser = Chromium(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()
