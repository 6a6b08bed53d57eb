"""Loop over time steps with error control and events (compiled).

A step ends where the velocity vanishes, where the law has a kink along its path or at a speed, and
where the output reaches its travel. Newton's method on the length of the step finds such an end;
the step is taken anew each time, so the end is as exact as a step and needs no dense output.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INTERNAL, NJIT_NO_REFCOUNT
from ...friction.laws import stretch_kernels as law
from . import step_kernels as steps
from . import watch_kernels as watch
from .arrays import EVENT, STATUS, Counter, Mode, Scalar, Turn, Work

# Smallest ratio of a step to the previous step.
MIN_STEP_FACTOR = 0.2
# Largest ratio of a step to the previous step.
MAX_STEP_FACTOR = 8.0
# Safety factor of the length of the next step.
STEP_SAFETY = 0.9
# Value of scalars[Scalar.STAGE] if a call ended at a reversal.
AT_REVERSAL = 2.0
# Number of cycles over which the recent maxima of coordinates and rates decay.
FADING_CYCLES = 3.0
# Maximum number of tried steps in a call; they take 0.1 s, during which
# compiled code receives no signal.
MAX_TRIED_STEPS = 50_000
# Minimum progress in MAX_TRIED_STEPS steps, relative to the time scale of the fastest motion.
MIN_PROGRESS = 1e-3
# Largest time between two simultaneous events, in periods.
INSTANT_FRACTION = 1e-13
# Maximum step during stick, in periods; no other criterion limits it.
MAX_STUCK_STEP = 0.02
# States of a motion since a stop: it has moved, it is at the stop, or its
# direction was changed at the stop.
NOT_AT_STOP = 0
AT_STOP = 1
DIRECTION_CHANGED = 2


class EventDistance(NamedTuple):
    """Distance of a state to an event, positive before it, with its rate [1/s] and round-off."""

    distance: float
    rate: float
    round_off: float


@njit(error_model="numpy", **NJIT_INTERNAL)
def distance_to_event(motion, event, y, slopes, travel):
    """Return the distance of a state to an event.

    Parameters
    ----------
    motion : MotionArrays
    event : int
        A number of `StepEvents`.
    y : ndarray
        (N,) state.
    slopes : ndarray
        (N,) slopes of the state.
    travel : float
        Largest displacement of the output [m].

    Returns
    -------
    EventDistance
    """
    direction = motion.turn[Turn.DIRECTION]
    q, v = steps.find_slide(motion, y)
    acceleration = steps.find_slide(motion, slopes)[1]
    if event == EVENT.stop:
        return EventDistance(direction * v, direction * acceleration, speed_round_off(motion))
    if event == EVENT.kink:
        kink_path = motion.turn[Turn.KINK_PATH]
        path = direction * (q - motion.scalars[Scalar.ORIGIN])
        round_off = 1e-15 * (motion.scalars[Scalar.MAX_COORDINATE] + kink_path)
        return EventDistance(kink_path - path, -direction * v, round_off)
    if event == EVENT.knee:
        side = 1.0 if motion.turn[Turn.IS_ABOVE_KNEE] > 0 else -1.0
        knee = motion.turn[Turn.KNEE_VELOCITY]
        rate = side * direction * acceleration
        return EventDistance(side * (direction * v - knee), rate, 1e-12 * knee)
    # In the rates of a set-valued law, the loss is followed by the margin of the holding
    # force and by the normal force.
    if event >= EVENT.release:
        first = 2 * motion.modes.shape[1] + 1
        return EventDistance(slopes[first + event - EVENT.release], 0.0, 0.0)
    x, w = watch.find_output(motion, y)
    return EventDistance(travel - abs(x), -w if x > 0 else w, 1e-13 * travel)


@njit(error_model="numpy", **NJIT_INTERNAL)
def can_occur(motion, event, travel):
    """Return whether an event can occur in the present motion.

    Parameters
    ----------
    motion : MotionArrays
    event : int
        A number of `StepEvents`.
    travel : float
        Largest displacement of the output [m].

    Returns
    -------
    bool
    """
    if event == EVENT.kink:
        return motion.turn[Turn.KINK_PATH] < np.inf
    if event == EVENT.knee:
        return motion.turn[Turn.KNEE_VELOCITY] > 0
    if event >= EVENT.release:
        return law.IS_SET_VALUED and (event == EVENT.lift or motion.turn[Turn.DIRECTION] == 0)
    return motion.turn[Turn.DIRECTION] != 0 if event == EVENT.stop else travel < np.inf


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_first_event(motion, h, travel, skip):
    """Find the first event inside a step by cubics through its ends.

    Cubics through both ends of the step give the guess.

    Parameters
    ----------
    motion : MotionArrays
    h : float
        Length of the step [s].
    travel : float
        Largest displacement of the output [m].
    skip : int
        An event that is ignored.

    Returns
    -------
    event : int
        EVENT.none if no event lies in the step.
    fraction : float
        Guess of the fraction of the step at which it occurs; 1 if there is no event.
    """
    first_event = EVENT.none
    first_fraction = 1.0
    for event in range(EVENT.stop, EVENT.lift + 1 if law.IS_SET_VALUED else EVENT.travel + 1):
        if event == skip or not can_occur(motion, event, travel):
            continue
        b, rate_b, round_off = distance_to_event(
            motion, event, motion.work[Work.TRIAL], motion.work[12], travel
        )
        if b >= -round_off:
            continue
        a, rate_a, _ = distance_to_event(motion, event, motion.state, motion.work[0], travel)
        a = max(a, 0.0)
        left = 0.0
        right = 1.0
        p = rate_a * h
        r = rate_b * h
        if a == 0:
            left = right = find_cubic_return(p, b, r)
        for _ in range(40 if a > 0 else 0):
            s = 0.5 * (left + right)
            remainder = 1 - s
            value = remainder * remainder * (a * (1 + 2 * s) + p * s) + s * s * (
                b * (3 - 2 * s) - r * remainder
            )
            if value > 0:
                left = s
            else:
                right = s
        if first_event == EVENT.none or right < first_fraction:
            first_event = event
            first_fraction = right
    return first_event, first_fraction


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_cubic_return(p, b, r):
    """Return the fraction of a step at which a cubic returns to 0 from above.

    The cubic goes from 0 to b < 0.

    Without the root at the start the cubic is p + mid s + big s^2; the root at which that decreases
    counts.

    Parameters
    ----------
    p, r : float
        Slopes of the cubic at the ends, per step.
    b : float
        Its value at the end, less than 0.

    Returns
    -------
    float
        0 if the cubic is nowhere positive.
    """
    c2 = 3 * b - 2 * p - r
    c3 = p + r - 2 * b
    root = c2 * c2 - 4 * c3 * p
    if root < 0:
        return 0.0
    root = sqrt(root)
    s = 0.0
    if c2 > 0:
        s = -(c2 + root) / (2 * c3)
    elif root > c2:
        s = 2 * p / (root - c2)
    return s if 0 < s < 1 else 0.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def locate_event(motion, h, event, fraction, travel):
    """Return the length of the step that ends at an event, by guarded Newton iterations.

    Parameters
    ----------
    motion : MotionArrays
    h : float
        Length of a step beyond the event [s].
    event : int
        A number of `StepEvents`.
    fraction : float
        Guess of its fraction of the step.
    travel : float
        Largest displacement of the output [m].

    Returns
    -------
    float
        [s]; work[Work.TRIAL] becomes the state there.
    """
    shortest = 0.0
    longest = h
    length = max(fraction, 1e-12) * h
    for turn in range(60):
        steps.take_step(motion, length)
        value, rate, noise = distance_to_event(
            motion, event, motion.work[Work.TRIAL], motion.work[12], travel
        )
        if value > 0:
            shortest = length
        else:
            longest = length
        new = length - value / rate if rate < 0 else 0.5 * (shortest + longest)
        # A motion that leaves rest is also within round-off of the event; it must
        # continue, or it would never leave.
        is_at_event = abs(value) <= noise and rate < 0
        if (
            is_at_event
            or abs(new - length) <= 2e-16 * (motion.scalars[Scalar.TIME] + length)
            or longest - shortest <= 1e-15 * h
        ):
            break
        length = new if shortest < new < longest and turn < 20 else 0.5 * (shortest + longest)
    return length


@njit(error_model="numpy", **NJIT_INTERNAL)
def locate_release(motion, h, event, travel):
    """Return the length of the step that ends just after the release of a set-valued law.

    Method: regula falsi with halved ends (Illinois), then bisection.

    Parameters
    ----------
    motion : MotionArrays
    h : float
        Length of a step at whose end the distance is negative [s].
    event : int
        A number of `StepEvents`.
    travel : float
        Largest displacement of the output [m].

    Returns
    -------
    float
        [s]; work[Work.TRIAL] becomes the state there.
    """
    a = max(distance_to_event(motion, event, motion.state, motion.work[0], travel)[0], 0.0)
    b = distance_to_event(motion, event, motion.work[Work.TRIAL], motion.work[12], travel)[0]
    shortest = 0.0
    longest = h
    for turn in range(80):
        if (
            longest - shortest <= 1e-15 * (motion.scalars[Scalar.TIME] + longest)
            or longest - shortest <= 1e-13 * h
        ):
            break
        length = (
            shortest + (longest - shortest) * a / (a - b)
            if turn < 25 and a > b
            else 0.5 * (shortest + longest)
        )
        length = (
            min(
                max(length, shortest + 1e-3 * (longest - shortest)),
                longest - 1e-3 * (longest - shortest),
            )
            if turn < 4
            else length
        )
        if not shortest < length < longest:
            length = 0.5 * (shortest + longest)
        steps.take_step(motion, length)
        value = distance_to_event(motion, event, motion.work[Work.TRIAL], motion.work[12], travel)[
            0
        ]
        if value < 0:
            longest = length
            b = value
            a = 0.5 * a
        else:
            shortest = length
            a = value
            b = 0.5 * b
    steps.take_step(motion, longest)
    return longest


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def find_speed_dip(motion, h):
    """Return the fraction of a step at which the relative speed may fall below zero.

    It is 0 if it does not.

    The speed is positive at both ends.
    """
    if motion.turn[Turn.DIRECTION] == 0:
        return 0.0
    a, p, _ = distance_to_event(motion, EVENT.stop, motion.state, motion.work[0], np.inf)
    b, r, _ = distance_to_event(
        motion, EVENT.stop, motion.work[Work.TRIAL], motion.work[12], np.inf
    )
    return find_cubic_dip(a, p * h, b, r * h)


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_cubic_dip(a, p, b, r):
    """Return the fraction of a step at which a positive cubic may fall below zero.

    The cubic errs by s^2 (1 - s)^2 of the fourth derivative/24, so a minimum near zero counts.

    Parameters
    ----------
    a, b : float
        Values of the cubic at the ends, both greater than 0.
    p, r : float
        Its slopes at the ends, per step.

    Returns
    -------
    float
        0 if it does not.
    """
    if p >= 0 or r <= 0 or a <= 0 or b <= 0:
        return 0.0
    # The cubic is a + p s + mid s^2 + big s^3.
    c3 = 2 * (a - b) + p + r
    c2 = 3 * (b - a) - 2 * p - r
    root = c2 * c2 - 3 * c3 * p
    if root <= 0:
        return 0.0
    s = -p / (c2 + sqrt(root)) if c2 + sqrt(root) != 0 else 0.0
    if s <= 0 or s >= 1:
        return 0.0
    max_error = (s * (1 - s)) ** 2 * (0.25 * abs(c3) + 0.1 * abs(c2))
    return s if a + s * (p + s * (c2 + s * c3)) < max_error else 0.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def speed_round_off(motion):
    """Return the round-off error of the relative velocity [m/s]; a slower interface is at rest."""
    return 4e-16 * (
        motion.scalars[Scalar.MAX_RATE]
        + motion.scalars[Scalar.FASTEST_RATE] * motion.scalars[Scalar.MAX_COORDINATE]
    )


@njit(error_model="numpy", **NJIT_INTERNAL)
def start_direction(motion, direction):
    """Start the motion in a direction: set the states of the law and the slopes."""
    n = motion.modes.shape[1]
    q, v = steps.find_slide(motion, motion.state)
    motion.scalars[Scalar.ORIGIN] = q
    motion.turn[Turn.DIRECTION] = direction
    states = motion.state[2 * n : motion.state.size - 3]
    motion.turn[Turn.KINK_PATH], floor = law.start_motion(
        motion.numbers[0], motion.memory[0], direction, states
    )
    motion.turn[Turn.IS_ABOVE_KNEE] = 1.0 if direction * v > floor else 0.0
    motion.turn[Turn.KNEE_VELOCITY] = floor
    steps.write_slopes(motion, motion.scalars[Scalar.TIME], motion.state, motion.work[0])


@njit(error_model="numpy", **NJIT_INTERNAL)
def end_direction(motion, record):
    """End the motion in a direction: update the memory of the law and its friction loss."""
    n = motion.modes.shape[1]
    size = motion.state.size
    interface = watch.read_interface(motion, motion.state)
    energy = interface.energy
    loss = law.end_motion(
        motion.numbers[0],
        motion.memory[0],
        motion.turn,
        interface.slide - motion.scalars[Scalar.ORIGIN],
        interface.velocity,
        motion.state[2 * n : size - 3],
    )
    if np.isnan(loss):
        loss = motion.state[size - 1] - motion.scalars[Scalar.START_LOSS] - energy
        motion.scalars[Scalar.START_LOSS] = motion.state[size - 1] - energy
    record.counters[Counter.FRICTION_LOSS] += loss


@njit(error_model="numpy", **NJIT_INTERNAL)
def choose_direction(motion):
    """Return the initial direction of a motion, from its velocity or else its acceleration."""
    t = motion.scalars[Scalar.TIME]
    v = steps.find_slide(motion, motion.state)[1]
    if v != 0:
        return 1.0 if v > 0 else -1.0
    if law.IS_SET_VALUED:
        return find_release_direction(motion)
    for time in (t, t + motion.scalars[Scalar.STEP]):
        steps.write_slopes(motion, time, motion.state, motion.work[0])
        acceleration = steps.find_slide(motion, motion.work[0])[1]
        if acceleration != 0:
            return 1.0 if acceleration > 0 else -1.0
    return 1.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_release_direction(motion):
    """Return the direction in which a set-valued law releases the resting interface, or 0."""
    motion.turn[Turn.DIRECTION] = 0.0
    steps.write_slopes(motion, motion.scalars[Scalar.TIME], motion.state, motion.work[0])
    return motion.turn[Turn.RELEASE_DIRECTION]


@njit(error_model="numpy", **NJIT_INTERNAL)
def stop_slide(motion):
    """Remove the round-off of a stopped relative velocity from the modal rates."""
    n = motion.modes.shape[1]
    v = steps.find_slide(motion, motion.state)[1]
    size = 0.0
    for i in range(n):
        size += motion.modes[Mode.SLIDE, i] * motion.modes[Mode.SLIDE, i]
    for i in range(n):
        motion.state[n + i] = (
            0.0 if n == 1 else motion.state[n + i] - motion.modes[Mode.SLIDE, i] * v / size
        )


@njit(error_model="numpy", **NJIT_INTERNAL)
def reverse_or_continue(motion, period):
    """Start the motion after a stop; return whether its direction is reversed.

    Returns whether it reverses, else it goes on in its direction.

    Where velocity and acceleration vanish together the next derivative decides: the motion has the
    direction of its velocity an instant after the stop, v + a t + j t^2/2.
    """
    t = motion.scalars[Scalar.TIME]
    direction = -motion.turn[Turn.DIRECTION]
    start_direction(motion, direction)
    instant = INSTANT_FRACTION * period
    h = 1e-3 * motion.scalars[Scalar.STEP]
    for c in range(motion.state.size):
        motion.work[Work.TRIAL, c] = motion.state[c] + h * motion.work[0, c]
    steps.write_slopes(motion, t + h, motion.work[Work.TRIAL], motion.work[1])
    acceleration = steps.find_slide(motion, motion.work[0])[1]
    jerk = (steps.find_slide(motion, motion.work[1])[1] - acceleration) / h
    v = steps.find_slide(motion, motion.state)[1]
    if direction * (v + instant * (acceleration + 0.5 * instant * jerk)) >= 0:
        return True
    start_direction(motion, -direction)
    return False


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def update_sizes(motion):
    """Include the present state in the recent maxima of coordinates and rates."""
    n = motion.modes.shape[1]
    for i in range(n):
        motion.scalars[Scalar.MAX_COORDINATE] = max(
            motion.scalars[Scalar.MAX_COORDINATE], abs(motion.state[i])
        )
        motion.scalars[Scalar.MAX_RATE] = max(
            motion.scalars[Scalar.MAX_RATE], abs(motion.state[n + i])
        )


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def accept_step(motion, h, record):
    """Accept a tried step: advance state, time and recent maxima.

    Parameters
    ----------
    motion : MotionArrays
    h : float
        Length of the step [s].
    record : MotionRecord
    """
    fade = 1 - min(h / (FADING_CYCLES * record.counters[Counter.PERIOD]), 1.0)
    motion.scalars[Scalar.MAX_COORDINATE] *= fade
    motion.scalars[Scalar.MAX_RATE] *= fade
    for c in range(motion.state.size):
        motion.state[c] = motion.work[Work.TRIAL, c]
        motion.work[0, c] = motion.work[12, c]
    if law.IS_SET_VALUED and motion.turn[Turn.DIRECTION] == 0:
        stop_slide(motion)
    update_sizes(motion)
    motion.scalars[Scalar.TIME] += h


@njit(error_model="numpy", **NJIT_INTERNAL)
def step_factor(error):
    """Return the ratio of the next step to the last one, from its error relative to the tolerance."""
    if error == 0:
        return MAX_STEP_FACTOR
    if not np.isfinite(error):
        return MIN_STEP_FACTOR
    return min(max(STEP_SAFETY * error**-0.125, MIN_STEP_FACTOR), MAX_STEP_FACTOR)


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def try_step(motion, h, tolerance, record):
    """Try steps until the error meets the tolerance.

    Parameters
    ----------
    motion : MotionArrays
    h : float
        Largest length [s].
    tolerance : float
        Relative tolerance of a step.
    record : MotionRecord

    Returns
    -------
    h : float
        Length of the step [s]; 0 if no step meets the tolerance.
    next_step : float
        Length of the next step [s].
    """
    if law.IS_SET_VALUED:
        if motion.turn[Turn.DIRECTION] == 0:
            h = min(h, MAX_STUCK_STEP * record.counters[Counter.PERIOD])
    for _ in range(60):
        steps.take_step(motion, h)
        error = steps.estimate_error(motion, h, tolerance)
        if error <= 1:
            dip = find_speed_dip(motion, h)
            if dip == 0:
                return h, h * step_factor(error)
            h *= dip
        else:
            h *= step_factor(error)
        record.counters[Counter.REFUSED] += 1
    return 0.0, 0.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def record_reversal(motion, record):
    """Append the sample of a reversal at the present time to the record."""
    row = record.turns[int(record.counters[Counter.N_TURNS])]
    watch.write_sample(motion, motion.scalars[Scalar.TIME], motion.state, row)
    record.counters[Counter.N_TURNS] += 1


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def pass_event(motion, record, event):
    """Continue after an event, in the other direction or on the next branch of the law.

    Parameters
    ----------
    motion : MotionArrays
    record : MotionRecord
    event : int
        A number of `StepEvents`.
    """
    n = motion.modes.shape[1]
    if law.IS_SET_VALUED and event in (EVENT.stop, EVENT.release):
        stop_slide(motion)
        end_direction(motion, record)
        direction = find_release_direction(motion)
        start_direction(motion, direction)
        if direction != 0 or event == EVENT.stop:
            record_reversal(motion, record)
    elif event == EVENT.stop:
        if n == 1:
            motion.state[1] = 0.0  # remove the round-off error of the velocity
        end_direction(motion, record)
        if reverse_or_continue(motion, record.counters[Counter.PERIOD]):
            record_reversal(motion, record)
    elif event == EVENT.kink:
        end_direction(motion, record)
        start_direction(motion, motion.turn[Turn.DIRECTION])
    elif event == EVENT.knee:
        motion.turn[Turn.IS_ABOVE_KNEE] = 1 - motion.turn[Turn.IS_ABOVE_KNEE]
        steps.write_slopes(motion, motion.scalars[Scalar.TIME], motion.state, motion.work[0])


@njit(error_model="numpy", **NJIT_INTERNAL)
def start_from_state(motion, record):
    """Start a motion from the present state."""
    update_sizes(motion)
    start_direction(motion, choose_direction(motion))
    record.counters[Counter.MAX_STORED] = watch.stored_energy(motion, motion.state)
    motion.scalars[Scalar.START_LOSS] = (
        motion.state[motion.state.size - 1] - watch.read_interface(motion, motion.state).energy
    )
    motion.scalars[Scalar.STAGE] = 1.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def take_samples(motion, record):
    """Write the samples that are due at the present time into the record."""
    at = int(record.counters[Counter.NEXT_SAMPLE])
    while at < record.samples.shape[0] and record.samples[at, 0] <= motion.scalars[Scalar.TIME]:
        watch.write_sample(motion, motion.scalars[Scalar.TIME], motion.state, record.samples[at])
        at += 1
    record.counters[Counter.NEXT_SAMPLE] = at


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_stop_state(motion):
    """Return whether the motion was interrupted at a reversal.

    It is AT_STOP if no row was free then, else NOT_AT_STOP.
    """
    stop_state = AT_STOP if motion.scalars[Scalar.STAGE] == AT_REVERSAL else NOT_AT_STOP
    motion.scalars[Scalar.STAGE] = 1.0
    return stop_state


@njit(error_model="numpy", **NJIT_INTERNAL)
def locate_first_event(motion, step_length, event, fraction, travel):
    """Return the length of a tried step up to its first event, and that event.

    Parameters
    ----------
    motion : MotionArrays
    step_length : float
        Length of the tried step [s].
    event : int
        A number of `StepEvents`.
    fraction : float
        Guess of the fraction of the step at which the event occurs.
    travel : float
        Largest displacement of the output [m].

    Returns
    -------
    step_length : float
        Length of the step [s].
    event : int
    """
    while event != EVENT.none:
        if event < EVENT.release:
            step_length = locate_event(motion, step_length, event, fraction, travel)
        else:
            step_length = locate_release(motion, step_length, event, travel)
        other, fraction = find_first_event(motion, step_length, travel, event)
        if other == EVENT.none:
            break
        event = other
    return step_length, event


@njit(error_model="numpy", **NJIT_INTERNAL)
def meets_tolerance(motion, step_length, tolerance, record):
    """Return whether a step that an event has shortened meets the tolerance.

    If not, the next step is shortened.

    The stages of the longer tried step may have missed strong curvature near the event.

    Parameters
    ----------
    motion : MotionArrays
    step_length : float
        Length of the step [s].
    tolerance : float
        Relative tolerance of a step.
    record : MotionRecord

    Returns
    -------
    bool
    """
    error = steps.estimate_error(motion, step_length, tolerance)
    if error > 1:
        motion.scalars[Scalar.STEP] = step_length * step_factor(error)
        record.counters[Counter.REFUSED] += 1
        return False
    return True


@njit(error_model="numpy", **NJIT_INTERNAL)
def count_tried_steps(record):
    """Return the number of accepted and refused steps."""
    return record.counters[Counter.ACCEPTED] + record.counters[Counter.REFUSED]


@njit(error_model="numpy", **NJIT_INTERNAL)
def has_free_rows(record):
    """Return whether the record has free rows for the reversal and the parts of a step."""
    if record.counters[Counter.N_TURNS] >= record.turns.shape[0]:
        return False
    n_rows = record.parts.shape[0]
    return n_rows == 0 or n_rows >= record.counters[Counter.N_PARTS] + watch.MAX_PARTS


@njit(error_model="numpy", cache=True, nogil=True, **NJIT_NO_REFCOUNT)
def advance_motion(motion, record, until, segment_end, tolerance, travel):
    """Advance the motion to a time, or to the end of a drive segment.

    Parameters
    ----------
    motion : MotionArrays
    record : MotionRecord
    until, segment_end : float
        Time to reach, and end of the drive segment [s].
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
    if motion.scalars[Scalar.STAGE] == 0:
        start_from_state(motion, record)
    end = min(until, segment_end)
    stop_state = find_stop_state(motion)
    if motion.scalars[Scalar.SLOPE_SEGMENT] != motion.scalars[Scalar.SEGMENT]:
        # The slopes are evaluated again, because the drive has changed.
        steps.write_slopes(motion, motion.scalars[Scalar.TIME], motion.state, motion.work[0])
        motion.scalars[Scalar.SLOPE_SEGMENT] = motion.scalars[Scalar.SEGMENT]
    take_samples(motion, record)
    begin = motion.scalars[Scalar.TIME]
    n_before = count_tried_steps(record)
    while motion.scalars[Scalar.TIME] < end:
        is_full = not has_free_rows(record)
        is_spent = (
            count_tried_steps(record) - n_before > MAX_TRIED_STEPS
            and stop_state != DIRECTION_CHANGED
        )
        progress = motion.scalars[Scalar.TIME] - begin
        if is_spent and progress < MIN_PROGRESS / motion.scalars[Scalar.FASTEST_RATE]:
            return STATUS.no_step
        if is_full or is_spent:
            motion.scalars[Scalar.STAGE] = AT_REVERSAL if stop_state > 0 else 1.0
            return STATUS.full if is_full else STATUS.paused
        remaining = end - motion.scalars[Scalar.TIME]
        is_last = motion.scalars[Scalar.STEP] >= remaining * (1 - 1e-9)
        h, next_step = try_step(
            motion, remaining if is_last else motion.scalars[Scalar.STEP], tolerance, record
        )
        if h <= 1e-16 * end:
            return STATUS.no_step
        event, fraction = find_first_event(motion, h, travel, EVENT.none)
        is_at_stop = (
            event == EVENT.stop
            and stop_state > 0
            and fraction * h < INSTANT_FRACTION * record.counters[Counter.PERIOD]
        )
        if is_at_stop:
            # The motion stops in both directions, which a smooth law excludes.
            if stop_state == DIRECTION_CHANGED:
                return STATUS.no_step
            start_direction(motion, -motion.turn[Turn.DIRECTION])
            stop_state = DIRECTION_CHANGED
            continue
        step_length, event = locate_first_event(motion, h, event, fraction, travel)
        if event != EVENT.none and not meets_tolerance(motion, step_length, tolerance, record):
            continue
        watch.record_step(motion, step_length, record)
        accept_step(motion, step_length, record)
        if is_last and step_length == remaining:
            motion.scalars[Scalar.TIME] = end
        if is_last and h == remaining:
            motion.scalars[Scalar.STEP] = max(next_step, motion.scalars[Scalar.STEP])
        else:
            motion.scalars[Scalar.STEP] = next_step
        if stop_state == AT_STOP:
            motion.scalars[Scalar.FIRST_STEP] = next_step
        stop_state = NOT_AT_STOP
        if not np.isfinite(motion.state[0]):
            return STATUS.not_finite
        if event == EVENT.travel or event == EVENT.lift:
            return STATUS.travel if event == EVENT.travel else STATUS.lifted
        if event != EVENT.none:
            pass_event(motion, record, event)
            if event == EVENT.stop or event == EVENT.release:
                stop_state = AT_STOP
                motion.scalars[Scalar.STEP] = min(
                    motion.scalars[Scalar.FIRST_STEP], motion.scalars[Scalar.STEP]
                )
    take_samples(motion, record)
    return STATUS.finished


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def read_state(motion, record, row):
    """Write the sample of the present state into a row and return the stored energy.

    The memory of the law moves to this state, so it is called on a copy of the motion.

    Parameters
    ----------
    motion : MotionArrays
    record : MotionRecord
    row : ndarray
        (2 n + 7,) sample, which is written.

    Returns
    -------
    float
        Energy of modes and interface [J].
    """
    out = watch.stored_energy(motion, motion.state)
    watch.write_sample(motion, motion.scalars[Scalar.TIME], motion.state, row)
    end_direction(motion, record)
    return out
