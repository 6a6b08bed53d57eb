"""CPU times of the stages of a run on one core, from which engines are selected.

Plans contain these times, and runs that would take too long are rejected.

All constants were measured on a reference machine with simple scenes and compiled code; `measure_machine_time_ratio`
compares another machine with it. The numbers of steps, pieces and nodes are counted in `runs.rig.costs`,
`runs.rig.bond_lists`, `runs.bench.engine`, `friction.bonds.engines` and `runs.patch.plan`.
"""

from time import process_time

import numpy as np

# Constants named ..._SECONDS are CPU times [s] per unit of work.
START_SECONDS = 0.5  # CPU time [s] per run to start it and to write its files and its report page

# Event-driven solution, whose motion consists of closed-form pieces between events.
# CPU time [s] per closed-form piece of a motion with one mode and one interface
PIECE_SECONDS = 2.5e-7
PIECE_MODE_SECONDS = 1.5e-7  # additional CPU time [s] per piece and further mode
PIECE_INTERFACE_SECONDS = 3e-7  # additional CPU time [s] per piece and further interface
PIECE_ELEMENT_SECONDS = 3e-9  # additional CPU time [s] per piece and elastic-plastic element
MAX_PIECE_SECONDS = 1e-6  # upper bound of the CPU time [s] per piece, used to select the engine
READ_PIECE_SECONDS = 4e-6  # CPU time [s] per piece of the last cycles, whose histories are stored
# CPU time [s] per piece, mode + 1 and interface + 1 without compilation
PYTHON_PIECE_SECONDS = 7e-5
# time of a sample of the motion over that of a piece, both without compilation
PYTHON_SAMPLE_TIME_RATIO = 0.1
# time to evaluate the histories of a piece over that of the piece, both without compilation
PYTHON_READ_TIME_RATIO = 0.5

# Time stepping.
CYCLE_SECONDS = 3e-4  # CPU time [s] per cycle of time stepping with elements
STEP_SECONDS = 4.3e-7  # CPU time [s] per time step with elements
STEP_ELEMENT_SECONDS = 9e-10  # additional CPU time [s] per time step and element
BOND_STEP_SECONDS = 7e-7  # CPU time [s] per time step of one mode with bonds
STEP_MODE_SECONDS = 1e-7  # additional CPU time [s] per time step and further mode with bonds
# time of a step with growing bonds over that of a step with constant bonds
GROWING_BOND_STEP_FACTOR = 3.0
# time of a step per interface, with several interfaces, over that with one interface
INTERFACE_STEP_FACTOR = 2.5
GROOVE_STEP_SECONDS = 3e-6  # CPU time [s] per time step over grooves
PRESSING_STEP_SECONDS = 4.5e-5  # CPU time [s] per time step of pieces that heave or pitch
# additional CPU time [s] per time step and node of pieces that heave or pitch
PRESSING_NODE_SECONDS = 1.7e-7
# additional CPU time [s] per time step and node if each node has separate bonds
BOND_NODE_SECONDS = 6e-8
# additional CPU time [s] per time step and node of elements in partial slip
SLIP_NODE_SECONDS = 3e-9

HYBRID_STEP_SECONDS = 4e-6  # CPU time [s] per step from event to event
HYBRID_MODES_SECONDS = 4e-8  # additional CPU time [s] per such step and pair of modes
KEPT_SAMPLE_SECONDS = 8e-6  # CPU time [s] per stored sample of the last cycles of time stepping
# CPU time [s] per stored sample of the last cycles of the event-driven solution
KEPT_EVENT_SAMPLE_SECONDS = 2.5e-6

