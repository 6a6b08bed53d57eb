"""What a run from yield to yield costs beside a march, before anything runs."""

from math import inf, pi, sqrt

import numpy as np

from ....effects import has
from ....friction.record import law_from
from ....model.model import Model
from ....structure.drive_sizes import fastest
from ...effort import steps_per_cycle

PIECE, PIECE_MODE = 4e-7, 2e-7  # seconds of a piece of the motion, and of each further mode in it
STEP, STEP_ELEMENT = 4e-7, 1e-9  # seconds of a step of the march, and of each element in it
REACH = 3.0  # of `dynamics.piecewise.series_kernels`


def sizes(model: Model) -> tuple:
    """(elements, stiffness [N/m] of those of the stiffest interface) that the interfaces of a rig have, estimated."""
    count, stiff = 0, 0.0
    for one in model.rig.interfaces:
        load = model.nominal_load if one.load is None else one.load
        if has(one.numbers.law, "set-valued"):
            most, mine = inf, 1
        else:
            element = law_from(one.numbers, load).element(load)
            mine, most = int(element.numbers[1]), float(element.numbers[2:2 + int(element.numbers[1])].sum())
        if model.soft:
            from ....model.patch import CHOSEN_POINTS, block_shear

            patch = model.patch
            most = 1 / (1 / most + 1 / block_shear(patch))
            mine = CHOSEN_POINTS if patch.chosen else round(patch.length / patch.size) + 1
        count, stiff = count + mine, max(stiff, most)
    return count, stiff


def pieces(model: Model) -> float:
    """Pieces of the motion per cycle of the drive at most: of its fastest rate while all holds, and of every yield."""
    modes, drive = model.rig.modes, model.rig.drive
    count, stiff = sizes(model)
    reach = float((np.asarray(modes.interfaces)**2).sum(axis=1).max(initial=0.0)) / modes.mass
    damping = float(np.linalg.norm(modes.dampers, 2))
    rate = damping / 2 + sqrt(damping**2 / 4 + float(modes.omega.max())**2 + stiff * reach)
    rows = 0 if drive.segments else len(drive.breaks) / model.rig.cycles
    return max(rate * drive.period, 2 * pi * fastest(drive)) / REACH + 2 * count * fastest(drive) + 2 + rows


def seconds_of_pieces(model: Model) -> float:
    """Estimated seconds of a run from yield to yield."""
    each = PIECE + PIECE_MODE * (model.rig.modes.omega.size - 1)
    return each * pieces(model) * model.rig.cycles


def seconds_of_steps(model: Model) -> float:
    """Estimated seconds of a march with the coarser runs of its error, which has none of the exactness."""
    count, many = sizes(model)[0], len(model.rig.interfaces)
    return 1.75 * steps_per_cycle(model) * model.rig.cycles * many * (STEP + STEP_ELEMENT * count)
