"""Loop over many cases of one mode and one point, their cycles and the pieces of their motion (compiled).

A motion that repeats is not computed again up to its last cycles.
"""

from math import inf, nan, pi

from ..kernel_cache.flags_kernels import NJIT_KERNEL
from ..kernel_cache.jit import njit
from .law_kernels import find_first_tangent
from .motion_kernels import (
    Instant,
    advance,
    commit,
    find_first_direction,
    is_linear,
    make_body,
    start,
)
from .observer_kernels import (
    integrate,
    observe_ends,
    observe_motion,
    observe_piece,
    start_cycle,
    start_window,
)
from .rows import (
    SAME_CASE_CYCLE,
    SAME_SMOOTH_CYCLE,
    Energy,
    Loop,
    Memory,
    Number,
    PointLaw,
    Seen,
)

N_READ = 2  # measured cycles of a motion that repeats
# Pieces in a row that end with an event, after which one has none: a point at its limit whose events are round-off
MAX_EVENTS = 16
# Pieces of a run, which take 1 to 2 CPU seconds. A law that needs more is so much faster than the drive that a single run
# computes or refuses it.
MAX_PIECES = 4_000_000


@njit(**NJIT_KERNEL)
def compare_cycle(case, before, now, loop):
    """Return the change of the motion in a cycle, relative to its range.

    Parameters
    ----------
    case : (12,) array
        Numbers of the case, in the order of `rows.Number`.
    before, now : Instant
        Start and end of the cycle.
    loop : (5,) array
        The cycle, in the order of `rows.Loop`.
    """
    size = loop[Loop.MAX_SLIDE] - loop[Loop.MIN_SLIDE]
    if size == 0:
        return 0.0
    change = abs(now.slide - before.slide)
    change = max(change, abs(now.velocity - before.velocity) / case[Number.OMEGA]) / size
    force = case[Number.MOBILITY] * abs(now.force - before.force)
    return max(change, force / abs(case[Number.DRIVE]))


@njit(**NJIT_KERNEL)
def march_cases(steps, parameters, laws, record):
    """March cases over their cycles.

    Parameters
    ----------
    steps : int
        Fewest steps per cycle.
    parameters : (c, 12) array
        Numbers of the cases, in the order of `rows.Number`.
    laws : PointLaw
        Numbers (c, k) of the laws, in the order of `LawNumber`, and their memory (c, l) (changed in place).
    record : Record
        What is recorded (output).
    """
    for j in range(parameters.shape[0]):
        case = parameters[j]
        law = PointLaw(laws.numbers[j], laws.memory[j])
        body = make_body(case, law, float(steps))
        energies = record.energies[j, 0]
        cycle_start = record.energies[j, 1]
        seen = record.seen[j]
        same = SAME_CASE_CYCLE if is_linear(body) else SAME_SMOOTH_CYCLE / float(steps) ** 3

        at = start(body)
        direction = find_first_direction(body)
        tangent = find_first_tangent(law.numbers)
        energies[Energy.STORED] = 0.5 * (at.velocity**2 + case[Number.STIFFNESS] * at.slide**2)
        n_cycles = int(case[Number.CYCLES])
        first = n_cycles - int(case[Number.WINDOW])
        cycle = 0
        n_pieces = 0
        while cycle < n_cycles:
            observes = cycle >= first
            if cycle == first:
                start_window(at, seen)
            at = Instant(
                complex(1.0, 0.0), at.slide, at.velocity, at.acceleration, at.force, at.slip, 0.0
            )
            before = at
            for k in range(Energy.STORED):
                cycle_start[k] = energies[k]
            loop = record.loops[j, cycle]
            start_cycle(at, loop)

            left = 2 * pi / case[Number.OMEGA]
            n_events = 0
            phasor = third = complex(0.0, 0.0)
            mean = 0.0
            while left > 0 and n_pieces < MAX_PIECES:
                n_pieces += 1
                finds_events = n_events < MAX_EVENTS
                slope = direction, tangent
                piece = advance(body, at, slope, left, finds_events, not observes)
                n_events = n_events + 1 if piece.has_event else 0
                phasor += observe_piece(body, piece, energies, loop)
                if observes:
                    # Within the piece the law follows from its memory at the start.
                    observe_motion(body, piece, seen)
                    third += integrate(body, piece, 3)
                    mean += integrate(body, piece, 0).real
                at = piece.last
                if observes:
                    at = commit(body, piece)
                    observe_ends(piece, at, seen)
                direction = piece.direction
                tangent = piece.tangent
                left -= piece.duration

            # An extreme at the end of the cycle is no reversal if the slide goes on. Over a cycle the work of the drive is
            # -omega times its amplitude times the cosine integral.
            if at.slide == loop[Loop.MAX_SLIDE] and at.velocity > 0:
                loop[Loop.FORCE_AT_MAX] = nan
            if at.slide == loop[Loop.MIN_SLIDE] and at.velocity < 0:
                loop[Loop.FORCE_AT_MIN] = nan
            energies[Energy.WORK_IN] -= case[Number.DRIVE] * case[Number.OMEGA] * phasor.real
            record.phasors[j, cycle] = phasor
            cycle += 1
            if observes:
                record.harmonics[j, 0] += phasor
                record.harmonics[j, 1] += third
                loop[Loop.SLIDE] = mean
                seen[Seen.SPAN] += 2 * pi / case[Number.OMEGA]
                continue

            # A motion that repeats goes on with the last cycles.
            change = compare_cycle(case, before, at, loop)
            n_repeated = n_cycles - N_READ - cycle
            if change <= same and n_repeated > 0:
                seen[Seen.REPEAT] = same
                for k in range(cycle, cycle + n_repeated):
                    record.phasors[j, k] = phasor
                    record.loops[j, k, Loop.MIN_SLIDE] = loop[Loop.MIN_SLIDE]
                    record.loops[j, k, Loop.MAX_SLIDE] = loop[Loop.MAX_SLIDE]
                for k in range(Energy.STORED):
                    energies[k] += n_repeated * (energies[k] - cycle_start[k])
                cycle += n_repeated
                first = cycle

        if n_pieces == MAX_PIECES:
            seen[Seen.SAMPLED] = inf  # the work check fails, as the motion is not known
        seen[Seen.END_SLIDE] = at.slide
        seen[Seen.END_VELOCITY] = at.velocity
        seen[Seen.END_SLIP] = at.slip
        energies[Energy.ELASTIC] = law.memory[Memory.ENERGY]
        if body.stiffness > 0:
            energies[Energy.ELASTIC] = 0.5 * at.force * at.force / body.stiffness
