"""A small share of every campaign, always; the whole: `python tests/support/torture --campaign NAME --share 1`."""

import os

import pytest
from torture import driver
from torture.driver import CAMPAIGNS, torture

from patchfem.__main__ import run_command

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="a trial is a forked process")
ALWAYS = {
    "grammar": 0.001,
    "bytes": 0.001,
    "words": 0.003,
    "energy": 0.003,
    "profiles": 0.002,
    "signals": 0.002,
    "paths": 0.003,
    "rows": 0.002,
    "loops": 0.002,
    "universal": 0.001,
    "hostile": 0.008,
}
SEED = 4
SEEDS = {"energy": 25}  # tanh, elastic-plastic and bonds: no loop that no other test compiles


def held(names, share, seed):
    said = []
    rows = torture(run_command, share, names, seed, None, said.append)
    assert not said, "\n".join(said)
    return rows


@pytest.fixture(scope="module", autouse=True)
def warm_once(tmp_path_factory):
    """What the driver does before its first campaign, once for all of them."""
    driver.warm(run_command, tmp_path_factory.mktemp("warm"))
    kept = driver.warm
    driver.warm = lambda command, place: None
    yield
    driver.warm = kept


@pytest.mark.parametrize("name", ALWAYS)
def test_always_holds_a_share(name):
    (row,) = held([name], ALWAYS[name], SEEDS.get(name, SEED))
    assert row.tried == max(1, round(ALWAYS[name] * CAMPAIGNS[name].size))


@pytest.mark.slow
@pytest.mark.parametrize("name", CAMPAIGNS)
def test_always_holds_a_fiftieth(name):
    held([name], 0.02, 2)
