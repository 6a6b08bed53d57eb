"""Loop over steps whose length the error chooses, with events (compiled).

A step ends where the velocity vanishes, where the law has a kink along its path or at a speed, and
where the output reaches its travel. Newton's method on the length of the step finds such an end;
the step is taken anew each time, so the end is as exact as a step and needs no dense output.
"""

from math import sqrt

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INTERNAL, NJIT_NO_REFCOUNT
from ...friction.laws import stretch_kernels as law
from . import step_kernels as steps
from . import watch_kernels as watch
from .arrays import COUNT, END, MODE, NOW, STATUS, TURN, WORK

# bounds of the ratio of a step to the one before
MIN_STEP_FACTOR = 0.2
MAX_STEP_FACTOR = 8.0
# safety factor of the length of the next step
STEP_SAFETY = 0.9
# value of now[NOW.stage] where the motion was left at a reversal
AT_REVERSAL = 2.0
# cycles over which a maximum of coordinates and rates fades
FADING_CYCLES = 3.0
# tried steps of a call; they take a tenth of a second, in which compiled code hears no signal
MAX_TRIES = 50_000
# progress in time that MAX_TRIES steps must make, over the time of the fastest motion
MIN_PROGRESS = 1e-3
# fraction of a period within which two events are at the same time
INSTANT_FRACTION = 1e-13
# fraction of a period that a step in stick may take, because no other criterion limits it
MAX_STUCK_STEP = 0.02
# a motion that has not moved on since a stop: it is at the stop, or was found to go in the other direction
AT_STOP = 1
FLIPPED = 2


@njit(error_model="numpy", **NJIT_INTERNAL)
def distance_to_end(motion, what, y, slopes, travel):
    """Return the distance of a state to an end, > 0 before it, its rate [1/s] and its round-off.

    what: a number of `StepEnds`; slopes: of the state y.
    """
    n = motion.modes.shape[1]
    way = motion.turn[TURN.direction]
    q, v = steps.find_slide(motion, y)
    gain = 0.0
    for i in range(n):
        gain += motion.modes[MODE.slide, i] * slopes[n + i]
    if what == END.stop:
        return way * v, way * gain, speed_round_off(motion)
    if what == END.kink:
        path = way * (q - motion.now[NOW.origin])
        return (
            motion.turn[TURN.kink_path] - path,
            -way * v,
            1e-15 * (motion.now[NOW.max_coordinate] + motion.turn[TURN.kink_path]),
        )
    if what == END.knee:
        side = 1.0 if motion.turn[TURN.is_above_knee] > 0 else -1.0
        floor = motion.turn[TURN.knee_velocity]
        return side * (way * v - floor), side * way * gain, 1e-12 * floor
    # a set-valued law writes the remaining margin of its hold and of its load after its loss
    if what >= END.release:
        return slopes[2 * n + what - END.release + 1], 0.0, 0.0
    x, w = watch.find_output(motion, y)
    return travel - abs(x), -w if x > 0 else w, 1e-13 * travel


