"""Properties of the printed law that direct, truncated and merged bond lists share.

Closed forms (checks C5, C6 and C8), bounded memory over long runs, and equal marches.
"""

import numpy as np
import pytest
from list_paths import STATUS, march_list

from patchfem.friction import Bonds

GROWTH = {"ratio": 0.5, "rest_growth": 0.3, "slip_growth": 0.05, "rest_speed": 1e-2}
LIST_OPTIONS = {"direct": {}, "truncated": {"tail": 1e-9}, "merged": {"tail": 1e-9, "merge": 0.01}}
each_list = pytest.mark.parametrize("options", LIST_OPTIONS.values(), ids=LIST_OPTIONS)


def printed_law(order, growth=None):
    """Return the printed law with unit friction limit and bond length."""
    return Bonds(1.0, 1.0, float(order), "report", initial=0.0, **(growth or {}))


@pytest.mark.share(0, 5)
@each_list
@pytest.mark.parametrize("order", [0, 1])
def test_exact_loaded_bonds_heal_at_rest(order, options):
    """The force of loaded bonds at rest is 0.5, then 0.81606 and 0.93233 after one and two growth times (check C8)."""
    law = printed_law(
        order, {"ratio": 0.5, "rest_growth": 10.0, "slip_growth": 1e-3, "rest_speed": 1.0}
    )
    path = np.append(40 - np.geomspace(40, 1e-5, 1500), [40 - 1e-5] * 2)
    forces = march_list(law, path, np.append(np.full(1499, 1e-9), [0.1, 0.1]), **options).after[-3:]
    assert forces == pytest.approx([0.5, 0.81606, 0.93233], abs=1e-3 if order == 0 else 1e-4)


@pytest.mark.share(0)
@pytest.mark.parametrize("count", [20_000, pytest.param(100_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("growth", [{}, GROWTH])
def test_always_long_path_keeps_bounded_list(growth, count):
    """A long random path keeps fewer than 1500 strips and ends with the force of its last 1500 steps alone."""
    steps = np.random.default_rng(3).normal(0, 0.05, count)
    steps[::1000] *= 400.0
    law = printed_law(1, growth)
    result = march_list(law, np.concatenate([[0.0], np.cumsum(steps)]), tail=1e-9, merge=0.01)
    last_path = np.concatenate([[0.0], np.cumsum(steps[-1500:])])
    assert result.status[STATUS.max_strips] < 1500
    assert result.after[-1] == pytest.approx(march_list(law, last_path).after[-1], abs=5e-5)
