"""Motion from event to event over a schedule of cycles (compiled).

In every regime the equations are smooth. A step that leaves the regime is cut at the first zero of a margin on its dense
output, and the regime is switched there.

`rig` is a `records.Rig` and `state` a `records.State`, whose rows are named by enumerations of `records`: `Clock` for values
of the run such as LENGTH, the duration of the present step [s], `Memory` for each interface, `Probe` for what is observed. A
place in a step is its fraction from 0 to 1.
"""

import numpy as np

from ..kernel_cache.flags_kernels import NJIT_KERNEL
from ..kernel_cache.jit import njit
from .event_kernels import (
    N_CHECKS,
    change_regime,
    copy_margins,
    find_event,
    find_root,
    find_value,
    hold_or_release,
    start_directions,
)
from .motion_kernels import copy_values, find_integrals, find_rates, look, project, rests
from .records import (
    N_FACE_INTEGRALS,
    WINDOW_START,
    Clock,
    Cycle,
    Face,
    Margin,
    Memory,
    Mode,
    Piece,
    Probe,
    Setting,
    Status,
    Tail,
)
from .step_kernels import CYCLE, N_STAGES, RATES, SCALE, read_curve, step_factor, take_step
from .window_kernels import (
    add_output,
    observe_cycle,
    observe_releases,
    observe_window,
    write_directions,
    write_event,
    write_samples,
)

IS_VECTORISED = False  # loops over modes and interfaces are short (`compiled`)
MIN_CUT_SPEED = (
    1e-6  # speed, relative to the largest one, above which an interface does not reverse
)
SAME_SLIDE_TOL = 1e-9  # difference of slides that are equal, relative to their range
MIN_SEEN = 1e-6  # fraction of a cycle before which an end of motion belongs to the cycle before
MIN_SPEED_FRACTION = 0.9  # part of a step before a `Margin.SPEED` below which the step is repeated
SPEED_STEP_RATIO = 1.02  # length of the repeated step relative to that part
MAX_EMPTY_STEPS = 100  # events in a row without progress
# Events in a row without progress after which an interface at its friction limit rests for a step: the error of a step then
# hides whether it rests or slips.
MAX_UNDECIDED = 20
MIN_PROGRESS = 1e-13  # fraction of a step that counts as progress
MIN_STEP = 1e-15  # relative to the end of the run
REJECTED_FACTOR = 0.1  # ratio of steps after one without a finite error
MAX_LENGTHS = 100.0  # lengths of a law to which the error of a slide is relative at most
MAX_STIFFNESS = (
    1e8  # slide over the length of a law, above which round-off of the slide moves its force
)
MIN_PARTICIPATION = (
    1e-150  # of a mode in a slide or in the output, so that a mode without any has no error
)
MIN_CONTRACTION = 1e-3  # smallest ratio of two changes over a cycle that is assumed
MAX_CONTRACTION = 0.9999  # largest ratio of two changes over a cycle that is assumed
SAME_PHASE_TOL = 1e-6  # difference of two phases that count as equal [cycles]
MAX_REPEATED = 1000  # cycles whose events are repeated where the motion repeats
REPEAT_TOL = (
    1.0  # largest remaining change of a motion that repeats, relative to the step tolerance
)


@njit(**NJIT_KERNEL)
def update_scales(rig, state):
    """Update the magnitudes of the entries of a state, to which the error of a step is relative.

    They grow with the motion, from `rig.scales` on. The error of a mode counts by what it adds to the slides and to the
    output, relative to their magnitudes, and to the friction force of laws without states.
    """
    n = rig.modes.shape[1]
    y = state.y
    scale = state.rows[SCALE]
    output = rig.modes[Mode.OUTPUT]
    clock = state.clock

    # Magnitudes of the output, and the errors of the modes that they allow.
    x = y[:n]
    v = y[n : 2 * n]
    least_size = rig.scales[0]
    least_speed = rig.scales[n]
    clock[Clock.OUTPUT_SIZE] = max(clock[Clock.OUTPUT_SIZE], least_size, abs(project(output, x)))
    clock[Clock.OUTPUT_SPEED] = max(clock[Clock.OUTPUT_SPEED], least_speed, abs(project(output, v)))
    for j in range(n):
        scale[j] = clock[Clock.OUTPUT_SIZE] / max(abs(output[j]), MIN_PARTICIPATION)
        scale[n + j] = clock[Clock.OUTPUT_SPEED] / max(abs(output[j]), MIN_PARTICIPATION)

    # The same for every slide; the smaller error counts.
    for i in range(rig.faces.shape[0]):
        row = rig.rows[0, i]
        memory = state.memory[i]
        memory[Memory.SIZE] = max(memory[Memory.SIZE], least_size, abs(project(row, x)))
        memory[Memory.SPEED] = max(memory[Memory.SPEED], least_speed, abs(project(row, v)))
        size = min(memory[Memory.SIZE], MAX_LENGTHS * rig.faces[i, Face.LENGTH])
        for j in range(n):
            part = max(abs(row[j]), MIN_PARTICIPATION)
            scale[j] = min(scale[j], size / part)
            scale[n + j] = min(scale[n + j], memory[Memory.SPEED] / part)
    for k in range(2 * n, y.size):
        scale[k] = max(scale[k], abs(y[k]))