@njit(error_model="numpy", **NJIT_INTERNAL)
def can_end(motion, what, travel):
    """Return whether this event can occur in the motion."""
    if what == END.kink:
        return motion.turn[TURN.kink_path] < np.inf
    if what == END.knee:
        return motion.turn[TURN.knee_velocity] > 0
    if what >= END.release:
        return law.IS_SET_VALUED and (what == END.lift or motion.turn[TURN.direction] == 0)
    return motion.turn[TURN.direction] != 0 if what == END.stop else travel < np.inf


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_first_end(motion, h, travel, skip):
    """Return the first event inside a step of h [s], and a guess of its fraction of the step.

    Cubics through both ends of the step give the guess.

    skip: an event that is ignored. Without an event END.none and 1 are returned.
    """
    found = END.none
    where = 1.0
    for what in range(END.stop, END.lift + 1 if law.IS_SET_VALUED else END.travel + 1):
        if what == skip or not can_end(motion, what, travel):
            continue
        b, rate_b, noise = distance_to_end(
            motion, what, motion.work[WORK.trial], motion.work[12], travel
        )
        if b >= -noise:
            continue
        a, rate_a, _ = distance_to_end(motion, what, motion.state, motion.work[0], travel)
        a = max(a, 0.0)
        low = 0.0
        high = 1.0
        p = rate_a * h
        r = rate_b * h
        if a == 0:
            low = high = find_return(p, b, r)
        for _ in range(40 if a > 0 else 0):
            s = 0.5 * (low + high)
            remainder = 1 - s
            value = remainder * remainder * (a * (1 + 2 * s) + p * s) + s * s * (
                b * (3 - 2 * s) - r * remainder
            )
            if value > 0:
                low = s
            else:
                high = s
        if found == END.none or high < where:
            found = what
            where = high
    return found, where


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_return(p, b, r):
    """Return the fraction at which a cubic from 0 to b < 0 comes back to 0 from above.

    It is 0 where the cubic is nowhere above.

    p, r: its slopes at the ends over the step. Without the root at the start it is p + mid s + big
    s^2; the root where that decreases counts.
    """
    mid = 3 * b - 2 * p - r
    big = p + r - 2 * b
    root = mid * mid - 4 * big * p
    if root < 0:
        return 0.0
    root = sqrt(root)
    s = -(mid + root) / (2 * big) if mid > 0 else 2 * p / (root - mid) if root > mid else 0.0
    return s if 0 < s < 1 else 0.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def locate_end(motion, h, what, share, travel):
    """Return the length [s] of the step that ends at an event, by guarded Newton iterations.

    h: length [s] of a step beyond the event; share: guess of its fraction. work[WORK.trial]
    becomes the state there.
    """
    low = 0.0
    high = h
    at = max(share, 1e-12) * h
    for turn in range(60):
        steps.take_step(motion, at)
        value, rate, noise = distance_to_end(
            motion, what, motion.work[WORK.trial], motion.work[12], travel
        )
        if value > 0:
            low = at
        else:
            high = at
        new = at - value / rate if rate < 0 else 0.5 * (low + high)
        # a motion that leaves rest is within round-off of it too; it must not end there, or it would rest for ever
        there = abs(value) <= noise and rate < 0
        if there or abs(new - at) <= 2e-16 * (motion.now[NOW.time] + at) or high - low <= 1e-15 * h:
            break
        at = new if low < new < high and turn < 20 else 0.5 * (low + high)
    return at


