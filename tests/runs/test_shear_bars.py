"""The bars of random joints and rigs that slip part by part, against meshes and steps that are far finer."""

import numpy as np
import pytest
from shear_bars import misses


@pytest.mark.parametrize("kind, seeds", [("joint", (2000, 2036)), ("rig", (3, 505))])
def test_always_the_bars_of_random_pieces_behind_their_shear_hold(kind, seeds):
    """Of joint 2036 no node slips; the peaks of rig 3 agreed on two meshes by chance."""
    for seed in seeds:
        found = misses(kind, seed)
        assert len(found) >= 7 and max(found.values()) <= 1, (seed, found)


@pytest.mark.slow
@pytest.mark.parametrize("kind, first, count", [("joint", 2000, 60), ("rig", 500, 40)])
def test_always_19_of_20_bars_of_random_pieces_behind_their_shear_hold(kind, first, count):
    found = np.concatenate([list(misses(kind, seed).values()) for seed in range(first, first + count)])
    assert (found <= 1).mean() >= 0.95 and (found <= 2).mean() >= 0.97
