"""Truths of the printed law that the compiled list must meet whether it keeps, cuts off or merges its strips: closed
forms (checks C5, C6, C8), bounded memory, and trials that leave no trace."""

import numpy as np
import pytest
from list_paths import STATUS, follow_list
from march_paths import OMEGA, one_mode

from patchfem.core import SineDrive
from patchfem.dynamics import bond_list_model
from patchfem.dynamics.march.march import march
from patchfem.friction import Bonds
from patchfem.friction.bonds.quadrature import cutoff_age

GROWS = {"ratio": 0.5, "rest_growth": 0.3, "slip_growth": 0.05, "rest_speed": 1e-2}
WAYS = {"direct": {}, "truncated": {"tail": 1e-9}, "merged": {"tail": 1e-9, "merge": 0.01}}
way = pytest.mark.parametrize("knobs", WAYS.values(), ids=WAYS)


def printed(order, growth=None):
    return Bonds(1.0, 1.0, float(order), "report", initial=0.0, **(growth or {}))


@pytest.mark.share(0, 2, 5)
@way
@pytest.mark.parametrize("order", [0, 1])
def test_exact_c8_healing_under_load(order, knobs):
    """l_k = 1e-3, eps_k = 0.5, slid slowly grown then held: 0.5, then 0.81606 and 0.93233 after one and two e-folds."""
    law = printed(
        order, {"ratio": 0.5, "rest_growth": 10.0, "slip_growth": 1e-3, "rest_speed": 1.0}
    )
    path = np.append(40 - np.geomspace(40, 1e-5, 1500), [40 - 1e-5] * 2)
    got = follow_list(law, path, np.append(np.full(1499, 1e-9), [0.1, 0.1]), **knobs).after[-3:]
    assert got == pytest.approx([0.5, 0.81606, 0.93233], abs=1e-3 if order == 0 else 1e-4)


@pytest.mark.share(0)
@pytest.mark.parametrize("count", [20_000, pytest.param(100_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("growth", [{}, GROWS])
def test_always_long_runs_stay_bounded_and_right(growth, count):
    """Many random steps, then the force of the same bonds by the list that only knows the last of the path."""
    steps = np.random.default_rng(3).normal(0, 0.05, count)
    steps[::1000] *= 400.0
    law = printed(1, growth)
    got = follow_list(law, np.concatenate([[0.0], np.cumsum(steps)]), tail=1e-9, merge=0.01)
    tail = np.concatenate([[0.0], np.cumsum(steps[-1500:])])
    assert got.status[STATUS.max_strips] < 1500
    assert got.after[-1] == pytest.approx(follow_list(law, tail).after[-1], abs=5e-5)


@pytest.mark.parametrize(
    "order, growth",
    [(0, {}), (1, {"ratio": 0.6, "rest_growth": 10.0, "slip_growth": 5e-6, "rest_speed": 1e-4})],
)
def test_exact_marches_of_every_list_agree(order, growth):
    law = Bonds(0.4, 1e-4, float(order), "report", initial=0.0, **growth)
    limit = 0.4 * 98.0665
    runs = [
        march(
            one_mode(OMEGA, 0.01, 1.0),
            SineDrive(5 * 9.80665, OMEGA),
            bond_list_model(law, limit, reach, merge),
            3,
            200,
            window=3,
        )
        for reach, merge in ((np.inf, 0.0), (cutoff_age(law.order, 1e-9), 0.005))
    ]
    size = np.ptp(runs[0].window.slide)
    assert runs[1].window.slide == pytest.approx(runs[0].window.slide, abs=2e-6 * size)
    assert runs[1].window.force == pytest.approx(runs[0].window.force, abs=3e-5 * limit)
    for name in ("created", "dissipated", "friction"):
        assert runs[1].ledger[name] == pytest.approx(runs[0].ledger[name], rel=1e-4, abs=1e-9)