@njit(error_model="numpy", **NJIT_INTERNAL)
def locate_release(motion, h, what, travel):
    """Return the length [s] of the step that ends just after a law lets go.

    The distance at the end of a step of h [s] is negative. Method: regula falsi with halved ends
    (Illinois), then bisection. work[WORK.trial] becomes the state there.
    """
    a = max(distance_to_end(motion, what, motion.state, motion.work[0], travel)[0], 0.0)
    b = distance_to_end(motion, what, motion.work[WORK.trial], motion.work[12], travel)[0]
    low = 0.0
    high = h
    for turn in range(80):
        if high - low <= 1e-15 * (motion.now[NOW.time] + high) or high - low <= 1e-13 * h:
            break
        at = low + (high - low) * a / (a - b) if turn < 25 and a > b else 0.5 * (low + high)
        at = min(max(at, low + 1e-3 * (high - low)), high - 1e-3 * (high - low)) if turn < 4 else at
        if not low < at < high:
            at = 0.5 * (low + high)
        steps.take_step(motion, at)
        value = distance_to_end(motion, what, motion.work[WORK.trial], motion.work[12], travel)[0]
        if value < 0:
            high = at
            b = value
            a = 0.5 * a
        else:
            low = at
            a = value
            b = 0.5 * b
    steps.take_step(motion, high)
    return high


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def find_dip(motion, h):
    """Return the fraction of a step of h [s] at which the speed may dip below zero.

    It is 0 where it does not.

    The speed is positive at both ends.
    """
    if motion.turn[TURN.direction] == 0:
        return 0.0
    a, p, _ = distance_to_end(motion, END.stop, motion.state, motion.work[0], np.inf)
    b, r, _ = distance_to_end(motion, END.stop, motion.work[WORK.trial], motion.work[12], np.inf)
    return find_cubic_dip(a, p * h, b, r * h)


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_cubic_dip(a, p, b, r):
    """Return the fraction at which a positive cubic may dip below zero, 0 if none.

    a, b: its values at the ends, both > 0.

    p, r: its slopes at the ends over the step. The cubic errs by s^2 (1 - s)^2 of the fourth
    derivative/24, so a minimum near zero counts.
    """
    if p >= 0 or r <= 0 or a <= 0 or b <= 0:
        return 0.0
    # a + p s + mid s^2 + big s^3
    big = 2 * (a - b) + p + r
    mid = 3 * (b - a) - 2 * p - r
    root = mid * mid - 3 * big * p
    if root <= 0:
        return 0.0
    s = -p / (mid + sqrt(root)) if mid + sqrt(root) != 0 else 0.0
    if s <= 0 or s >= 1:
        return 0.0
    near = (s * (1 - s)) ** 2 * (0.25 * abs(big) + 0.1 * abs(mid))
    return s if a + s * (p + s * (mid + s * big)) < near else 0.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def speed_round_off(motion):
    """Return the round-off of the velocity [m/s], below which the interface is at rest."""
    return 4e-16 * (
        motion.now[NOW.max_rate] + motion.now[NOW.fastest_rate] * motion.now[NOW.max_coordinate]
    )


@njit(error_model="numpy", **NJIT_INTERNAL)
def start_direction(motion, way):
    """Start the motion in a direction from the present state: states of the law, and slopes."""
    n = motion.modes.shape[1]
    q, v = steps.find_slide(motion, motion.state)
    motion.now[NOW.origin] = q
    motion.turn[TURN.direction] = way
    states = motion.state[2 * n : motion.state.size - 3]
    motion.turn[TURN.kink_path], floor = law.start_motion(
        motion.numbers[0], motion.memory[0], way, states
    )
    motion.turn[TURN.is_above_knee] = 1.0 if way * v > floor else 0.0
    motion.turn[TURN.knee_velocity] = floor
    steps.write_slopes(motion, motion.now[NOW.time], motion.state, motion.work[0])


@njit(error_model="numpy", **NJIT_INTERNAL)
def end_direction(motion, record):
    """End the motion in one direction: update the memory of the law and add what it dissipated."""
    n = motion.modes.shape[1]
    size = motion.state.size
    q, v, _, before, _ = watch.read_interface(motion, motion.state)
    lost = law.end_motion(
        motion.numbers[0],
        motion.memory[0],
        motion.turn,
        q - motion.now[NOW.origin],
        v,
        motion.state[2 * n : size - 3],
    )
    if np.isnan(lost):
        lost = motion.state[size - 1] - motion.now[NOW.start_loss] - before
        motion.now[NOW.start_loss] = motion.state[size - 1] - before
    record.counters[COUNT.friction_loss] += lost


@njit(error_model="numpy", **NJIT_INTERNAL)
def choose_direction(motion):
    """Return the direction of a motion that starts, by velocity, acceleration or what follows."""
    n = motion.modes.shape[1]
    t = motion.now[NOW.time]
    v = steps.find_slide(motion, motion.state)[1]
    if v != 0:
        return 1.0 if v > 0 else -1.0
    if law.IS_SET_VALUED:
        return find_release_direction(motion)
    steps.write_slopes(motion, t, motion.state, motion.work[0])
    for look in range(2):
        gain = 0.0
        for i in range(n):
            gain += motion.modes[MODE.slide, i] * motion.work[look, n + i]
        if gain != 0:
            return 1.0 if gain > 0 else -1.0
        if look == 0:
            steps.write_slopes(motion, t + motion.now[NOW.step], motion.state, motion.work[1])
    return 1.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_release_direction(motion):
    """Return the direction in which a law lets go of the interface at rest, or 0."""
    motion.turn[TURN.direction] = 0.0
    steps.write_slopes(motion, motion.now[NOW.time], motion.state, motion.work[0])
    return motion.turn[TURN.release_direction]


