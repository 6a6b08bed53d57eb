"""A small fraction of the trials of every campaign.

`python tests/support/torture --campaign NAME --share 1` runs all trials of a campaign.
"""

import os

import pytest
from torture import driver
from torture.driver import CAMPAIGNS, run_campaigns

from patchfem.__main__ import run_command

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="a trial is a forked process")
ALWAYS = {
    "grammar": 0.0005,
    "bytes": 0.001,
    "hostile": 0.004,
}
SEED = 4


def run_trials(names, fraction, seed):
    """Run a fraction of the trials of campaigns and return their rows; fail if any message is
    reported."""
    messages = []
    rows = run_campaigns(run_command, fraction, names, seed, None, messages.append)
    assert not messages, "\n".join(messages)
    return rows


@pytest.fixture(scope="module", autouse=True)
def warm_up(tmp_path_factory):
    """Run the warm-up of the driver once for all campaigns."""
    driver.preload(run_command, tmp_path_factory.mktemp("warm"))
    original_warm = driver.preload
    driver.preload = lambda command, folder: None
    yield
    driver.preload = original_warm


@pytest.mark.parametrize("name", ALWAYS)
def test_always_sample_of_campaign_passes(name):
    """A small sample of every campaign finds no fault and has the requested number of trials."""
    (row,) = run_trials([name], ALWAYS[name], SEED)
    assert row.tried == max(1, round(ALWAYS[name] * CAMPAIGNS[name].size))


@pytest.mark.slow
@pytest.mark.parametrize("name", CAMPAIGNS)
def test_always_two_percent_of_campaign_pass(name):
    """Two percent of the trials of every campaign find no fault."""
    run_trials([name], 0.02, 2)
