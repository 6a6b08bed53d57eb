"""What work takes: the one table of CPU seconds on one core, which plans, refusals and the choice of an engine read.

Every row was measured on one machine, for the run of a plain scene with its cache full; `speed` says how a machine
compares with it. What a piece, a step, a strip or a front is, those say who count them: `runs.rig.costs`,
`runs.rig.lists`, `runs.bench.engine`, `friction.bonds.engines`, `runs.patch.plan` and `elasticity.grid_fronts`.
"""

from time import process_time

import numpy as np

START = 0.5  # of a run until it begins, and of its files and its page

# of a piece of a motion from event to event, of each further mode and interface in it, of each element; of one at most,
# and of one of the last cycles, which are kept whole; as Python per mode + 1 and interface + 1, and of that a sample
# that is shown and a piece that is read
PIECE, PIECE_MODE, PIECE_FACE, PIECE_ELEMENT = 2.5e-7, 1.5e-7, 3e-7, 3e-9
MOST_PIECE, READ_PIECE = 1e-6, 4e-6
PYTHON_PIECE, PYTHON_SAMPLE, PYTHON_READ = 7e-5, 0.1, 0.5

# of a march of elements: a cycle, a step, each element in it; of bonds a step of one mode, of each further one, times
# where bonds grow and for each of several interfaces; of a sample over grooves
CYCLE, STEP, STEP_ELEMENT = 3e-4, 4.3e-7, 9e-10
BOND_STEP, STEP_MODE, GROWS, JOINT, CLIMB = 7e-7, 1e-7, 3.0, 2.5, 3e-6
PRESSING_STEP, PRESSING_NODE = 4.5e-5, 1.7e-7  # of a step of pieces that heave or pitch, and per node of theirs
FIELD_NODE, SLIP_NODE = 6e-8, 3e-9  # of a step per node: of bonds at every node, of elements for partial slip

SMOOTH_STEP, SMOOTH = 2e-6, 0.02  # of a step of high order, and of such a run besides
KEPT_SAMPLE = 8e-6, 2.5e-6  # of a sample of the last cycles, kept, read and written: of steps, from event to event

# of a point of steady motions: in closed form, by the map of events or yields; of a piece while all holds, the same per
# squared number of modes, of an event per mode; by a balance, of a law with a state that flows besides, and per cubed
# number of its unknowns; of the multipliers, per cubed size of the state, where the slope of a law changes all along,
# of the speed alone or of such a state: within a factor 3 of fourteen curves of the templates and of ten modes
CLOSED_POINT, MAPPED_POINT, RINGING_PIECE, RINGING_MODES, EVENT = 3e-4, 3e-3, 4e-5, 4e-7, 1.5e-5
BALANCED_POINT, FLOWING_POINT, BALANCE = 0.012, 0.1, 8e-10
MULTIPLIERS = 2.5e-6, 4e-6

# of the pieces of a patch: of a call, a shape of its fronts, a front, an entry of the factors, an operation; fitted to
# 15 grids of 21 x 20 to 301 x 201 nodes, each both ways: 0.85 to 1.07 of what they took
PER_CALL, PER_SHAPE, PER_FRONT, PER_ENTRY, PER_OPERATION = 1.4e-3, 9.8e-5, 4.5e-6, 1.38e-8, 1.22e-11

# of a list of bonds: per strip and pass, of an order that takes a power, of a pass and of a
# step besides; of a step of the recursion
STRIP = 3e-10, 3e-9, 2e-9, 3e-9  # by the number of the form, `friction.bonds.list_numbers`
ANY_ORDER, PASS, LIST_STEP, RECURSION = 2.5e-8, 1.5e-7, 5e-7, 3e-8

# of a slide: a sample in closed form or of one element, of a law stepped in NumPy, of a sum over the strips of the
# path, per strip and per strip and point
SAMPLE, LAW_STEP, PATH_STEP, PATH_STRIP, PATH_POINT = 1e-7, 6e-5, 1.2e-3, 2e-6, 8e-9

# of a patch with its fields, and of these alone; per predicted second of condensing it, and of pieces beyond the
# interface, whose predicted seconds are those of any cells already; of the frames of one that moves, and per node of
# the finest grids
PRESSED, FIELDS, CONDENSED, OUTLINED = 0.15, 0.1, 3.0, 2.2
MOVING, MOVING_NODE = 0.35, 3e-5

OURS = 0.0214  # of the work of `speed` on the machine of the table


def behind_modes(points: int, modes: int, load_varies: bool = False) -> float:
    """Seconds of a step of `points` bonds behind so many shear modes; load_varies: their loads change with the motion,
    also over grooves. Within 0.7 to 1.5 of 65 to 425 points of the rig of the report and of its bench."""
    if load_varies:
        return 7e-6 + points * (2e-8 + 2e-9 * modes)
    return 1e-6 + points * (1e-9 + 5e-10 * modes)


def speed() -> float:
    """CPU seconds of this machine over those of the table [1], by the least of five goes at a small work of the kinds
    that runs do: a loop, a product and a solve."""
    matrix, least = np.arange(160.0**2).reshape(160, 160) % 7.0 + 200 * np.eye(160), np.inf
    for _ in range(5):
        begin = process_time()
        for _ in range(8):
            np.linalg.solve(matrix, matrix @ matrix)
            sum(k * k for k in range(20000))
        least = min(least, process_time() - begin)
    return least / OURS