@njit(error_model="numpy", **NJIT_INTERNAL)
def stop_slide(motion):
    """Remove the round-off of a velocity that has stopped from the rates."""
    n = motion.modes.shape[1]
    v = steps.find_slide(motion, motion.state)[1]
    size = 0.0
    for i in range(n):
        size += motion.modes[MODE.slide, i] * motion.modes[MODE.slide, i]
    for i in range(n):
        motion.state[n + i] = (
            0.0 if n == 1 else motion.state[n + i] - motion.modes[MODE.slide, i] * v / size
        )


@njit(error_model="numpy", **NJIT_INTERNAL)
def reverse_or_continue(motion, period):
    """Start the motion after a stop.

    Returns whether it reverses, else it goes on in its direction.

    Where velocity and acceleration vanish together the next derivative decides: the motion has the
    direction of its velocity an instant after the stop, v + a t + j t^2/2.
    """
    n = motion.modes.shape[1]
    t = motion.now[NOW.time]
    way = -motion.turn[TURN.direction]
    start_direction(motion, way)
    ahead = INSTANT_FRACTION * period
    near = 1e-3 * motion.now[NOW.step]
    gain = 0.0
    later = 0.0
    for c in range(motion.state.size):
        motion.work[WORK.trial, c] = motion.state[c] + near * motion.work[0, c]
    steps.write_slopes(motion, t + near, motion.work[WORK.trial], motion.work[1])
    for i in range(n):
        gain += motion.modes[MODE.slide, i] * motion.work[0, n + i]
        later += motion.modes[MODE.slide, i] * motion.work[1, n + i]
    v = steps.find_slide(motion, motion.state)[1]
    jerk = (later - gain) / near
    if way * (v + ahead * (gain + 0.5 * ahead * jerk)) >= 0:
        return True
    start_direction(motion, -way)
    return False


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def accept_step(motion, h, record):
    """Move on by the step of h [s] in work[WORK.trial]."""
    n = motion.modes.shape[1]
    fade = 1 - min(h / (FADING_CYCLES * record.counters[COUNT.period]), 1.0)
    motion.now[NOW.max_coordinate] *= fade
    motion.now[NOW.max_rate] *= fade
    for c in range(motion.state.size):
        motion.state[c] = motion.work[WORK.trial, c]
        motion.work[0, c] = motion.work[12, c]
    if law.IS_SET_VALUED and motion.turn[TURN.direction] == 0:
        stop_slide(motion)
    for i in range(n):
        motion.now[NOW.max_coordinate] = max(motion.now[NOW.max_coordinate], abs(motion.state[i]))
        motion.now[NOW.max_rate] = max(motion.now[NOW.max_rate], abs(motion.state[n + i]))
    motion.now[NOW.time] += h


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def try_step(motion, h, tolerance, record):
    """Take a step of at most h [s] whose error meets the tolerance.

    Returns its length and the next one [s].
    """
    if law.IS_SET_VALUED:
        h = min(
            h,
            MAX_STUCK_STEP * record.counters[COUNT.period]
            if motion.turn[TURN.direction] == 0
            else np.inf,
        )
    for _ in range(60):
        steps.take_step(motion, h)
        error = steps.estimate_error(motion, h, tolerance)
        if error <= 1:
            dip = find_dip(motion, h)
            if dip == 0:
                grow = (
                    MAX_STEP_FACTOR
                    if error == 0
                    else min(max(STEP_SAFETY * error**-0.125, MIN_STEP_FACTOR), MAX_STEP_FACTOR)
                )
                return h, h * grow
            h *= dip
        else:
            h *= (
                max(STEP_SAFETY * error**-0.125, MIN_STEP_FACTOR)
                if np.isfinite(error)
                else MIN_STEP_FACTOR
            )
        record.counters[COUNT.refused] += 1
    return 0.0, 0.0


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def pass_end(motion, record, what):
    """Go on after the end of a step: in the other direction, or with the next branch of the law."""
    n = motion.modes.shape[1]
    if law.IS_SET_VALUED and what in (END.stop, END.release):
        stop_slide(motion)
        end_direction(motion, record)
        way = find_release_direction(motion)
        start_direction(motion, way)
        if way != 0 or what == END.stop:
            watch.write_sample(
                motion,
                motion.now[NOW.time],
                motion.state,
                record.turns[int(record.counters[COUNT.n_turns])],
            )
            record.counters[COUNT.n_turns] += 1
    elif what == END.stop:
        if n == 1:
            motion.state[1] = 0.0  # removes the round-off of the velocity
        end_direction(motion, record)
        if reverse_or_continue(motion, record.counters[COUNT.period]):
            watch.write_sample(
                motion,
                motion.now[NOW.time],
                motion.state,
                record.turns[int(record.counters[COUNT.n_turns])],
            )
            record.counters[COUNT.n_turns] += 1
    elif what == END.kink:
        end_direction(motion, record)
        start_direction(motion, motion.turn[TURN.direction])
    elif what == END.knee:
        motion.turn[TURN.is_above_knee] = 1 - motion.turn[TURN.is_above_knee]
        steps.write_slopes(motion, motion.now[NOW.time], motion.state, motion.work[0])