@njit(**NJIT_KERNEL)
def add_energies(rig, state, work_before):
    """Update the exchanged energy and the largest energy of the modes after a step.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    work_before : float
        Work of the drive before the step [J].
    """
    n = rig.modes.shape[1]
    y = state.y
    energy = 0.0
    for j in range(n):
        energy += y[n + j] ** 2 + rig.modes[Mode.STIFFNESS, j] * y[j] ** 2
    energy *= 0.5 * rig.settings[Setting.MASS]
    state.clock[Clock.EXCHANGED] += abs(y[Tail.WORK] - work_before)
    state.clock[Clock.STORED] = max(state.clock[Clock.STORED], energy)


@njit(**NJIT_KERNEL)
def find_travel_end(rig, state, fraction):
    """Return the fraction of a step at which the output reaches the stop, or 2.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    fraction : float
        Fraction of the step at which its motion ends.
    """
    if (
        rig.settings[Setting.TRAVEL] == np.inf
        or find_value(rig, state, fraction, -1, Probe.TRAVEL) >= 0
    ):
        return 2.0
    return find_root(rig, state, -1, Probe.TRAVEL, 0.0, fraction)


@njit(**NJIT_KERNEL)
def pass_steep_speed(rig, state, face, length):
    """Change the regime of an interface at a speed beside which its force changes steeply (`Margin.SPEED`).

    The next step is no longer than the interface needs to stop, so that it does not pass over the new regime.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    face : int
        Number of the interface.
    length : float
        Duration of the part of the step before this event [s].
    """
    before = state.margins[0, face, Margin.MOTION]
    change_regime(rig, state, face, Margin.SPEED)
    after = state.margins[0, face, Margin.MOTION]
    if MIN_PROGRESS < after < before:
        stop = length * after / (before - after)
        state.clock[Clock.STEP] = min(state.clock[Clock.STEP], stop)


