"""First-loading curve of parallel Jenkins elements, linear between yields.

With the force divided by the stiffness and YIELD_LENGTH, and the slide w in multiples of YIELD_LENGTH,

    g(w) = F + S w,

where F = sum k y over the elements that have yielded and S = sum k over the others, with the stiffness k and the yield
slide y of an element. A case has a table after its numbers (`run.make_curve_tables`): of each yield its place, F, S and
B = sum k y^2. In a step the table is walked through once, from where the last step ended. After an event the walk starts
at an equal part of the range of the yields, of which the table has the first yield. What is found is written into rows of
the workspace, because a compiler takes several lanes at once only if it knows the distance of any two numbers. A
reference is the engine `dynamics.events` with the elements themselves.
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE
from .rows_kernels import (
    CURVE_STATE,
    FIRST_YIELD,
    LANES,
    N_COLUMNS,
    N_PARTS,
    PART_STARTS,
    PARTS_PER_SLIDE,
    TABLE_SIZE,
    TableRow,
    TableRowStart,
    YieldColumn,
)

# Workspace index of the table of the first lane.
TABLE_START = (CURVE_STATE + len(TableRow)) * LANES
# Maximum step in multiples of YIELD_LENGTH; Newton's method converges
# slowly to the end of a longer step.
MAX_STEP = 0.25
LOOKS_AHEAD = True  # whether `prepare_lookup` has an effect
# Codes for where the curve data are stored: in the table, looked up by `prepare_lookup`, or
# saved at the start of the step.
IN_TABLE = 0
PREPARED = 1
AT_START = 2


@njit(**NJIT_INLINE)
def find_yield_from_guess(first_guess, w, workspace, lane):
    """Find the last yield before an abscissa by a linear search from a guess.

    Its index is stored.

    Parameters
    ----------
    first_guess : int
        Index of a yield.
    w : float
        Abscissa.
    workspace, lane
        See `rigid_kernels.friction_force`.
    """
    n = first_guess
    table = TABLE_START + TABLE_SIZE * lane
    while w >= workspace[table + N_COLUMNS * (n + 1)]:
        n += 1
    while w < workspace[table + N_COLUMNS * n]:
        n -= 1
    workspace[TableRowStart.YIELD_INDEX + lane] = n


@njit(**NJIT_INLINE)
def find_yield(w, workspace, lane):
    """Return the workspace index of the last yield before an abscissa.

    The yield of the last search is tried first, then the first yield of the interval of the table that contains w.

    Parameters
    ----------
    w : float
        Abscissa.
    workspace, lane
        See `rigid_kernels.friction_force`.

    Returns
    -------
    int
    """
    k = int(workspace[TableRowStart.YIELD_INDEX + lane])
    table = TABLE_START + TABLE_SIZE * lane
    if w < workspace[table + N_COLUMNS * k] or w >= workspace[table + N_COLUMNS * (k + 1)]:
        part = (w - workspace[table + FIRST_YIELD]) * workspace[table + PARTS_PER_SLIDE]
        k = 0
        if part > 0.0:
            k = int(workspace[table + PART_STARTS + int(min(part, N_PARTS - 1.0))])
        find_yield_from_guess(k, w, workspace, lane)
    return table + N_COLUMNS * int(workspace[TableRowStart.YIELD_INDEX + lane])


@njit(**NJIT_INLINE)
def prepare_lookup(workspace, lane):
    """Look up the first-loading curve of a lane at the prepared abscissa."""
    start = int(workspace[TableRowStart.YIELD_INDEX + lane])
    find_yield_from_guess(start, workspace[TableRowStart.CURVE_PLACE + lane], workspace, lane)
    yield_index = (
        TABLE_START
        + TABLE_SIZE * lane
        + N_COLUMNS * int(workspace[TableRowStart.YIELD_INDEX + lane])
    )
    workspace[TableRowStart.PREPARED_FORCE + lane] = workspace[yield_index + YieldColumn.FORCE]
    workspace[TableRowStart.PREPARED_SLOPE + lane] = workspace[yield_index + YieldColumn.SLOPE]
    workspace[TableRowStart.PREPARED_MOMENT + lane] = workspace[yield_index + YieldColumn.MOMENT]


@njit(**NJIT_INLINE)
def finish_step(workspace, lane, event):
    """Copy the curve values at the end of a step to its start, unless it contains an event.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    event : bool
        Whether the step has an event.
    """
    force = workspace[TableRowStart.START_FORCE + lane]
    moment = workspace[TableRowStart.START_MOMENT + lane]
    workspace[TableRowStart.START_FORCE + lane] = (
        force if event else workspace[TableRowStart.PREPARED_FORCE + lane]
    )
    workspace[TableRowStart.START_MOMENT + lane] = (
        moment if event else workspace[TableRowStart.PREPARED_MOMENT + lane]
    )


@njit(**NJIT_INLINE)
def start_lookup(w, workspace, lane):
    """Look up the first-loading curve at the start of a step.

    Parameters
    ----------
    w : float
        Abscissa at the start of the step.
    workspace, lane
        See `rigid_kernels.friction_force`.
    """
    yield_index = find_yield(w, workspace, lane)
    workspace[TableRowStart.START_FORCE + lane] = workspace[yield_index + YieldColumn.FORCE]
    workspace[TableRowStart.START_MOMENT + lane] = workspace[yield_index + YieldColumn.MOMENT]


@njit(**NJIT_INLINE)
def force_and_slope(w, workspace, lane, when):
    """Return force and slope of the first-loading curve at an abscissa w > 0.

    Parameters
    ----------
    w : float
        Abscissa, above 0.
    workspace, lane
        See `rigid_kernels.friction_force`.
    when : int
        See `masing_kernels.irreversible_slide`.

    Returns
    -------
    float
        Force.
    float
        Slope.
    """
    if when == PREPARED:
        slope = workspace[TableRowStart.PREPARED_SLOPE + lane]
        return workspace[TableRowStart.PREPARED_FORCE + lane] + slope * w, slope
    yield_index = find_yield(w, workspace, lane)
    return workspace[yield_index + YieldColumn.FORCE] + workspace[
        yield_index + YieldColumn.SLOPE
    ] * w, workspace[yield_index + YieldColumn.SLOPE]


@njit(**NJIT_INLINE)
def mean_slip(w, force, workspace, lane, when):
    """Return the mean slip of the sliders, weighted by friction, in scaled form.

    It is the slip at w divided by the stiffness and YIELD_LENGTH.

    Parameters
    ----------
    w, force : float
        Place on the curve, and the force there.
    workspace, lane
        See `rigid_kernels.friction_force`.
    when : int
        Where the numbers of the curve are.

    Returns
    -------
    float
    """
    if when == PREPARED:
        moment = workspace[TableRowStart.PREPARED_MOMENT + lane]
        return workspace[TableRowStart.PREPARED_FORCE + lane] * w - moment
    if when == AT_START:
        return (
            workspace[TableRowStart.START_FORCE + lane] * w
            - workspace[TableRowStart.START_MOMENT + lane]
        )
    yield_index = find_yield(w, workspace, lane)
    return (
        workspace[yield_index + YieldColumn.FORCE] * w - workspace[yield_index + YieldColumn.MOMENT]
    )


@njit(**NJIT_INLINE)
def loading_work(w, force, workspace, lane):
    """Return the integral of the first-loading force up to an abscissa.

    Parameters
    ----------
    w, force, workspace, lane
        See `mean_slip`.

    Returns
    -------
    float
    """
    yield_index = find_yield(w, workspace, lane)
    return (
        w * (force + workspace[yield_index + YieldColumn.FORCE])
        - workspace[yield_index + YieldColumn.MOMENT]
    ) / 2
