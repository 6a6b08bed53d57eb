"""Sizes and row names of the arrays in `lanes_kernels`, which integrate one case per vector lane."""

from enum import IntEnum

# Number of cases that are integrated together, a multiple of the vector length of the processor.
LANES = 32
N_POINTS = 6  # number of points of the interface of a case
N_PIECE_MODES = 2  # number of shear modes of the pieces of a case
N_RIG_MODES = 2  # number of modes of the rig
# Number of unknowns of a step: increments of the slide and of the coordinates of the pieces.
N_UNKNOWNS = 1 + N_PIECE_MODES
# Number of coefficients of the quadratic form of the viscous loss of a mode.
N_LOSS_COEFFICIENTS = 6
N_SAMPLE = 2 * N_RIG_MODES + 2  # number of values in a sample: coordinates, rates, force, slip

# Workspace quantities of a case that have several rows, and their numbers of rows.
MULTIPLE_ROWS = {
    # State
    "RIG_POSITION": N_RIG_MODES,  # modal coordinates of the rig
    "RIG_RATE": N_RIG_MODES,  # rates of the modal coordinates of the rig
    "PIECE_POSITION": N_PIECE_MODES,  # coordinates of the pieces [m]
    "STRETCHES": N_POINTS,  # mean stretch of the bonds of the points [bond lengths]
    "SQUARES": N_POINTS,  # mean square of the stretch [bond lengths squared]
    # Solution of a step
    "INCREMENTS": N_UNKNOWNS,  # increments of slide and piece coordinates [m]
    "LAST_INCREMENTS": N_UNKNOWNS,  # increments of the last step [m]
    "INCREMENTS_BEFORE": N_UNKNOWNS,  # increments of the penultimate step [m]
    "NEWTON_STEP": N_UNKNOWNS,  # last Newton step [m]
    # Parameters of the case
    "POINT_LIMITS": N_POINTS,  # friction limits of the points [N]
    "SHAPES": N_PIECE_MODES * N_POINTS,  # slides of the points per coordinate of the pieces
    "STIFFNESSES": N_PIECE_MODES,  # stiffnesses of the coordinates of the pieces [N/m]
    "MAX_SHAPES": N_PIECE_MODES,  # largest absolute slide of a point per coordinate
    "MEAN_SHAPES": N_PIECE_MODES,  # mean slide of the points per coordinate
}
# Workspace quantities of a case that have one row.
SINGLE_ROWS = (
    # Solution of a step
    "DESCENT",  # decrease of the potential that the Newton step predicts [J]
    "IS_SOLVED",  # 1 if the step is solved
    "FREE_SLIDE",  # force-free increment of the slide [m]
    # Sample
    "FRICTION",  # friction force [N]
    "INTERFACE_ENERGY",  # energy of bonds and pieces [J]
    "SLIP",  # mean slip of the points [m]
    "OUTPUT",  # displacement of the output [m]
    "OUTPUT_RATE",  # rate of the output [m/s]
    "LAST_OUTPUT",  # output at the start of the step [m]
    "LAST_OUTPUT_RATE",  # rate of the output at the start of the step [m/s]
    "RIG_SLIDE",  # slide of the rig [m]
    "MEAN_FORCE",  # mean friction force of the step [N]
    "DRIVE_WORK",  # work of the drive in the step [J]
    "VISCOUS_LOSS",  # viscous loss in the step [J]
    "RATE_SQUARES",  # sum of v^2 + omega^2 z^2 of the modes
    # Parameters of the case
    "DRIVE",  # drive amplitude of the case relative to that of the table
    "BOND_LENGTH",  # bond length [m]
    "LIMIT",  # friction limit [N]
    # Sums of the run [J]
    "WORK_IN",
    "VISCOUS_SUM",
    "DRIVE_WORK_SIZE",
    "FRICTION_LOSS",
    "MAX_STORED",
    "FRICTION_WORK",
    "SAMPLED_WORK",
    "FRICTION_WORK_SIZE",
    "INTERFACE_LOSS",
    "INTERFACE_GAIN",
    # Extremes and phasor of the output in a cycle [m]
    "MIN_OUTPUT",
    "MAX_OUTPUT",
    "COS_SUM",
    "SIN_SUM",
    "N_UNSOLVED",  # number of steps without a solution
    "MAX_SLIDE",  # largest slide of the run [m]
)
# Number of rows of each quantity in the order of the workspace;
# `lanes_kernels.store_samples` copies the first ones.
WORKSPACE_ROWS = MULTIPLE_ROWS | dict.fromkeys(SINGLE_ROWS, 1)
N_WORKSPACE_ROWS = sum(WORKSPACE_ROWS.values())


def _stack_rows(row_counts: dict, row_length: int) -> dict:
    """Return the position at which the numbers of each quantity begin in a stacked array."""
    positions = {}
    end = 0
    for name, count in row_counts.items():
        positions[name] = end
        end += count * row_length
    return positions


# Position of the first number of each quantity in the flat workspace; lane i of its row k
# is at `At.NAME + k * LANES + i`.
At = IntEnum("At", _stack_rows(WORKSPACE_ROWS, LANES), module=__name__)


class RigRow(IntEnum):
    """Row indices of the propagator of a rig, whose coefficients are per friction force.

    They follow from `propagator.Propagator`, whose coefficients are per acceleration.

    - ZZ to VV: free motion of coordinate and rate
    - BY_Z, BY_V: coordinate and rate at the end of the step per force
    - REACH_Z, REACH_V: increment of the slide per coordinate and rate
    - LOSS: first of the coefficients of the quadratic form of the viscous loss
    - SLIDE_SHAPE, OUTPUT_SHAPE: slide and output per coordinate
    - OMEGA_SQUARE: square of the angular frequency
    - STEP: compliance of the slide [m/N], mass [kg] and length of a step [s], for all modes
    """

    ZZ = 0
    ZV = 1
    VZ = 2
    VV = 3
    BY_Z = 4
    BY_V = 5
    REACH_Z = 6
    REACH_V = 7
    LOSS = 8
    SLIDE_SHAPE = LOSS + N_LOSS_COEFFICIENTS
    OUTPUT_SHAPE = SLIDE_SHAPE + 1
    OMEGA_SQUARE = SLIDE_SHAPE + 2
    STEP = SLIDE_SHAPE + 3


class StepColumn(IntEnum):
    """Columns of the drive table for the steps of a cycle, for a drive amplitude of 1 m s-2.

    - BY_DRIVE: contribution of the drive to coordinates and rates
    - WORK_FORMS, LOSS_FORMS: coefficients of the drive work and of the viscous loss
    - REMAINDERS: constant parts of work and loss
    - PORT_SLIDE: contribution of the drive to the slide
    - WAVES: cosine and sine of the drive at the start of the step
    """

    BY_DRIVE = 0
    WORK_FORMS = 2 * N_RIG_MODES
    LOSS_FORMS = 5 * N_RIG_MODES
    REMAINDERS = 8 * N_RIG_MODES
    PORT_SLIDE = REMAINDERS + 2
    WAVES = REMAINDERS + 3


N_COLUMNS = StepColumn.WAVES + 2


def get_rows(workspace, position: At):
    """Return a view of the rows that hold one quantity in a workspace of cases.

    Parameters
    ----------
    workspace : (N_WORKSPACE_ROWS, n) array
    position : At

    Returns
    -------
    (k, n) array
    """
    first = position // LANES
    return workspace[first : first + WORKSPACE_ROWS[position.name]]