@njit(**NJIT_KERNEL)
def advance(rig, state, record, t_end, cycle):
    """Advance a motion within a piece of the drive to a time; return its `Status`.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    record : Record
        What the run records.
    t_end : float
        Time at the end [s].
    cycle : int
        Number of the cycle.
    """
    clock = state.clock
    rtol = rig.settings[Setting.RTOL]
    longest = rig.settings[Setting.LONGEST_STEP]
    in_window = record.cycles[cycle, Cycle.WINDOW] >= 0
    # By rounding, a motion that stops at the end of a cycle may reach into the next one, to which it does not belong.
    first_seen = MIN_SEEN * rig.settings[Setting.PERIOD]
    if cycle > 0:
        first_seen += record.cycles[cycle - 1, Cycle.END]
    # The step error is that of the states before the first integral; on a bench, whose states follow the path, of all.
    n_checked = find_integrals(rig)
    if rig.settings[Setting.IS_BENCH] > 0:
        n_checked += N_FACE_INTEGRALS * rig.faces.shape[0]
    n_empty = 0
    undecided = -1

    # A pass is a step of length h, or its part up to the first event.
    while clock[Clock.TIME] < t_end:
        if n_empty > MAX_EMPTY_STEPS:
            return Status.NO_PROGRESS
        if clock[Clock.N_STEPS] > rig.settings[Setting.MAX_STEPS]:
            return Status.TOO_MANY_STEPS
        h = min(clock[Clock.STEP], longest, t_end - clock[Clock.TIME])
        norm = take_step(rig, state, h, rtol, n_checked)
        clock[Clock.N_STEPS] += 1

        # `norm` is the error of the step relative to its tolerance. A step beyond it is repeated with a shorter length.
        if not norm <= 1:
            clock[Clock.STEP] = h * (step_factor(norm) if norm > 1 else REJECTED_FACTOR)
            if clock[Clock.STEP] < MIN_STEP * t_end:
                return Status.STEP_TOO_SMALL
            continue

        # The part of the step up to its first event is the motion.
        event = find_event(rig, state, undecided)
        fraction = event.fraction
        face = event.face
        if (
            n_empty > MAX_UNDECIDED
            and fraction <= MIN_PROGRESS
            and event.which == Margin.MOTION
            and rests(state.memory[face])
        ):
            # The same step is computed again without the release of this interface.
            undecided = face
            n_empty += 1
            continue
        if event.which == Margin.SPEED and MIN_PROGRESS < fraction < MIN_SPEED_FRACTION:
            # The force changes steeply on one side of this speed. The error of a step with stages far on the other side
            # does not say how exact its dense output is up to the event.
            clock[Clock.STEP] = SPEED_STEP_RATIO * fraction * h
            continue

        # The run ends where the output reaches the stop of the flexure before the event.
        travel_end = find_travel_end(rig, state, fraction)
        if travel_end < fraction:
            fraction = travel_end
            face = -1

        # Measures and samples of the part of the step that is motion
        if fraction > 0:
            observe_cycle(rig, state, fraction, record.cycles[cycle])
            if in_window and clock[Clock.TIME] + fraction * h > first_seen:
                observe_window(rig, state, record, cycle, fraction)
        write_samples(rig, state, record, fraction)
        work_before = state.y[Tail.WORK]

        # The state moves to the end of this part.
        if fraction == 1:
            # The last stage and the last margins are those of the start of the next step.
            copy_values(state.rows[N_STAGES], state.rows[0])
            copy_margins(state, N_CHECKS)
        else:
            clock[Clock.IS_SMOOTH] = 0.0
        is_end = face < 0 and fraction == 1 and h == t_end - clock[Clock.TIME]
        read_curve(state, fraction, state.y)
        update_scales(rig, state)
        add_energies(rig, state, work_before)
        clock[Clock.TIME] = t_end if is_end else clock[Clock.TIME] + fraction * h
        if travel_end <= 1 and face < 0:
            return Status.EXCEEDS_TRAVEL

        # The interface of the event changes its regime.
        n_empty = 0 if fraction > MIN_PROGRESS else n_empty + 1
        undecided = -1 if n_empty == 0 else undecided
        if event.which == Margin.SPEED:
            clock[Clock.IS_SMOOTH] = 0.0
            pass_steep_speed(rig, state, face, fraction * h)
        elif face >= 0:
            clock[Clock.IS_SMOOTH] = 0.0
            write_event(rig, state, record, face, event.which)
            if change_regime(rig, state, face, event.which):
                return Status.LEAVES_GROOVES
            if in_window and clock[Clock.TIME] > first_seen:
                observe_releases(rig, state, record, face)
            number = int(clock[Clock.N_EVENTS]) - 1
            if number < record.events.shape[0]:
                find_rates(rig, state, clock[Clock.TIME], state.y, state.rows[RATES])
                write_directions(rig, state, record.events[number])
            # The force of a rigid law may jump at an event, so a second row has the force after it.
            if rig.settings[Setting.HAS_RIGID] > 0:
                write_event(rig, state, record, face, Margin.AFTER)
        elif h == clock[Clock.STEP] or h == longest:
            clock[Clock.STEP] = h * step_factor(norm)
    return Status.DONE


@njit(**NJIT_KERNEL)
def advance_over_pieces(rig, state, record, t_end, cycle):
    """Advance a motion to a time over the pieces of the drive; return its `Status`.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    record : Record
        What the run records.
    t_end : float
        Time at the end [s].
    cycle : int
        Number of the cycle.
    """
    clock = state.clock
    while True:
        number = int(clock[Clock.PIECE])
        is_last = number + 1 >= rig.pieces.shape[0]
        piece_end = t_end if is_last else rig.pieces[number + 1, Piece.START]
        status = advance(rig, state, record, min(piece_end, t_end), cycle)
        if status != Status.DONE or is_last or piece_end > t_end:
            return status
        find_rates(rig, state, clock[Clock.TIME], state.y, state.rows[RATES])
        clock[Clock.PIECE] += 1
        clock[Clock.IS_SMOOTH] = 0.0
        hold_or_release(rig, state)
        if piece_end == t_end:
            return status