@njit(error_model="numpy", **NJIT_INTERNAL)
def start_from_state(motion, record):
    """Start a motion from the present state."""
    n = motion.modes.shape[1]
    for i in range(n):
        motion.now[NOW.max_coordinate] = max(motion.now[NOW.max_coordinate], abs(motion.state[i]))
        motion.now[NOW.max_rate] = max(motion.now[NOW.max_rate], abs(motion.state[n + i]))
    start_direction(motion, choose_direction(motion))
    record.counters[COUNT.max_stored] = watch.stored_energy(motion, motion.state)
    motion.now[NOW.start_loss] = (
        motion.state[motion.state.size - 1] - watch.read_interface(motion, motion.state)[3]
    )
    motion.now[NOW.stage] = 1.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def take_samples(motion, record):
    """Write the samples that are due at the present time."""
    at = int(record.counters[COUNT.next_sample])
    while at < record.samples.shape[0] and record.samples[at, 0] <= motion.now[NOW.time]:
        watch.write_sample(motion, motion.now[NOW.time], motion.state, record.samples[at])
        at += 1
    record.counters[COUNT.next_sample] = at


@njit(error_model="numpy", **NJIT_INTERNAL)
def resume(motion):
    """Return AT_STOP where the motion was left at a reversal because no row was free, else 0."""
    fresh = AT_STOP if motion.now[NOW.stage] == AT_REVERSAL else 0
    motion.now[NOW.stage] = 1.0
    return fresh


@njit(error_model="numpy", **NJIT_INTERNAL)
def locate_first_end(motion, taken, what, share, travel):
    """Return the length [s] of a tried step up to the first end in it, and what ends it."""
    while what != END.none:
        taken = (
            locate_end(motion, taken, what, share, travel)
            if what < END.release
            else locate_release(motion, taken, what, travel)
        )
        other, share = find_first_end(motion, taken, travel, what)
        if other == END.none:
            break
        what = other
    return taken, what


