"""CPU times of the stages of a run on one core, by which engines are chosen.

Plans state them, and runs that would take too long are refused.

All constants were measured on one machine with plain scenes and compiled code; `measure_machine_time_ratio` compares another
machine with it. The modules that count the work define its units: `runs.rig.costs`, `runs.rig.bond_lists`,
`runs.bench.engine`, `friction.bonds.engines`, `runs.patch.plan` and `elasticity.grid_fronts`.
"""

from time import process_time

import numpy as np

# every constant in ..._SECONDS is a CPU time [s]; its comment names the unit of work that takes this time
START_SECONDS = 0.5  # per run, to start it and to write its files and its page

# event-driven solution, whose motion consists of closed-form pieces between events
PIECE_SECONDS = 2.5e-7  # per piece of one mode and one interface
PIECE_MODE_SECONDS = 1.5e-7  # per piece and further mode
PIECE_INTERFACE_SECONDS = 3e-7  # per piece and further interface
PIECE_ELEMENT_SECONDS = 3e-9  # per piece and element
MAX_PIECE_SECONDS = 1e-6  # per piece, an upper bound by which the engine is chosen
READ_PIECE_SECONDS = 4e-6  # per piece of the last cycles, whose histories are kept
PYTHON_PIECE_SECONDS = 7e-5  # per piece without compilation, times (modes + 1)(interfaces + 1)
PYTHON_SAMPLE_TIME_RATIO = 0.1  # time of a sample of the motion / time of a piece, as Python
PYTHON_READ_TIME_RATIO = 0.5  # time to read the histories of a piece / time of the piece, as Python

# march in time
CYCLE_SECONDS = 3e-4  # per cycle of a march with elements
STEP_SECONDS = 4.3e-7  # per step of a march with elements
STEP_ELEMENT_SECONDS = 9e-10  # per step and element
BOND_STEP_SECONDS = 7e-7  # per step of one mode with bonds
STEP_MODE_SECONDS = 1e-7  # per step and further mode with bonds
GROWING_BOND_STEP_FACTOR = 3.0  # time of a step in which bonds grow / time of a step
# time of a step per interface, of several / time of a step with one interface
INTERFACE_STEP_FACTOR = 2.5
GROOVE_STEP_SECONDS = 3e-6  # per step over grooves
PRESSING_STEP_SECONDS = 4.5e-5  # per step of pieces that heave or pitch
PRESSING_NODE_SECONDS = 1.7e-7  # per step and node of pieces that heave or pitch
BOND_NODE_SECONDS = 6e-8  # per step and node, if each node has separate bonds
SLIP_NODE_SECONDS = 3e-9  # per step and node of elements in partial slip

SMOOTH_RUN_SECONDS = 0.02  # per run of high order, besides its steps
SMOOTH_STEP_SECONDS = 2e-6  # per step of high order
KEPT_SAMPLE_SECONDS = 8e-6  # per sample of the last cycles of a march, which is kept and written
KEPT_EVENT_SAMPLE_SECONDS = 2.5e-6  # per sample of the last cycles of the event-driven solution

# points on a curve of steady motions; plans of fourteen curves (templates, and rigs of ten modes) were right within a
# factor of 3
CLOSED_POINT_SECONDS = 3e-4  # per point in closed form
MAPPED_POINT_SECONDS = 3e-3  # per point by the map of events or yields
STICKING_PIECE_SECONDS = 4e-5  # per piece during which all elements stick
# per piece during which all elements stick, and per squared number of modes
STICKING_MODES_SECONDS = 4e-7
EVENT_SECONDS = 1.5e-5  # per event and mode
BALANCE_POINT_SECONDS = 0.012  # per point by harmonic balance
FLOWING_LAW_POINT_SECONDS = 0.1  # additional time per point for a law with an evolving state
BALANCE_UNKNOWN_SECONDS = 8e-10  # per cubed number of unknowns of a balance
# Floquet multipliers of a law whose slope changes all the time, per cubed number of state variables: of a law of the
# speed alone, and of a law with an evolving state
MULTIPLIER_SECONDS = (2.5e-6, 4e-6)

