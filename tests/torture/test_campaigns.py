"""A small share of every campaign, always; the whole of one by `patchfem torture --share 1 --campaign NAME`."""

import os

import pytest

from patchfem.__main__ import _guarded
from patchfem.torture.driver import CAMPAIGNS, torture

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="a trial is a forked process")
ALWAYS = {"grammar": 0.002, "bytes": 0.002}


def held(names, share, seed):
    said = []
    rows = torture(_guarded, share, names, seed, None, said.append)
    assert not said, "\n".join(said)
    return rows


@pytest.mark.parametrize("name", ALWAYS)
def test_always_holds_a_share(name):
    (row,) = held([name], ALWAYS[name], 1)
    assert row.tried == max(1, round(ALWAYS[name] * CAMPAIGNS[name].size))


@pytest.mark.slow
@pytest.mark.parametrize("name", CAMPAIGNS)
def test_always_holds_a_fiftieth(name):
    held([name], 0.02, 2)