@njit(error_model="numpy", cache=True, nogil=True, **NJIT_NO_REFCOUNT)
def advance(motion, record, until, edge, tolerance, travel):
    """Move on to a time, or to the end of a segment of the drive.

    Parameters
    ----------
    motion : MotionArrays
    record : MotionRecord
    until, edge : float
        Time to reach, and end of the segment [s].
    tolerance : float
        Relative tolerance of a step.
    travel : float
        Of the output [m].

    Returns
    -------
    int
        A number of `CallStatus`. After `full` and `paused` the next call goes on as if the motion
        had not been left.
    """
    if motion.now[NOW.stage] == 0:
        start_from_state(motion, record)
    end = min(until, edge)
    fresh = resume(motion)
    if motion.now[NOW.slope_segment] != motion.now[NOW.segment]:  # the drive has changed
        steps.write_slopes(motion, motion.now[NOW.time], motion.state, motion.work[0])
        motion.now[NOW.slope_segment] = motion.now[NOW.segment]
    take_samples(motion, record)
    begun = motion.now[NOW.time]
    tried = record.counters[COUNT.accepted] + record.counters[COUNT.refused]
    while motion.now[NOW.time] < end:
        full = (
            record.counters[COUNT.n_turns] >= record.turns.shape[0]
            or 0 < record.parts.shape[0] < record.counters[COUNT.n_parts] + watch.MAX_PARTS
        )
        spent = (
            record.counters[COUNT.accepted] + record.counters[COUNT.refused] - tried > MAX_TRIES
            and fresh != FLIPPED
        )
        if spent and motion.now[NOW.time] - begun < MIN_PROGRESS / motion.now[NOW.fastest_rate]:
            return STATUS.no_step
        if full or spent:
            motion.now[NOW.stage] = AT_REVERSAL if fresh > 0 else 1.0
            return STATUS.full if full else STATUS.paused
        remaining = end - motion.now[NOW.time]
        whole = motion.now[NOW.step] >= remaining * (1 - 1e-9)
        h, wanted = try_step(
            motion, remaining if whole else motion.now[NOW.step], tolerance, record
        )
        if h <= 1e-16 * end:
            return STATUS.no_step
        taken = h
        what, share = find_first_end(motion, h, travel, END.none)
        if (
            what == END.stop
            and fresh > 0
            and share * h < INSTANT_FRACTION * record.counters[COUNT.period]
        ):
            if fresh == FLIPPED:  # the motion stops in both directions, which a smooth law excludes
                return STATUS.no_step
            start_direction(motion, -motion.turn[TURN.direction])
            fresh = FLIPPED
            continue
        taken, what = locate_first_end(motion, taken, what, share, travel)
        # the stages of the longer tried step may have missed strong curvature near the event, so the error of the
        # shortened step is checked as well
        if what != END.none:
            error = steps.estimate_error(motion, taken, tolerance)
            if error > 1:
                motion.now[NOW.step] = taken * max(STEP_SAFETY * error**-0.125, MIN_STEP_FACTOR)
                record.counters[COUNT.refused] += 1
                continue
        watch.record_step(motion, taken, record)
        accept_step(motion, taken, record)
        if whole and taken == remaining:
            motion.now[NOW.time] = end
        motion.now[NOW.step] = (
            max(wanted, motion.now[NOW.step]) if whole and h == remaining else wanted
        )
        if fresh == AT_STOP:
            motion.now[NOW.first_step] = wanted
        fresh = 0
        if not np.isfinite(motion.state[0]):
            return STATUS.not_finite
        if what == END.travel or what == END.lift:
            return STATUS.travel if what == END.travel else STATUS.lifted
        if what != END.none:
            pass_end(motion, record, what)
            if what == END.stop or what == END.release:
                fresh = AT_STOP
                motion.now[NOW.step] = min(motion.now[NOW.first_step], motion.now[NOW.step])
    take_samples(motion, record)
    return STATUS.finished


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def read_state(motion, record, row):
    """Write the sample of the present state into row.

    Returns the energy of modes and interface [J].

    The memory of the law moves to this state, so it is called on a copy of the motion.
    """
    out = watch.stored_energy(motion, motion.state)
    watch.write_sample(motion, motion.now[NOW.time], motion.state, row)
    end_direction(motion, record)
    return out