# condensation of the pieces of a patch to their interface, fitted to 15 grids of 21 x 20 to 301 x 201 nodes in both
# directions, which took 0.85 to 1.07 of the predicted time
CONDENSE_CALL_SECONDS = 1.4e-3  # per condensation
CONDENSE_SHAPE_SECONDS = 9.8e-5  # per stack of equal frontal matrices
CONDENSE_FRONT_SECONDS = 4.5e-6  # per frontal matrix
CONDENSE_ENTRY_SECONDS = 1.38e-8  # per entry of the triangular factors
CONDENSE_OPERATION_SECONDS = 1.22e-11  # per floating-point operation

# lists of bonds, which are passed through once or more in a step
# per strip and pass, by the form of the list (`friction.bonds.list_forms_kernels`)
STRIP_SECONDS = (3e-10, 3e-9, 2e-9, 3e-9)
ANY_ORDER_STRIP_SECONDS = 2.5e-8  # per strip and pass of an order that needs a power
PASS_SECONDS = 1.5e-7  # per pass besides its strips
LIST_STEP_SECONDS = 5e-7  # per step besides its passes
RECURSION_STEP_SECONDS = 3e-8  # per step of the recursion

# slide of a bench
SAMPLE_SECONDS = 1e-7  # per sample, for a closed-form solution and for a law with one element
LAW_STEP_SECONDS = 6e-5  # per sample of a law that NumPy integrates step by step
PATH_STEP_SECONDS = 1.2e-3  # per sample of a sum over the strips of the path
PATH_STRIP_SECONDS = 2e-6  # per sample and strip of the path
PATH_POINT_SECONDS = 8e-9  # per sample, strip and point of the path

# patch
PATCH_SECONDS = 0.15  # per patch besides the condensation, including its fields
FIELDS_SECONDS = 0.1  # per patch, for its stress fields
CONDENSING_FACTOR = 3.0  # time of a patch / predicted time of one condensation
OUTLINE_CONDENSING_FACTOR = 2.2  # CONDENSING_FACTOR of pieces with cells beyond the interface
FRAMES_SECONDS = 0.35  # per patch that moves, for its frames
FRAME_NODE_SECONDS = 3e-5  # per node of the finest grids, for the frames

# CPU time [s] of the work of `measure_machine_time_ratio` on the reference machine
REFERENCE_WORK_SECONDS = 0.0214


def predict_shear_mode_step(points: int, modes: int, *, load_varies: bool = False) -> float:
    """Predict the CPU time [s] of a time step of bonds at points that shear modes couple.

    Time steps of the rig of the report and of its bench with 65 to 425 points took 0.7 to 1.5 times as long.

    Parameters
    ----------
    points : int
        Number of points with bonds.
    modes : int
        Number of shear modes.
    load_varies : bool
        Whether the loads of the points change with the motion, as over grooves.

    Returns
    -------
    float
    """
    if load_varies:
        return 7e-6 + points * (2e-8 + 2e-9 * modes)
    return 1e-6 + points * (1e-9 + 5e-10 * modes)


def measure_machine_time_ratio() -> float:
    """Measure the CPU time of a standard task, relative to that on the reference machine.

    The task is a loop, matrix products and linear solves, as in a run. The shortest of five timings counts.
    """
    matrix = np.arange(160.0**2).reshape(160, 160) % 7.0 + 200 * np.eye(160)
    min_seconds = np.inf
    for _ in range(5):
        start_time = process_time()
        for _ in range(8):
            np.linalg.solve(matrix, matrix @ matrix)
            sum(k * k for k in range(20000))
        min_seconds = min(min_seconds, process_time() - start_time)
    return min_seconds / REFERENCE_WORK_SECONDS
