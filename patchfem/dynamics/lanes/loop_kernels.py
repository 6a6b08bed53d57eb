"""Time integration of many cases in lanes: all lanes take a step before the next step begins.

`march` takes the cases to their steady state or to a given cycle, `observe` takes them over their last cycles and reads
these. The law is a part of the text: `run.kernels` makes an instance of it per law. A step of a case costs 2 to 5 ns on a
core with vectors of eight numbers.
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_KERNEL
from . import extrapolation_kernels as extrapolation
from . import lane_kernels as lanes
from . import observation_kernels as observation
from . import rigid_kernels as law
from .rigid_kernels import AngleStep
from .rows_kernels import (
    FIRST_MEASURE,
    GROUP_BITS,
    LANES,
    N_MEASURES,
    N_NUMBERS,
    PERIODIC_TOL,
    RowStart,
)


@njit(**NJIT_INLINE)
def march_cycle(workspace, marked, table, n_active):
    """Advance all active lanes by one drive cycle.

    Parameters
    ----------
    workspace, marked, table
        See `march`.
    n_active : int
        Number of lanes that have a case; they are the first ones.
    """
    angle = table[2, 0]
    width = (n_active + (1 << GROUP_BITS) - 1) >> GROUP_BITS << GROUP_BITS
    for k in range(table.shape[1] - 1):
        step = AngleStep(table[0, k], table[1, k], table[0, k + 1], table[1, k + 1], angle)
        law.prepare_step(workspace, step.s0, step.c0)
        for lane in range(width):
            lanes.try_lane_step(workspace, lane, step)
        for n in range(lanes.collect_marked_lanes(workspace, marked, n_active)):
            lanes.resolve_lane_step(workspace, marked[n], step)


@njit(**NJIT_INLINE)
def is_periodic(lane, workspace):
    """Return whether the cycle of a lane ends at the state where it started."""
    size = workspace[RowStart.MAX_SLIDE + lane] - workspace[RowStart.MIN_SLIDE + lane]
    slide = workspace[RowStart.SLIDE + lane] - workspace[RowStart.START_SLIDE + lane]
    speed = workspace[RowStart.SPEED + lane] - workspace[RowStart.START_SPEED + lane]
    memory = workspace[RowStart.MEMORY + lane] - workspace[RowStart.START_MEMORY + lane]
    tolerance = PERIODIC_TOL * size
    return abs(slide) <= tolerance and abs(speed) <= tolerance and abs(memory) <= tolerance


@njit(cache=True, nogil=True, **NJIT_KERNEL)
def march(cases, order, motion, table, until, history, n_cycles, workspace, marked):
    """Integrate cases up to a given number of cycles, or until their motion repeats.

    A case is extrapolated once the map of its cycle is known (`extrapolation_kernels`). A law that asks for a proof
    marches one more cycle; if it does not end as predicted, the case goes back and is marched to the end. A lane whose
    case is done takes the next case of the order, or the case of the last lane.

    Parameters
    ----------
    cases : (n, N_NUMBERS + t) array
        Numbers of the cases and, for a law that has one, their tables.
    order : (m,) array
        Numbers of the cases that march.
    motion : (n, N_STATE + l) array
        Motions of the cases at their start; those at the end are written.
    table : (3, s + 1) array
        Sine and cosine of the drive at the steps of a cycle, and the angle of a step.
    until : int
    history : (n, c, 4) array
        Smallest and largest slide of each cycle [m], and its phasor [m]; it is written.
    n_cycles : (n,) array
        Number of cycles that are done; it is written. While a proof is under way it is the number of cycles before the
        extrapolation, and -1 after a proof that failed.
    workspace, marked : array
        Workspace of the lanes (`rows_kernels`), and (LANES + 1,) numbers of lanes.
    """
    phasor_factor = 2 / (table.shape[1] - 1)
    n_given = min(LANES, len(order))
    proof = 1 if law.PROOF_TOL > 0.0 else 0
    for lane in range(LANES):
        lanes.load_case(order[min(lane, n_given - 1)], lane, cases, motion, workspace)
    n_active = n_given
    while n_active > 0:
        march_cycle(workspace, marked, table, n_active)
        lane = 0
        while lane < n_active:
            case = int(workspace[RowStart.CASE_INDEX + lane])
            k = int(workspace[RowStart.CYCLE_INDEX + lane])
            is_proof = n_cycles[case] > 0
            if is_proof:
                repeats = extrapolation.confirms_extrapolation(lane, workspace)
            else:
                repeats = is_periodic(lane, workspace)
            lanes.finish_cycle(lane, workspace, history[case, k], phasor_factor)
            n_done = k + 1
            goes_on = n_done < until and not repeats
            if is_proof:
                goes_on = False
                if not (repeats and law.can_extrapolate(workspace, lane)):
                    lanes.load_case(case, lane, cases, motion, workspace)
                    workspace[RowStart.CYCLE_INDEX + lane] = n_cycles[case]
                    n_cycles[case] = -1
                    lane += 1
                    continue
            elif goes_on and n_cycles[case] == 0 and n_done + proof < until:
                if proof:
                    lanes.store_motion(case, lane, workspace, motion)
                n_done = extrapolation.extrapolate_cycles(
                    lane, workspace, history[case], k + 1, until - proof
                )
                goes_on = n_done == k + 1
                if proof and not goes_on:
                    n_cycles[case] = k + 1
                    goes_on = True
            workspace[RowStart.CYCLE_INDEX + lane] = n_done
            if goes_on:
                if n_cycles[case] <= 0:
                    extrapolation.push_cycle_end(lane, workspace)
                lane += 1
                continue
            n_cycles[case] = n_done
            lanes.store_motion(case, lane, workspace, motion)
            if n_given < len(order):
                lanes.load_case(order[n_given], lane, cases, motion, workspace)
                n_given += 1
                lane += 1
            else:
                n_active -= 1
                lanes.copy_lane(lane, n_active, workspace, cases.shape[1] - N_NUMBERS)


@njit(cache=True, nogil=True, **NJIT_KERNEL)
def observe(
    cases,
    order,
    motion,
    table,
    cycles,
    history,
    first_cycle,
    measures,
    acceleration,
    workspace,
    marked,
):
    """Integrate cases over their last cycles and measure them.

    Parameters
    ----------
    cases, order, motion, table, history, workspace, marked
        See `march`.
    cycles : int
        Number of cycles.
    first_cycle : (n,) array
        Number of the first measured cycle of each case.
    measures : (n, N_MEASURES) array
        Measures, named in `rows_kernels`; they are written.
    acceleration : (n, steps + 1) array
        Absolute acceleration of the output [m s-2] at the start and after every step; it is written, unless it has no
        columns.
    """
    n_steps = table.shape[1] - 1
    for first in range(0, len(order), LANES):
        n_active = min(LANES, len(order) - first)
        observation.load_observed_cases(first, cases, order, motion, workspace)
        observation.record_accelerations(workspace, acceleration, 0, table[0, 0])
        for k in range(cycles):
            observation.observe_cycle(workspace, marked, table, n_active, acceleration, k * n_steps)
            for lane in range(n_active):
                case = order[first + lane]
                observation.finish_observed_cycle(lane, workspace, k == 0, cycles, table[2, 0])
                lanes.finish_cycle(
                    lane, workspace, history[case, first_cycle[case] + k], 2 / n_steps
                )
        for lane in range(n_active):
            for n in range(N_MEASURES):
                measures[order[first + lane], n] = workspace[(FIRST_MEASURE + n) * LANES + lane]
            lanes.store_motion(order[first + lane], lane, workspace, motion)
