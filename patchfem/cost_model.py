"""CPU seconds on one core that pieces of work take: read by plans, by refusals and by the choice of an engine.

All were measured on one machine, for runs of plain scenes with a full cache; `speed` compares a machine with it. The
modules that count the work define its units: `runs.rig.costs`, `runs.rig.lists`, `runs.bench.engine`,
`friction.bonds.engines`, `runs.patch.plan` and `elasticity.grid_fronts`.
"""

from time import process_time

import numpy as np

START = 0.5  # s of a run until it begins, and of its files and its page

# motion from event to event, in pieces
PIECE = 2.5e-7  # s per piece of one mode and one interface
PIECE_MODE = 1.5e-7  # s per piece and further mode
PIECE_FACE = 3e-7  # s per piece and further interface
PIECE_ELEMENT = 3e-9  # s per piece and element
MOST_PIECE = 1e-6  # s per piece at most, by which the engine is chosen
READ_PIECE = 4e-6  # s per piece of the last cycles, which are kept whole
PYTHON_PIECE = 7e-5  # s per piece as Python, times (modes + 1) * (interfaces + 1)
PYTHON_SAMPLE = 0.1  # fraction of PYTHON_PIECE that a sample of the shown motion takes
PYTHON_READ = 0.5  # fraction of the seconds of a piece as Python that reading it takes

# march in time
CYCLE = 3e-4  # s per cycle of a march of elements
STEP = 4.3e-7  # s per step of a march of elements
STEP_ELEMENT = 9e-10  # s per step and element
BOND_STEP = 7e-7  # s per step of one mode with bonds
STEP_MODE = 1e-7  # s per step and further mode with bonds
GROWS = 3.0  # factor of a step in which bonds grow
JOINT = 2.5  # factor of a step per interface, if there are several
CLIMB = 3e-6  # s per step over grooves
PRESSING_STEP = 4.5e-5  # s per step of pieces that heave or pitch
PRESSING_NODE = 1.7e-7  # s per step and node of pieces that heave or pitch
FIELD_NODE = 6e-8  # s per step and node, if bonds are followed at every node
SLIP_NODE = 3e-9  # s per step and node of elements in partial slip

SMOOTH = 0.02  # s of a run of high order besides its steps
SMOOTH_STEP = 2e-6  # s per step of high order
# s per sample of the last cycles that is kept, read and written, of an engine with steps
KEPT_SAMPLE = 8e-6
# s per sample of the last cycles, of an engine that goes from event to event
KEPT_EVENT_SAMPLE = 2.5e-6

# one point of a curve of steady motions; plans hold within a factor 3 for fourteen curves of the templates and of ten
# modes
CLOSED_POINT = 3e-4  # s of a point in closed form
MAPPED_POINT = 3e-3  # s of a point by the map of events or yields
RINGING_PIECE = 4e-5  # s per piece while all elements stick
RINGING_MODES = 4e-7  # s per piece while all elements stick and per squared number of modes
EVENT = 1.5e-5  # s per event and mode
BALANCED_POINT = 0.012  # s of a point by harmonic balance
FLOWING_POINT = 0.1  # s of a point by harmonic balance for a law with a state that flows, besides
BALANCE = 8e-10  # s per cubed number of unknowns of a balance
# s of the multipliers per cubed size of the state, if the slope of a law changes all along: of a law of the speed
# alone, and of a law with a state that flows
MULTIPLIERS = (2.5e-6, 4e-6)

# condensing of the pieces of a patch, fitted to 15 grids of 21 x 20 to 301 x 201 nodes, each both ways, which took 0.85
# to 1.07 of this
PER_CALL = 1.4e-3  # s per call
PER_SHAPE = 9.8e-5  # s per shape of the fronts
PER_FRONT = 4.5e-6  # s per front
PER_ENTRY = 1.38e-8  # s per entry of the factors
PER_OPERATION = 1.22e-11  # s per operation

# lists of bonds
# s per strip and pass, by the form of the list (`friction.bonds.list_numbers`)
STRIP = (
    3e-10,
    3e-9,
    2e-9,
    3e-9,
)
ANY_ORDER = 2.5e-8  # s per strip and pass of an order that takes a power
PASS = 1.5e-7  # s per pass besides its strips
LIST_STEP = 5e-7  # s per step besides its passes
RECURSION = 3e-8  # s per step of the recursion

# slide of a bench
SAMPLE = 1e-7  # s per sample in closed form or of one element
LAW_STEP = 6e-5  # s per sample of a law that is stepped in NumPy
PATH_STEP = 1.2e-3  # s per sample of a sum over the strips of the path
PATH_STRIP = 2e-6  # s per sample and strip of the path
PATH_POINT = 8e-9  # s per sample, strip and point of the path

# patch
PRESSED = 0.15  # s of a patch besides condensing, its fields included
FIELDS = 0.1  # s of the fields of a patch
CONDENSED = 3.0  # s per predicted second of condensing
OUTLINED = 2.2  # s per predicted second of condensing pieces with cells beyond the interface
MOVING = 0.35  # s of the frames of a patch that moves
MOVING_NODE = 3e-5  # s of the frames per node of the finest grids

# CPU s of the work of `speed` on the machine where all this was measured
REFERENCE_SPEED_WORK = 0.0214


def behind_modes(points: int, modes: int, load_varies: bool = False) -> float:
    """Return the seconds of a step of bonds behind shear modes.

    Parameters
    ----------
    points : int
        Points with bonds. For 65 to 425 points of the rig of the report and of its bench, steps took 0.7 to 1.5 of
        this.
    modes : int
        Shear modes.
    load_varies : bool
        Whether the loads of the points change with the motion, as they do over grooves.
    """
    if load_varies:
        return 7e-6 + points * (2e-8 + 2e-9 * modes)
    return 1e-6 + points * (1e-9 + 5e-10 * modes)


def speed() -> float:
    """Return the CPU seconds of this machine over those of the machine of the constants.

    The work is of the kinds that runs do, a loop, a product and a solve; the shortest of five timings counts.
    """
    matrix = np.arange(160.0**2).reshape(160, 160) % 7.0 + 200 * np.eye(160)
    shortest = np.inf
    for _ in range(5):
        begin = process_time()
        for _ in range(8):
            np.linalg.solve(matrix, matrix @ matrix)
            sum(k * k for k in range(20000))
        shortest = min(shortest, process_time() - begin)
    return shortest / REFERENCE_SPEED_WORK
