"""Loop over many cases of one mode and one point, their cycles and the pieces of their motion (compiled).

A case moves by exact steps if its law is linear between events (`linear_cases_kernels`), and by Runge-Kutta steps if it
is smooth (`smooth_cases_kernels`). A motion that repeats is not computed again up to its last cycles.
"""

from math import inf, pi

from ..compiled.flags_kernels import NJIT_KERNEL
from ..compiled.jit import njit
from . import linear_cases_kernels as linear
from . import smooth_cases_kernels as smooth
from .case_observers_kernels import (
    N_READ,
    add_piece,
    end_cycle,
    start_cycle,
    start_window,
)
from .case_rows import (
    N_FINAL_WINDOWS,
    SAME_CASE_CYCLE,
    SAME_SMOOTH_CYCLE,
    WINDOW_STEPS,
    Now,
    Number,
    Seen,
)
from .law_rows import Law, LawNumber, Memory
from .smooth_laws_kernels import PointLaw

# Pieces of a run, which take 1 to 2 CPU seconds. A law that needs more is so much faster than the drive that a single run
# computes or refuses it.
MAX_PIECES = 4_000_000


@njit(**NJIT_KERNEL)
def count_repeated(cycle, same, before, case, now):
    """Return the number of cycles that need not be computed because the last one ended as it began; 0 if it did not.

    The last N_READ cycles are computed, because the measures are taken over them.

    Parameters
    ----------
    cycle : int
        Number of cycles that are computed.
    same : float
        Change of the cycle relative to the range of the motion, below which it repeats.
    before, now : (18,) array
        State of the case before and after the last cycle, in the order of `case_rows.Now`.
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    """
    size = same * (now[Now.MAX] - now[Now.MIN])
    force = same * abs(case[Number.DRIVE]) / case[Number.MOBILITY]
    if (
        abs(now[Now.SLIDE] - before[Now.SLIDE]) > size
        or abs(now[Now.VELOCITY] - before[Now.VELOCITY]) > case[Number.OMEGA] * size
        or abs(now[Now.FORCE] - before[Now.FORCE]) > force
    ):
        return 0
    return max(int(case[Number.CYCLES]) - N_READ - cycle, 0)


@njit(**NJIT_KERNEL)
def march_cases(steps, parameters, laws, nows, seens, histories, loops):
    """March cases over their cycles.

    Parameters
    ----------
    steps : int
        Fewest steps per cycle.
    parameters : (c, 12) array
        Numbers of the cases, in the order of `case_rows.Number`.
    laws : ((c, k) array, (c, l) array)
        Numbers of the laws, in the order of `LawNumber`, and their memory (changed in place).
    nows : (c, 2, 18) array
        States of the cases, and before the last cycle, in the order of `case_rows.Now` (output).
    seens : (c, 20) array
        What was observed, in the order of `case_rows.Seen` (output).
    histories : (c, n, 4) array
        Extremes and phasor of every cycle (output).
    loops : (c, 1 + w, 5) array
        Cycles of the window, in the order of `case_rows.Loop`, after a row for those before it. Cycles that are not
        measured keep their values (output).
    """
    numbers, memory = laws
    for j in range(parameters.shape[0]):
        case = parameters[j]
        now = nows[j, 0]
        before = nows[j, 1]
        seen = seens[j]
        law = PointLaw(numbers[j], memory[j])
        is_linear = numbers[j, LawNumber.LAW] <= Law.JENKINS
        same = SAME_CASE_CYCLE if is_linear else SAME_SMOOTH_CYCLE / float(steps) ** 3

        # State at the start
        coarse = linear.make_block(case, law, float(steps), 1.0)
        fine = linear.make_block(case, law, float(steps), WINDOW_STEPS)
        body = smooth.make_body(case, law, float(steps))
        now[Now.SLIDE] = case[Number.SLIDE]
        now[Now.VELOCITY] = case[Number.VELOCITY]
        now[Now.STORED] = 0.5 * (
            now[Now.VELOCITY] ** 2 + case[Number.STIFFNESS] * now[Now.SLIDE] ** 2
        )
        if is_linear:
            linear.start(coarse, now)
        else:
            smooth.start(body, now)

        n_cycles = int(case[Number.CYCLES])
        window = int(case[Number.WINDOW])
        first = n_cycles - window
        cycle = 0
        n_pieces = 0
        while cycle < n_cycles:
            observes = cycle >= first
            if cycle == first:
                start_window(now, seen)
            # The phasors from which a steady amplitude is extrapolated have the same error.
            n_left = n_cycles - cycle - 1
            is_fine = observes or (n_left % window == 0 and n_left < N_FINAL_WINDOWS * window)
            block = fine if is_fine else coarse
            for k in range(now.shape[0]):
                before[k] = now[k]
            loop = loops[j, max(loops.shape[1] - n_cycles + cycle, 0)]
            start_cycle(now, seen, loop)

            left = 2 * pi / case[Number.OMEGA]
            n_events = 0
            while left > 0 and n_pieces < MAX_PIECES:
                n_pieces += 1
                if is_linear:
                    piece = linear.advance(block, left, n_events, observes, now, seen)
                    n_events = n_events + 1 if piece.duration < block.step else 0
                else:
                    piece = smooth.advance(body, left, observes, now, seen)
                add_piece(piece, case, now, loop)
                left -= piece.duration
            end_cycle(case, now, seen, loop, histories[j, cycle])
            cycle += 1

            # A motion that repeats goes on with the last cycles.
            n_repeated = 0 if observes else count_repeated(cycle, same, before, case, now)
            if n_repeated > 0:
                for k in range(cycle, cycle + n_repeated):
                    for column in range(4):
                        histories[j, k, column] = histories[j, cycle - 1, column]
                for k in range(Now.WORK_IN, Now.STORED):
                    now[k] += n_repeated * (now[k] - before[k])
                cycle += n_repeated
                first = cycle

        if n_pieces == MAX_PIECES:
            seen[Seen.SAMPLED] = inf  # the work check fails, as the motion is not known
        now[Now.ELASTIC] = law.memory[Memory.ENERGY]
        if is_linear and coarse.point.stiffness > 0:
            now[Now.ELASTIC] = 0.5 * now[Now.FORCE] ** 2 / coarse.point.stiffness
