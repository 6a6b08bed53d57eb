"""A small fraction of the trials of every campaign.

`python tests/support/torture --campaign NAME --share 1` runs all trials of a campaign.
"""

import pytest
from torture.driver import CAMPAIGNS, run_trial

SEED = 4
COUNTS = {"grammar": 4, "bytes": 3, "hostile": 4}


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_always_sample_of_campaign_passes(name, tmp_path):
    """A small sample of every campaign finds no fault."""
    for index in range(COUNTS[name]):
        run_trial(name, SEED, index, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", CAMPAIGNS)
def test_always_two_percent_of_campaign_pass(name, tmp_path):
    """Two percent of the trials of every campaign find no fault."""
    for index in range(round(0.02 * CAMPAIGNS[name].size)):
        run_trial(name, 2, index, tmp_path)
