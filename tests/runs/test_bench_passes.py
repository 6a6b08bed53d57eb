"""Passes of a bench with twice the steps end at the limit that the prediction of their number assumes."""

from types import SimpleNamespace

import pytest

from patchfem import build
from patchfem.runs import refine

BENCH = """
[normal]
load = "100 N"
[friction]
law = "elastic-plastic"
static = 0.3
bond_length = "1 um"
[slide]
kind = "sine"
amplitude = "4 um"
frequency = "30 Hz"
cycles = 2
"""


@pytest.mark.parametrize("first, n_passes", [(100, 6), (99, 6), (101, 5), (3200, 1), (3201, 0)])
def test_exact_number_of_doubled_steps(first, n_passes):
    """Steps are doubled as long as there are at most 6400, which is log2(6400 / steps) times."""
    model = build(BENCH)
    steps = [first]
    while model is not None:
        settings = SimpleNamespace(steps_per_cycle=steps[-1])
        model = refine._refine_steps(model, SimpleNamespace(settings=settings))
        if model is not None:
            steps.append(model.accuracy.steps_per_cycle)
    assert steps == [first * 2**k for k in range(n_passes + 1)]
