"""The motion that a run of one mode settles to, where the short way of `steady_kernels` finds it."""

import numpy as np

from ...compiled import load
from ..piecewise.elements import table_of
from ..piecewise.plant import clock_of, plant_of
from .names_kernels import AMOUNT, MOST, RESIDUAL
from .room import rig_of, room_of, search_room, serves


def settled_alone(modes, drive, groups, start, memory) -> tuple | None:
    """(amplitude [m], residual, multipliers (m,)) of the periodic motion that a run from a state at phase 0 of a sine
    settles to, as `piecewise.steady.settled` has them; None where the short way does not lead there."""
    plant, clock, table = plant_of(modes), clock_of(drive, len(groups)), table_of(groups)
    if not serves(plant, clock, np.inf):
        return None
    answer, slope, motion = np.zeros(3), np.zeros((MOST, MOST)), np.array([start.z, start.v])
    kernels = load("dynamics.piecewise_one.steady_kernels")
    if not kernels.settled(motion, rig_of(plant), clock.segments[0], table, memory, clock, room_of(),
                           search_room(int(table.count[0])), answer, slope):
        return None
    return float(answer[AMOUNT]), float(answer[RESIDUAL]), np.linalg.eigvals(slope)