# Points on a curve of steady-state motions. The predicted times of fourteen curves (templates, and rigs with ten modes)
# were correct within a factor of 3.
CLOSED_POINT_SECONDS = 3e-4  # CPU time [s] per point in closed form
# CPU time [s] per point by the map from event to event or from yield to yield
MAPPED_POINT_SECONDS = 3e-3
STICKING_PIECE_SECONDS = 4e-5  # CPU time [s] per piece during which all elements stick
# additional CPU time [s] per piece during which all elements stick, times the squared number of modes
STICKING_MODES_SECONDS = 4e-7
EVENT_SECONDS = 1.5e-5  # CPU time [s] per event and mode
BALANCE_POINT_SECONDS = 0.012  # CPU time [s] per point by harmonic balance
# additional CPU time [s] per point for a law with an evolving state
FLOWING_LAW_POINT_SECONDS = 0.1
BALANCE_UNKNOWN_SECONDS = 8e-10  # CPU time [s] per cubed number of unknowns of a harmonic balance
# CPU times [s] of the Floquet multipliers of a smooth law, per cubed number of state variables: for a law that depends
# only on the speed, and for a law with an evolving state
MULTIPLIER_SECONDS = (2.5e-6, 4e-6)

# Lists of bonds, which are evaluated in one or more passes per time step.
# CPU time [s] per strip and pass, by the form of the list (`friction.bonds.list_forms_kernels`)
STRIP_SECONDS = (3e-10, 3e-9, 2e-9, 3e-9)
# CPU time [s] per strip and pass for an order that requires a power function
ANY_ORDER_STRIP_SECONDS = 2.5e-8
PASS_SECONDS = 1.5e-7  # CPU time [s] per pass through a list, in addition to its strips
LIST_STEP_SECONDS = 5e-7  # CPU time [s] per time step with a list, in addition to its passes
RECURSION_STEP_SECONDS = 3e-8  # CPU time [s] per time step of the recursion

# Slide of a bench.
# CPU time [s] per sample of a closed-form solution or of a law with one element
SAMPLE_SECONDS = 1e-7
LAW_STEP_SECONDS = 6e-5  # CPU time [s] per sample of a law that NumPy integrates step by step
PATH_STEP_SECONDS = 1.2e-3  # CPU time [s] per sample of a sum over the strips of the path
PATH_STRIP_SECONDS = 2e-6  # additional CPU time [s] per sample and strip of the path
PATH_POINT_SECONDS = 8e-9  # additional CPU time [s] per sample, strip and point of the path

# Static contact of a patch.
# CPU time [s] per patch with its stress fields, in addition to the condensation
PATCH_SECONDS = 0.15
FIELDS_SECONDS = 0.1  # CPU time [s] per patch for its stress fields
# time of all condensations of a patch over the predicted time of one condensation
CONDENSING_FACTOR = 3.0
# Contact on points of a profile, on levels of more and more points. The number of iterations grows with the root of the
# number of points; 12 traces took 0.25 to 2.6 of the predicted time, and one that did not converge 4.6.
POINT_ENDS_SECONDS = 0.2  # CPU time [s] for the free ends of the pieces
POINT_LEVEL_SECONDS = 4e-7  # CPU time [s] of a level divided by its number of points**1.5
FRAMES_SECONDS = 0.35  # CPU time [s] per moving patch for its frames
FRAME_NODE_SECONDS = 3e-5  # CPU time [s] per node of the finest grids for the frames

# CPU time [s] of the work of `measure_machine_time_ratio` on the reference machine
REFERENCE_WORK_SECONDS = 0.0214


def predict_shear_mode_step(points: int, modes: int, *, load_varies: bool = False) -> float:
    """Predict the CPU time [s] of a time step of bonds that are coupled by shear modes.

    Measured times of the rig of the report and of its bench with 65 to 425 points were 0.7 to 1.5 of the prediction.

    Parameters
    ----------
    points : int
        Number of points with bonds.
    modes : int
        Number of shear modes.
    load_varies : bool
        Whether the normal loads of the points vary with the motion, as over grooves.

    Returns
    -------
    float
    """
    if load_varies:
        return 7e-6 + points * (2e-8 + 2e-9 * modes)
    return 1e-6 + points * (1e-9 + 5e-10 * modes)


def measure_machine_time_ratio() -> float:
    """Measure the CPU time of a standard task relative to the reference machine.

    The task consists of a loop, matrix products and linear solves, as in a run. The shortest of five timings is used.
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