@njit(**NJIT_KERNEL)
def find_change(rig, state):
    """Return the largest change of the state since the last cycle, relative to the scales."""
    largest = 0.0
    for k in range(find_integrals(rig)):
        change = abs(state.y[k] - state.rows[CYCLE, k]) / state.rows[SCALE, k]
        largest = max(largest, change)
    return largest


@njit(**NJIT_KERNEL)
def repeat_row(rig, state, row, source, count):
    """Write a sample or event that repeats another one a number of cycles later.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion at the end of the cycle that is repeated.
    row : (m,) array
        Row of `records.Record.samples` or `events` that is written.
    source : (m,) array
        Row of the earlier sample or event.
    count : int
        Number of cycles between them.
    """
    copy_values(source, row)
    row[0] += count * rig.settings[Setting.PERIOD]
    for k in range(find_integrals(rig), state.y.size):
        row[1 + k] += count * (state.y[k] - state.rows[CYCLE, k])


@njit(**NJIT_KERNEL)
def skip_cycles(rig, state, record, cycle, count):
    """Continue a motion that repeats after this cycle by the next `count` cycles, up to their end.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    record : Record
        What the run records.
    cycle : int
        Number of the cycle.
    count : int
        Number of cycles.
    """
    clock = state.clock
    period = rig.settings[Setting.PERIOD]
    for c in range(cycle + 1, cycle + 1 + count):
        copy_values(record.cycles[cycle, Cycle.MIN :], record.cycles[c, Cycle.MIN :])
        record.cycles[c, Cycle.REPEATS] = 1.0
    end = record.cycles[cycle + count, Cycle.END]

    # Samples have the same phases in all cycles, so that each repeats the one a period before.
    source = 0
    while clock[Clock.SAMPLE] < record.samples.shape[0]:
        row = record.samples[int(clock[Clock.SAMPLE])]
        t = row[0]
        if t >= end:
            break
        while record.samples[source, 0] < t - (1 + SAME_PHASE_TOL) * period:
            source += 1
        repeat_row(rig, state, row, record.samples[source], 1)
        row[0] = t
        clock[Clock.SAMPLE] += 1

    # Events of the cycle, in MAX_REPEATED of the skipped ones, for histories.
    last = min(int(clock[Clock.N_EVENTS]), record.events.shape[0])
    first = last
    while (
        record.samples.shape[0]
        and first > 0
        and record.events[first - 1, 0] > clock[Clock.TIME] - period
    ):
        first -= 1
    for c in range(1, count + 1, max(1, count // MAX_REPEATED)):
        for number in range(first, last):
            if clock[Clock.N_EVENTS] < record.events.shape[0]:
                row = record.events[int(clock[Clock.N_EVENTS])]
                repeat_row(rig, state, row, record.events[number], c)
            clock[Clock.N_EVENTS] += 1

    for k in range(find_integrals(rig), state.y.size):
        state.y[k] += count * (state.y[k] - state.rows[CYCLE, k])
    clock[Clock.EXCHANGED] += count * (clock[Clock.EXCHANGED] - clock[Clock.EXCHANGED_BEFORE])
    clock[Clock.TIME] = end
    clock[Clock.IS_SMOOTH] = 0.0


@njit(**NJIT_KERNEL)
def count_repeated(rig, state, record, cycle):
    """Return how many of the next cycles can be skipped if the motion repeats.

    They lie before the window and in the present piece of the drive. If this cycle has no samples from which those of
    later cycles can be copied, only cycles without samples count.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    record : Record
        What the run records.
    cycle : int
        Number of the cycle.
    """
    count = 0
    end = np.inf
    if state.clock[Clock.PIECE] + 1 < rig.pieces.shape[0]:
        end = rig.pieces[int(state.clock[Clock.PIECE]) + 1, Piece.START]
    sample = int(state.clock[Clock.SAMPLE])
    if sample < record.samples.shape[0]:
        start = 0.0 if cycle == 0 else record.cycles[cycle - 1, Cycle.END]
        if sample == 0 or record.samples[sample - 1, 0] <= start:
            end = min(end, record.samples[sample, 0])
    while cycle + count + 1 < record.cycles.shape[0]:
        row = record.cycles[cycle + count + 1]
        if row[Cycle.WINDOW] != -1 or row[Cycle.END] > end:
            break
        count += 1
    return count


@njit(**NJIT_KERNEL)
def drop_cut_extremes(cycle, point):
    """Replace the friction force at the largest or smallest slide of a cycle by NaN if it is no reversal.

    Such an extreme lies at an end of the cycle, which cuts the motion.

    Parameters
    ----------
    cycle : (12,) array
        Row of `records.Record.cycles`.
    point : Point
        Motion of the first interface at this end.
    """
    if abs(point.velocity) <= MIN_CUT_SPEED * point.speed_scale:
        return
    size = SAME_SLIDE_TOL * (cycle[Cycle.MAX_SLIDE] - cycle[Cycle.MIN_SLIDE])
    for k in (Cycle.MIN_SLIDE, Cycle.MAX_SLIDE):
        if abs(point.slide - cycle[k]) <= size:
            cycle[k + 1] = np.nan


@njit(**NJIT_KERNEL)
def run_cycles(rig, state, record):
    """Integrate a motion cycle by cycle, up to the times in column `Cycle.END` of `record.cycles`.

    With `Setting.REPEAT` equal to 1, cycles before the window are skipped as soon as the motion no longer changes from
    cycle to cycle.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion at the start; overwritten by the motion at the end.
    record : Record
        What the run records.

    Returns
    -------
    Status
        `Status.DONE` at the end of the last cycle; any other value ends the run at once.
    """
    clock = state.clock
    copy_values(rig.scales, state.rows[SCALE])
    update_scales(rig, state)
    clock[Clock.IS_SMOOTH] = 0.0
    start_directions(rig, state)
    add_energies(rig, state, state.y[Tail.WORK])
    n_cycles = record.cycles.shape[0]
    repeat = int(rig.settings[Setting.REPEAT])
    last_change = np.inf
    cycle = 0
    while cycle < n_cycles:
        row = record.cycles[cycle]
        in_window = row[Cycle.WINDOW] >= 0
        if in_window and (cycle == 0 or record.cycles[cycle - 1, Cycle.WINDOW] < 0):
            copy_values(state.y, state.rows[WINDOW_START])

        # State at the start of a cycle for the check of repetition.
        add_output(rig, state.y, row)
        if repeat and cycle % repeat == 0:
            copy_values(state.y, state.rows[CYCLE])
        clock[Clock.EXCHANGED_BEFORE] = clock[Clock.EXCHANGED]
        if rig.faces.shape[0]:
            start = look(rig, state, 0, clock[Clock.TIME], state.y)

        status = advance_over_pieces(rig, state, record, row[Cycle.END], cycle)
        for i in range(rig.faces.shape[0]):
            if state.memory[i, Memory.SIZE] > MAX_STIFFNESS * rig.faces[i, Face.LENGTH]:
                status = Status.TOO_STIFF
        if rig.faces.shape[0]:
            drop_cut_extremes(row, start)
            drop_cut_extremes(row, look(rig, state, 0, clock[Clock.TIME], state.y))
        clock[Clock.N_CYCLES] = cycle + 1
        if status != Status.DONE:
            return status

        # The remaining change is that of a geometric series of the last two changes. The first cycle may be a part of a
        # period, after which the same motion is no repetition.
        if repeat == 1 and not in_window:
            change = find_change(rig, state)
            ratio = min(max(change / last_change, MIN_CONTRACTION), MAX_CONTRACTION)
            last_change = max(change, 1e-300)
            remaining = change * ratio / (1 - ratio)
            if cycle > 0 and remaining < REPEAT_TOL * rig.settings[Setting.RTOL]:
                count = count_repeated(rig, state, record, cycle)
                skip_cycles(rig, state, record, cycle, count)
                cycle += count
        cycle += 1
    return Status.DONE


@njit(**NJIT_KERNEL)
def run_case(rig, state, record):
    """Run a case, and write its `Status` into the clock.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    record : Record
        What the run records.
    """
    state.clock[Clock.STATUS] = run_cycles(rig, state, record)
