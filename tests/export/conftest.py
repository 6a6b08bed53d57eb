"""Results of one run, shared by the tests of exports."""

import pytest
from command_line import run_cli
from exported import CROWNED


@pytest.fixture(scope="session")
def bench_folder(tmp_path_factory):
    """Return the results folder of a crowned, coated pair that slips."""
    base = tmp_path_factory.mktemp("bench")
    (base / "bench.toml").write_text(CROWNED, "utf-8")
    answer = run_cli("run", base / "bench.toml", "-o", base / "out", "-q")
    assert answer.code == 0, answer.err
    return base / "out"
