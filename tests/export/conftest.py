"""One run for all export tests."""

import pytest
from command_line import cli
from exported import CROWNED


@pytest.fixture(scope="session")
def bench(tmp_path_factory):
    """The results folder of a crowned, coated pair that slips."""
    base = tmp_path_factory.mktemp("bench")
    (base / "bench.toml").write_text(CROWNED, "utf-8")
    answer = cli("run", base / "bench.toml", "-o", base / "out", "-q")
    assert answer.code == 0, answer.err
    return base / "out"
