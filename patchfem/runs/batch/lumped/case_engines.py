"""Engine by which `pieces` computes many cases with rigid friction or with friction elements.

In: a Model. Out: EXACT for rigid friction, PIECES for elements, or None for cases that are computed otherwise.
"""

from typing import NamedTuple

from ...rig import engines
from ...rig.costs import intervals_per_cycle
from ...rig.engines import BALANCE_ROUND_OFF, find_obstacle_of_map

MAX_INTERVALS = 1e5  # time intervals per cycle above which a case is computed by a single run


class CaseEngine(NamedTuple):
    """Engine of a batch: name, relative error of every measure, largest error of the energy balance."""

    name: str
    min_relative_error: float = 1e-9
    max_balance_error: float = BALANCE_ROUND_OFF


EXACT = CaseEngine("exact")
PIECES = CaseEngine("piecewise")


def choose_engine(model) -> CaseEngine | None:
    """Return the engine of a batch that contains a model, or None."""
    if (
        engines.choose_engine(model) is not engines.HYBRID
        or intervals_per_cycle(model) > MAX_INTERVALS
    ):
        return None
    for engine in (EXACT, PIECES):
        if not find_obstacle_of_map(engine.name, model):
            return engine
    return None
