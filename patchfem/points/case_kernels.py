"""Many cases of one mode and one contact point in a compiled loop.

A step moves the mode exactly under a parabola of the drive and a friction force that is constant or linear
in time, with the mean of the law (`return_maps_kernels`); errors are of order 2 to 3. A step in which the velocity
changes its sign, or a rigid point is released, is halved up to LEVELS times, because a law takes the net increment as
its path; events of a rigid point are then located by linear interpolation. A motion that repeats is not computed again.

Kernels get the rows of one case: `case` has its constants (`case_rows.Number`), such as MOBILITY, the acceleration of the
slide per friction force [1/kg]; `now` is its state at the end of the last step (`case_rows.Now`), `seen` what was observed
in the window (`case_rows.Seen`), and `loop` a cycle of the window (`case_rows.Loop`). `numbers[:, j]` and `memory[:, j]` are
those of its law; the table of `return_maps_kernels` names their rows.
"""

from math import cos, inf, nan, sin, sqrt, tanh
from typing import NamedTuple

import numpy as np

from ..compiled.flags_kernels import NJIT_KERNEL
from ..compiled.jit import njit
from .case_rows import SAME_CASE_CYCLE, Loop, Now, Number, Seen
from .return_maps_kernels import (
    Law,
    MeanForce,
    Step,
    advance,
    mean_force,
    prepare,
    read,
    slip_share,
)

LEVELS = 5  # halvings of a step that contains an event
TICKS = 1 << LEVELS  # shortest steps in a step
MAX_TRIALS = 60  # Newton steps and bisections for the increment of a step
# Residual of a step relative to its increments. The residuals of successive steps have the same sign, so that the error of
# a motion is some ten times as large; it must stay far below that of the steps.
CASE_RESIDUAL = 1e-10
GAUSS_POINT = (
    0.7745966692414834  # sqrt(3/5), distance of the outer points of Gauss's rule from the middle
)
# Distance of the mean force from the mean of the forces at both ends of a step, relative to the force of the drive and to
# the squared phase of a whole step, above which the step is halved
MAX_FORCE_BEND = 0.1
# Velocities at both ends of a step with a reversal, relative to the reference speed of the law "tanh", beyond which its
# force changes like that of a rigid point
STEEP_TURN = 2.0
# Change of the irreversible part of the motion in a step from which it is a jump at a corner of the law
MIN_SHARE_JUMP = 0.5
N_READ = 2  # measured cycles of a motion that repeats


@njit(**NJIT_KERNEL)
def solve_step(free, response, dt, case, now, numbers, memory, j):
    """Solve the slide dq [m] of a step, on which its friction force depends, by Newton's method in a bracket.

    Over the step F(t) is linear with the time mean F_m and the change D from its value at the start. By the responses
    beta [m/N] to a constant force and tilt [m/N] to a force t/dt - 1/2, dq = free - beta F_m(dq) - tilt D(dq). As the slide
    is nearly the parabola through its ends with the velocities v0 and v1, F_m is the path mean plus K dt (v0 - v1)/12 with
    the secant K = D/dq of the elastic force, so that steps without a kink of the law are of order 4.

    Parameters
    ----------
    free : (float, float)
        Increment of the slide [m] without friction, and velocity [m/s] at the end of the step without friction.
    response : (2, 5) array
        Slide and velocity at the end of the step per unit of `cases.make_responses`.
    dt : float
        Duration of the step [s].
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    now : (20,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    numbers : (k, m) array
        Numbers of the laws of m points. Row 0 is the `Law`.
    memory : (l, m) array
        Memory of the laws of m points, a column for each.
    j : int
        Number of the point.

    Returns
    -------
    (float, float, float, float, float)
        Increment [m], velocity at the end [m/s], path-mean force [N], its time mean [N], and the distance of the path mean
        from the mean of the forces at both ends [N], inf without convergence.
    """
    # Increment and velocity per unit of a constant force, and of a force that changes as t/dt - 1/2. Columns 2 and 3 of
    # the response belong to accelerations 1 and t.
    mobility = case[Number.MOBILITY]
    beta = response[0, 2] * mobility
    gamma = response[1, 2] * mobility
    tilt = (response[0, 3] / dt - 0.5 * response[0, 2]) * mobility
    velocity_tilt = (response[1, 3] / dt - 0.5 * response[1, 2]) * mobility
    load = case[Number.LOAD]
    start = now[Now.VELOCITY]
    follows_path = numbers[0, j] != Law.TANH

    # The mean force is extrapolated from that of the last step and the force at its end.
    force = 2 * now[Now.FORCE] - now[Now.MEAN]
    dq = free[0] - beta * force
    end = free[1] - gamma * force
    low = -inf
    high = inf
    change = 0.0
    time_mean = force
    mean = MeanForce(0.0, 0.0, 0.0, 0.0, 0.0)
    is_solved = False

    # Newton's method; the step falls back to bisection where it would leave the bracket.
    for _ in range(MAX_TRIALS):
        mean = mean_force(numbers, memory, j, load, Step(dq, dt, start, end, gamma))
        force = mean.force
        time_mean = force
        change = mean.end - now[Now.FORCE]
        elastic = mean.bend if numbers[0, j] == Law.LUGRE else change
        if follows_path and dq != 0 and start != end:
            bend = dt / 12 * (start - end)
            if start * end < 0:
                # The part of the path that is not retraced, as the secant loses its meaning at a reversal.
                bend *= abs((start + end) / (start - end))
            time_mean += elastic / dq * bend
        residual = dq - free[0] + beta * time_mean + tilt * change
        if abs(residual) <= CASE_RESIDUAL * (abs(free[0]) + abs(dq)):
            is_solved = True
            break
        if residual > 0:
            high = dq
        else:
            low = dq
        # The force at the end changes twice as much as the mean, the time mean two thirds as much if it follows the path.
        slope = mean.by_increment + gamma / beta * mean.by_velocity
        weight = beta * (2 / 3 if time_mean != force else 1.0)
        slope = 1 + slope * (weight + (2 * tilt if mean.by_increment != 0 else 0.0))
        dq -= residual / slope if slope > 0 else residual
        if not low < dq < high:
            dq = 0.5 * (low + high) if high - low < inf else free[0] - beta * force
        # Velocity and displacement at the end differ from the free ones by the same mean force.
        end = free[1] - gamma / beta * (free[0] - dq - tilt * change) - velocity_tilt * change

    # A force that is steeper than the iteration can follow is resolved by shorter steps.
    bend = mean.bend if not follows_path else force - now[Now.FORCE] - 0.5 * change
    return dq, end, force, time_mean, bend if is_solved else inf


@njit(**NJIT_KERNEL)
def end_at_event(q, v, dt, hold, case, now, numbers, memory, j):
    """Resolve the release, stop or reversal of a Coulomb point inside a shortest step.

    Row 0 of the memory is the direction of slip, 0 at rest. The event is located at a fraction `Now.EVENT` of the step.

    Parameters
    ----------
    q : float
        Slide at the end of the step as if there were no event [m].
    v : float
        Velocity at the end of the step as if there were no event [m/s].
    dt : float
        Duration of the step [s].
    hold : float
        Force that would keep the point at rest at the end of the step [N].
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    now : (20,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    numbers : (k, m) array
        Numbers of the laws of m points. Row 0 is the `Law`.
    memory : (l, m) array
        Memory of the laws of m points, a column for each.
    j : int
        Number of the point.
    """
    mobility = case[Number.MOBILITY]
    load = case[Number.LOAD]
    direction = memory[0, j]
    now[Now.SHARE_BEFORE] = abs(direction)
    slip_force = numbers[2, j] * load
    rest_force = numbers[1, j] * load
    if direction == 0:
        # Release: the force falls to that of slip at a fraction of the step.
        first = abs(now[Now.FORCE])
        fraction = (rest_force - first) / (abs(hold) - first) if abs(hold) > first else 1.0
        fraction = min(max(fraction, 0.0), 1.0)
        now[Now.EVENT] = fraction
        rest = (1 - fraction) * dt
        memory[0, j] = 1.0 if hold > 0 else -1.0
        # The force beyond that of slip is linear in the rest of the step.
        excess = memory[0, j] * (rest_force - slip_force)
        last = hold - memory[0, j] * slip_force
        now[Now.VELOCITY] = mobility * rest / 2 * (excess + last)
        now[Now.SLIDE] += mobility * rest * rest / 6 * (2 * excess + last)
        return

    # The slip stops at a fraction of the step, in which the velocity falls linearly.
    fraction = now[Now.VELOCITY] / (now[Now.VELOCITY] - v)
    now[Now.EVENT] = fraction
    rest = (1 - fraction) * dt
    if abs(hold) <= rest_force:
        memory[0, j] = 0.0
        now[Now.TURN_FORCE] = nan  # rigid friction at rest takes many values
        now[Now.SLIDE] += 0.5 * now[Now.VELOCITY] * fraction * dt
        now[Now.VELOCITY] = 0.0
        return
    # Reversal: for the rest of the step the force has the other sign.
    memory[0, j] = -direction
    now[Now.TURN_FORCE] = 0.0
    change = 2 * mobility * direction * slip_force * rest
    now[Now.SLIDE] = q + 0.5 * change * rest
    now[Now.VELOCITY] = v + change


@njit(**NJIT_KERNEL)
def count_halvings(part):
    """Return how often a step must be halved so that it is not much longer than the fraction `part` of it; at least once."""
    count = 1
    while part < 0.5 and count < LEVELS:
        part *= 2
        count += 1
    return count


@njit(**NJIT_KERNEL)
def try_step(waves, dt, response, is_shortest, max_bend, case, now, numbers, memory, j):
    """Advance a case by a step and return 0, or return how often a step that contains an event has to be halved.

    After the step `now` has slide, velocity and mean forces of its end, and `memory` is that of its end.

    Parameters
    ----------
    waves : tuple of float
        Sines of the drive at the start, in the middle and at the end of the step.
    dt : float
        Duration of the step [s].
    response : (2, 5) array
        Slide and velocity at the end of the step per unit of `cases.make_responses`.
    is_shortest : bool
        Whether the step cannot be halved.
    max_bend : float
        Largest difference [N] of the mean force from the mean of the forces at both ends. Above it the law has a corner
        in the step.
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    now : (20,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    numbers : (k, m) array
        Numbers of the laws of m points. Row 0 is the `Law`.
    memory : (l, m) array
        Memory of the laws of m points, a column for each.
    j : int
        Number of the point.
    """
    now[Now.EVENT] = -1.0

    # Parabola of the drive through its three values, and the free motion at the end of the step.
    drive = case[Number.DRIVE]
    q = now[Now.SLIDE]
    v = now[Now.VELOCITY]
    slope = drive * (4 * waves[1] - 3 * waves[0] - waves[2]) / dt
    curvature = drive * 4 * (waves[0] - 2 * waves[1] + waves[2]) / (dt * dt)
    constant = drive * waves[0]
    row = response[0]
    free = row[0] * q + row[1] * v + row[2] * constant + row[3] * slope + row[4] * curvature - q
    row = response[1]
    free_velocity = (
        row[0] * q + row[1] * v + row[2] * constant + row[3] * slope + row[4] * curvature
    )

    is_rigid = numbers[0, j] == Law.COULOMB
    mobility = case[Number.MOBILITY]
    load = case[Number.LOAD]

    # A rigid point slips under the kinetic force mu_k N, or rests under the force that balances drive and spring.
    if is_rigid:
        direction = memory[0, j]
        force = direction * numbers[2, j] * load
        if direction == 0:
            hold = (drive * waves[2] - case[Number.STIFFNESS] * q) / mobility
            if abs(hold) > numbers[1, j] * load:
                if not is_shortest:
                    return 1
                end_at_event(q, v, dt, hold, case, now, numbers, memory, j)
                return 0
            middle = (drive * waves[1] - case[Number.STIFFNESS] * q) / mobility
            now[Now.MEAN] = 0.5 * (now[Now.FORCE] + hold)
            now[Now.TIME_MEAN] = (now[Now.FORCE] + 4 * middle + hold) / 6
            return 0

        turns = False
        dq = free - response[0, 2] * mobility * force
        end = free_velocity - response[1, 2] * mobility * force
        time_mean = force
    else:
        prepare(numbers, memory, j, Step(0.0, dt, v, v, 0.0))
        dq, end, force, time_mean, bend = solve_step(
            (free, free_velocity), response, dt, case, now, numbers, memory, j
        )
        turns = v * end < 0
        # A law takes the net increment of a reversal inside the step as its path. One of the velocity may jump there.
        if numbers[0, j] == Law.TANH:
            turns = turns and min(abs(v), abs(end)) > STEEP_TURN * numbers[2, j]
        if not is_shortest:
            if turns:
                return count_halvings(v / (v - end))
            if abs(bend) > max_bend:
                return count_halvings(sqrt(max_bend / abs(bend)))

    # A slip of the other direction than that of its force stops or reverses inside the step.
    if is_rigid and memory[0, j] * end < 0:
        if not is_shortest:
            return count_halvings(v / (v - end))
        hold = (drive * waves[2] - case[Number.STIFFNESS] * (q + dq)) / mobility
        now[Now.MEAN] = force
        end_at_event(q + dq, end, dt, hold, case, now, numbers, memory, j)
        return 0

    first = 0.0
    if turns:
        # The extreme lies where a linear velocity is 0.
        fraction = v / (v - end)
        now[Now.EVENT] = fraction
        first = 0.5 * v * fraction * dt
        advance(numbers, memory, j, load, Step(first, fraction * dt, v, 0.0, 0.0))
        now[Now.TURN_FORCE] = read(numbers, memory, j, load).force
        now[Now.SHARE_BEFORE] = slip_share(numbers, memory, j, load, v)
        now[Now.SHARE_AFTER] = slip_share(numbers, memory, j, load, end)
        dt -= fraction * dt
        v = 0.0

    advance(numbers, memory, j, load, Step(dq - first, dt, v, end, response[1, 2] * mobility))
    now[Now.SLIDE] = q + dq
    now[Now.VELOCITY] = end
    now[Now.MEAN] = force
    now[Now.TIME_MEAN] = time_mean
    return 0


@njit(**NJIT_KERNEL)
def find_force(wave, case, now, numbers, memory, j):
    """Write friction force and irreversible slide at the end of a step to the rows FORCE and SLIP of `now`.

    Parameters
    ----------
    wave : float
        Sine of the drive at the end of the step.
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    now : (20,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    numbers : (k, m) array
        Numbers of the laws of m points. Row 0 is the `Law`.
    memory : (l, m) array
        Memory of the laws of m points, a column for each.
    j : int
        Number of the point.
    """
    before = now[Now.FORCE]
    state = read(numbers, memory, j, case[Number.LOAD])
    now[Now.FORCE] = state.force
    now[Now.SLIP] = now[Now.SLIDE] - state.stretch
    if numbers[0, j] == Law.COULOMB and memory[0, j] == 0:
        hold = case[Number.DRIVE] * wave - case[Number.STIFFNESS] * now[Now.SLIDE]
        now[Now.FORCE] = hold / case[Number.MOBILITY]
    if numbers[0, j] == Law.COULOMB and now[Now.EVENT] >= 0:
        now[Now.TIME_MEAN] = before + (1 - now[Now.EVENT]) * (now[Now.FORCE] - before)
        now[Now.SHARE_AFTER] = abs(memory[0, j])


class Middle(NamedTuple):
    """State of a case in the middle of a step.

    - slide: relative displacement [m]
    - velocity: relative velocity [m/s]
    - force: friction force [N]
    """

    slide: float
    velocity: float
    force: float


@njit(**NJIT_KERNEL)
def find_middle(dt, start, now):
    """Return the `Middle` of a step.

    The slide is the cubic with the velocities at both ends, the force the parabola with the time mean of the step.

    Parameters
    ----------
    dt : float
        Duration of the step [s].
    start : tuple of float
        Slide [m], velocity [m/s], force [N] and irreversible slide [m] at the start of the step.
    now : (20,) array
        State of the case, in the order of `case_rows.Now`.
    """
    q = 0.5 * (start[0] + now[Now.SLIDE]) + dt / 8 * (start[1] - now[Now.VELOCITY])
    v = 1.5 * (now[Now.SLIDE] - start[0]) / dt - 0.25 * (start[1] + now[Now.VELOCITY])
    return Middle(q, v, 1.5 * now[Now.TIME_MEAN] - 0.25 * (start[2] + now[Now.FORCE]))


@njit(**NJIT_KERNEL)
def find_work(dt, law, start, now):
    """Return the friction work of a step [J], exact for a law of the path and by Simpson's rule for one of the velocity.

    Parameters
    ----------
    dt : float
        Duration of the step [s].
    law : float
        Number of the `law_rows.Law`.
    start : tuple of float
        Slide [m], velocity [m/s], force [N] and irreversible slide [m] at the start of the step.
    now : (20,) array
        State of the case, in the order of `case_rows.Now`.
    """
    if law != Law.TANH:
        return now[Now.MEAN] * (now[Now.SLIDE] - start[0])
    middle = find_middle(dt, start, now)
    power = start[2] * start[1] + now[Now.FORCE] * now[Now.VELOCITY]
    return dt / 6 * (power + 4 * middle.force * middle.velocity)


@njit(**NJIT_KERNEL)
def add_energies(waves, dt, work, case, start, now):
    """Add the energies per mass [J/kg] of a step to the rows WORK_IN, POWER, VISCOUS, FRICTION and STORED of `now`.

    Those of drive and damper are integrals of the velocity by Simpson's rule.

    Parameters
    ----------
    waves : tuple of float
        Sines of the drive at the start, in the middle and at the end of the step.
    dt : float
        Duration of the step [s].
    work : float
        Friction work of the step [J].
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    start : tuple of float
        Slide [m], velocity [m/s], force [N] and irreversible slide [m] at the start of the step.
    now : (20,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    """
    middle = find_middle(dt, start, now).velocity
    end = now[Now.VELOCITY]
    power = case[Number.DRIVE] * dt / 6
    power *= waves[0] * start[1] + 4 * waves[1] * middle + waves[2] * end
    now[Now.WORK_IN] += power
    now[Now.POWER] += abs(power)
    squares = start[1] * start[1] + 4 * middle * middle + end * end
    now[Now.VISCOUS] += case[Number.DAMPING] * dt / 6 * squares
    now[Now.FRICTION] += case[Number.MOBILITY] * work
    energy = 0.5 * (end * end + case[Number.STIFFNESS] * now[Now.SLIDE] * now[Now.SLIDE])
    now[Now.STORED] = max(now[Now.STORED], energy)


@njit(**NJIT_KERNEL)
def find_turn(dt, value, rate, last_value, last):
    """Return the extreme [m] of the slide in a step, a cubic whose rate is 0 there.

    The rates at both ends differ in sign.

    Parameters
    ----------
    dt : float
        Duration of the step [s].
    value, rate : float
        Value [m] and its rate [m/s] at the start of the step.
    last_value, last : float
        The same at its end.
    """
    middle = 1.5 * (last_value - value) / dt - 0.25 * (rate + last)
    slope = 4 * middle - 3 * rate - last
    bend = 2 * (rate + last) - 4 * middle
    # The root between the ends, without a difference of large numbers
    size = sqrt(max(slope * slope - 4 * bend * rate, 0.0))
    sum_ = slope + (size if slope > 0 else -size)
    part = -2 * rate / sum_ if sum_ != 0 else 0.5
    if not 0 <= part <= 1:
        part = -0.5 * sum_ / bend if bend != 0 else 0.5
    if not 0 <= part <= 1:
        part = rate / (rate - last)
    return value + dt * part * (rate + part * (slope / 2 + part * bend / 3))


@njit(**NJIT_KERNEL)
def observe_extremes(dt, start, now, loop):
    """Update the extremes of the slide in the cycle (`Now.MIN`, `Now.MAX`), and the friction forces there in `loop`.

    Parameters
    ----------
    dt : float
        Duration of the step [s].
    start : tuple of float
        Slide [m], velocity [m/s], force [N] and irreversible slide [m] at the start of the step.
    now : (20,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    loop : (5,) array
        The cycle, in the order of `case_rows.Loop` (changed in place).
    """
    q = now[Now.SLIDE]
    force = now[Now.FORCE]

    # The law "tanh" has no force at a reversal.
    if start[1] * now[Now.VELOCITY] < 0 or (start[1] != 0 and now[Now.VELOCITY] == 0):
        q = find_turn(dt, start[0], start[1], q, now[Now.VELOCITY])
        force = now[Now.TURN_FORCE] if now[Now.EVENT] >= 0 else 0.0

    if q > now[Now.MAX]:
        now[Now.MAX] = q
        loop[Loop.FORCE_AT_MAX] = force
    if q < now[Now.MIN]:
        now[Now.MIN] = q
        loop[Loop.FORCE_AT_MIN] = force


@njit(**NJIT_KERNEL)
def find_acceleration(sine, q, v, force, case):
    """Return the absolute acceleration [m s-2] at the output: that of the base plus that of the slide.

    Parameters
    ----------
    sine : float
        Sine of the drive at this instant.
    q : float
        Slide [m].
    v : float
        Velocity [m/s].
    force : float
        Friction force [N].
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    """
    a = case[Number.DRIVE] * sine - case[Number.DAMPING] * v - case[Number.STIFFNESS] * q
    return case[Number.OUTPUT] * (a - case[Number.MOBILITY] * force) + case[Number.BASE] * sine


@njit(**NJIT_KERNEL)
def find_parabola_extreme(first, middle, last):
    """Return the largest magnitude of the parabola through values at the start, in the middle and at the end of a step.

    Parameters
    ----------
    first : float
        Value at the start.
    middle : float
        Value in the middle.
    last : float
        Value at the end.
    """
    largest = max(abs(first), abs(last))
    bend = first - 2 * middle + last
    tilt = last - first
    if abs(tilt) < 2 * abs(bend):
        largest = max(largest, abs(middle - tilt * tilt / (8 * bend)))
    return largest


@njit(**NJIT_KERNEL)
def observe_acceleration(waves, dt, is_steep, case, start, now, seen):
    """Update the largest acceleration of the output, `Seen.MAX_ACCELERATION` [m s-2], by that of a step.

    Without an event it is the extreme of the parabola through both ends and the middle of the step. At an event, where the
    point stops, reverses or is released (`Now.EVENT`), the velocity is 0 and the force may jump, so that the accelerations
    before and after it count. The slide there is taken from the end of the step, which differs by O(dt^2), because the
    velocity is 0 at the event. The force of the law "tanh" may bend too sharply for a parabola in a shortest step, and where
    the velocity changes its sign without an event; the value at the end counts there.

    Parameters
    ----------
    waves : tuple of float
        Sines of the drive at the start, in the middle and at the end of the step.
    dt : float
        Duration of the step [s].
    is_steep : bool
        Whether it is a shortest step of the law "tanh".
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    start : tuple of float
        Slide [m], velocity [m/s], force [N] and irreversible slide [m] at the start of the step.
    now : (20,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    seen : (22,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    q = now[Now.SLIDE]
    v = now[Now.VELOCITY]
    last = find_acceleration(waves[2], q, v, now[Now.FORCE], case)
    peak = abs(last)
    if now[Now.EVENT] >= 0:
        sine = waves[0] + now[Now.EVENT] * (waves[2] - waves[0])
        before = find_acceleration(sine, q, 0.0, start[2], case)
        after = find_acceleration(sine, q, 0.0, now[Now.FORCE], case)
        peak = max(peak, abs(before), abs(after))
    elif start[1] * v >= 0 and not is_steep:
        first = find_acceleration(waves[0], start[0], start[1], start[2], case)
        at = find_middle(dt, start, now)
        middle = find_acceleration(waves[1], at.slide, at.velocity, at.force, case)
        peak = find_parabola_extreme(first, middle, last)
    seen[Seen.MAX_ACCELERATION] = max(seen[Seen.MAX_ACCELERATION], peak)


@njit(**NJIT_KERNEL)
def observe_harmonics(time, dt, omega, start, now, seen):
    """Add the integrals of slide and force times cos and sin (COS_1 to FORCE_SIN_3, SLIDE) over a step to `seen`.

    Slide and force are a cubic and a parabola in the step, which Gauss's rule with three points integrates.

    Parameters
    ----------
    time : float
        Time at the start of the step [s].
    dt : float
        Duration of the step [s].
    omega : float
        Circular frequency of the drive [rad/s].
    start : tuple of float
        Slide [m], velocity [m/s], force [N] and irreversible slide [m] at the start of the step.
    now : (20,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    seen : (22,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    # Force: parabola through both ends with the mean of the step
    q = now[Now.SLIDE]
    v = now[Now.VELOCITY]
    bend = 6 * now[Now.TIME_MEAN] - 3 * (start[2] + now[Now.FORCE])

    # Gauss points: the slide is the cubic Hermite polynomial of the step, with cos 3x = 4 cos^3 x - 3 cos x
    for k in range(3):
        s = 0.5 + 0.5 * GAUSS_POINT * (k - 1)
        weight = dt * (4 / 9 if k == 1 else 5 / 18)
        rest = 1 - s
        value = start[0] + s * s * (3 - 2 * s) * (q - start[0])
        value = weight * (value + dt * s * rest * (rest * start[1] - s * v))
        force = weight * (start[2] + s * (now[Now.FORCE] - start[2]) + bend * s * rest)
        c = cos(omega * (time + s * dt))
        w = sin(omega * (time + s * dt))
        seen[Seen.COS_1] += value * c
        seen[Seen.SIN_1] += value * w
        seen[Seen.FORCE_COS_1] += force * c
        seen[Seen.FORCE_SIN_1] += force * w
        seen[Seen.FORCE_COS_3] += force * c * (4 * c * c - 3)
        seen[Seen.FORCE_SIN_3] += force * w * (3 - 4 * w * w)
        seen[Seen.SLIDE] += value
    seen[Seen.SPAN] += dt


@njit(**NJIT_KERNEL)
def add_stick(angle, turn, speeds, first, last, mean, seen):
    """Add the phase of stick in a piece without reversal to `Seen.STUCK`, and a start of slip to STARTS and its phases.

    A point sticks while less than half of its motion is irreversible.

    Parameters
    ----------
    angle, turn : float
        Phase of the drive at the start of the piece, and that which passes in it [rad].
    speeds : (float, float)
        Magnitudes of the velocity at both ends [m/s].
    first, last, mean : float
        Irreversible part of the motion at the start and at the end of the piece, and its mean.
    seen : (22,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    first = abs(first)
    last = abs(last)
    sticks = first < 0.5
    part = 1.0 if sticks else 0.0
    if sticks != (last < 0.5):
        # The irreversible part is a parabola of the path. That of a law with a corner jumps where this gives the mean.
        rise = 0.5 - first
        bend = 6 * mean - 3 * (first + last)
        slope = last - first + bend
        root = sqrt(max(slope * slope - 4 * bend * rise, 0.0))
        crossing = 2 * rise / (slope + (root if slope > 0 else -root))
        if abs(last - first) > MIN_SHARE_JUMP:
            crossing = (last - mean) / (last - first)
        crossing = min(max(crossing, 0.0), 1.0)

        # From the part of the path to that of the time, with a linear velocity
        v = speeds[0]
        crossing *= (v + speeds[1]) / (v + sqrt(v * v + crossing * (speeds[1] * speeds[1] - v * v)))
        part = crossing if sticks else 1 - crossing
        if sticks:
            start = 2 * (angle + crossing * turn)
            seen[Seen.STARTS] += 1
            seen[Seen.SLIP_START_PHASE_COS] += cos(start)
            seen[Seen.SLIP_START_PHASE_SIN] += sin(start)
    seen[Seen.STUCK] += part * turn


@njit(**NJIT_KERNEL)
def observe_stick(angle, turn, share, start, now, seen):
    """Add the phase of stick in a step, which is divided at its event, to `seen`.

    Parameters
    ----------
    angle, turn : float
        Phase of the drive at the start of the step, and that which passes in it [rad].
    share : float
        Irreversible part of the motion at the end of the step.
    start : tuple of float
        Slide [m], velocity [m/s], force [N] and irreversible slide [m] at the start of the step.
    now : (20,) array
        State of the case, in the order of `case_rows.Now`.
    seen : (22,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    first = seen[Seen.SHARE]
    seen[Seen.SHARE] = share
    part = now[Now.EVENT]
    v = abs(start[1])
    last = abs(now[Now.VELOCITY])
    if part < 0:
        path = now[Now.SLIDE] - start[0]
        mean = abs((now[Now.SLIP] - start[3]) / path) if path != 0 else first
        add_stick(angle, turn, (v, last), first, share, mean, seen)
        return

    # A point that stops, turns or is released changes its law at once.
    before = now[Now.SHARE_BEFORE]
    after = now[Now.SHARE_AFTER]
    event = angle + part * turn
    add_stick(angle, part * turn, (v, 0.0), first, before, 0.5 * (first + before), seen)
    add_stick(event, 0.0, (1.0, 1.0), before, after, 0.5, seen)
    add_stick(event, (1 - part) * turn, (0.0, last), after, share, 0.5 * (after + share), seen)


@njit(**NJIT_KERNEL)
def find_largest_force(dt, start, now, numbers, j, load):
    """Return the largest magnitude of the force in a step.

    The force is smooth in the step if it follows the velocity, or holds a rigid point at rest, which is released at the
    static limit. Other laws have their largest force where a step ends.

    Parameters
    ----------
    dt : float
        Duration of the step [s].
    start : tuple of float
        Slide [m], velocity [m/s], force [N] and irreversible slide [m] at the start of the step.
    now : (20,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    numbers : (k, m) array
        Numbers of the laws of m points. Row 0 is the `Law`.
    j : int
        Number of the point.
    load : float
        Normal load [N].
    """
    law = numbers[0, j]
    force = now[Now.FORCE]
    middle = find_middle(dt, start, now)
    if law == Law.TANH:
        speed = find_parabola_extreme(start[1], middle.velocity, now[Now.VELOCITY])
        return numbers[1, j] * load * tanh(speed / numbers[2, j])
    if law == Law.COULOMB and start[1] == 0 and now[Now.VELOCITY] != 0:
        return numbers[1, j] * load
    if law == Law.LUGRE or (law == Law.COULOMB and start[1] == 0):
        return find_parabola_extreme(start[2], middle.force, force)
    return abs(force)


@njit(**NJIT_KERNEL)
def observe_forces(dt, work, share, start, now, numbers, j, load, seen):
    """Add the extremes of force and slip and the friction work of a step to MAX_FORCE, MIN_SLIP, MAX_SLIP, WORK of `seen`.

    Parameters
    ----------
    dt : float
        Duration of the step [s].
    work : float
        Friction work of the step [J].
    share : float
        Irreversible part of the motion at the end of the step.
    start : tuple of float
        Slide [m], velocity [m/s], force [N] and irreversible slide [m] at the start of the step.
    now : (20,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    numbers : (k, m) array
        Numbers of the laws of m points. Row 0 is the `Law`.
    j : int
        Number of the point.
    load : float
        Normal load [N].
    seen : (22,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    dq = now[Now.SLIDE] - start[0]
    force = find_largest_force(dt, start, now, numbers, j, load)

    # The irreversible slide turns inside the step where its velocity changes the sign.
    slip = now[Now.SLIP]
    first = seen[Seen.SHARE] * start[1]
    last = share * now[Now.VELOCITY]
    if first * last < 0:
        slip = find_turn(dt, start[3], first, slip, last)
    seen[Seen.MAX_FORCE] = max(seen[Seen.MAX_FORCE], force)
    seen[Seen.MIN_SLIP] = min(seen[Seen.MIN_SLIP], slip)
    seen[Seen.MAX_SLIP] = max(seen[Seen.MAX_SLIP], slip)

    # The work check compares the exact work with the trapezoidal rule over the ends of the steps, relative to the work
    # that passed through the point in either direction.
    seen[Seen.WORK] += work
    seen[Seen.SAMPLED] += 0.5 * (start[2] + now[Now.FORCE]) * dq
    seen[Seen.PASSED] += abs(work)


@njit(**NJIT_KERNEL)
def start_window(now, seen):
    """Reset `seen`, what is observed of a case, at the start of the last cycles, over which its measures are taken."""
    seen[:] = 0.0
    seen[Seen.MIN_SLIP] = seen[Seen.MAX_SLIP] = now[Now.SLIP]
    seen[Seen.START_SLIDE] = now[Now.SLIDE]
    seen[Seen.START_VELOCITY] = now[Now.VELOCITY]


@njit(**NJIT_KERNEL)
def end_cycle(now, seen, loop, history):
    """Record extremes and phasor of a cycle, and the extremes and the mean of one that is measured.

    Parameters
    ----------
    now : (20,) array
        State of the case, in the order of `case_rows.Now`.
    seen : (22,) array
        What was observed, in the order of `case_rows.Seen`.
    loop : (5,) array
        The cycle, in the order of `case_rows.Loop` (changed in place).
    history : (4,) array
        Smallest and largest slide [m] and the integrals for its phasor (output).
    """
    loop[Loop.SLIDE] = seen[Seen.SLIDE]
    history[0] = loop[Loop.MIN_SLIDE] = now[Now.MIN]
    history[1] = loop[Loop.MAX_SLIDE] = now[Now.MAX]
    history[2] = now[Now.COS]
    history[3] = now[Now.SIN]
    if now[Now.SLIDE] == now[Now.MAX] and now[Now.VELOCITY] > 0:
        loop[Loop.FORCE_AT_MAX] = nan  # the slide still grows: no reversal
    if now[Now.SLIDE] == now[Now.MIN] and now[Now.VELOCITY] < 0:
        loop[Loop.FORCE_AT_MIN] = nan


@njit(**NJIT_KERNEL)
def march_cycle(steps, table, observes, case, now, numbers, memory, j, seen, loop):
    """March a case over a cycle.

    Parameters
    ----------
    steps : int
        Steps per cycle.
    table : (LEVELS + 1, 2, 5) array
        Responses of `cases.make_responses`.
    observes : bool
        Whether the cycle is measured.
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    now : (20,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    numbers : (k, m) array
        Numbers of the laws of m points. Row 0 is the `Law`.
    memory : (l, m) array
        Memory of the laws of m points, a column for each.
    j : int
        Number of the point.
    seen : (22,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    loop : (5,) array
        The cycle, in the order of `case_rows.Loop` (changed in place).
    """
    omega = case[Number.OMEGA]
    step = 2 * np.pi / omega / steps
    max_bend = (
        MAX_FORCE_BEND * (omega * step) ** 2 * abs(case[Number.DRIVE]) / case[Number.MOBILITY]
    )
    level = 0
    tick = 0

    # A cycle begins at the phase 0 of the drive. `turn_level` is the level of the half step to which half_sine and
    # half_cosine belong.
    sine = 0.0
    cosine = 1.0
    turn_level = -1
    half_sine = half_cosine = 0.0
    now[Now.MIN] = now[Now.MAX] = now[Now.SLIDE]
    now[Now.COS] = now[Now.SIN] = 0.0
    # An extreme at the border of two cycles has no force of its own.
    loop[Loop.FORCE_AT_MIN] = loop[Loop.FORCE_AT_MAX] = nan
    seen[Seen.SLIDE] = 0.0
    while tick < steps * TICKS:
        size = TICKS >> level
        dt = step / (1 << level)
        time = tick * (step / TICKS)
        # Sines and cosines by rotation over half steps; each cycle begins with exact ones.
        if level != turn_level:
            half_sine = sin(0.5 * omega * dt)
            half_cosine = cos(0.5 * omega * dt)
            turn_level = level
        middle_sine = sine * half_cosine + cosine * half_sine
        middle_cosine = cosine * half_cosine - sine * half_sine
        drive = sine, middle_sine, middle_sine * half_cosine + middle_cosine * half_sine
        start = now[Now.SLIDE], now[Now.VELOCITY], now[Now.FORCE], now[Now.SLIP]
        halvings = try_step(
            drive, dt, table[level], level == LEVELS, max_bend, case, now, numbers, memory, j
        )
        if halvings > 0:
            level = min(level + halvings, LEVELS)
            continue

        # Energies, and the integrals of the slide times cos and sin of the drive by the trapezoidal rule
        find_force(drive[2], case, now, numbers, memory, j)
        work = find_work(dt, numbers[0, j], start, now)
        add_energies(drive, dt, work, case, start, now)
        last_cosine = cosine
        sine = drive[2]
        cosine = middle_cosine * half_cosine - middle_sine * half_sine
        now[Now.COS] += 0.5 * dt * (start[0] * last_cosine + now[Now.SLIDE] * cosine)
        now[Now.SIN] += 0.5 * dt * (start[0] * drive[0] + now[Now.SLIDE] * sine)
        observe_extremes(dt, start, now, loop)
        if observes:
            share = slip_share(numbers, memory, j, case[Number.LOAD], now[Now.VELOCITY])
            observe_forces(dt, work, share, start, now, numbers, j, case[Number.LOAD], seen)
            is_steep = numbers[0, j] == Law.TANH and level == LEVELS
            observe_acceleration(drive, dt, is_steep, case, start, now, seen)
            observe_harmonics(time, dt, omega, start, now, seen)
            observe_stick(omega * time, omega * dt, share, start, now, seen)
        tick += size
        if level > 0 and tick % (2 * size) == 0:
            level -= 1


@njit(cache=True, **NJIT_KERNEL)
def march_cases(steps, tables, parameters, numbers, memory, nows, seens, histories, loops):
    """March cases over their cycles.

    Parameters
    ----------
    steps : int
        Steps per cycle.
    tables : (c, LEVELS + 1, 2, 5) array
        Responses of `cases.make_responses`.
    parameters : (c, 12) array
        Numbers of the cases, in the order of `case_rows.Number`.
    numbers : (k, c) array
        Numbers of the laws. Row 0 is the `Law`.
    memory : (l, c) array
        Memory of the laws (changed in place).
    nows : (c, 20) array
        States of the cases, in the order of `case_rows.Now` (output).
    seens : (c, 22) array
        What was observed, in the order of `case_rows.Seen` (output).
    histories : (c, n, 4) array
        Extremes and phasor of every cycle (output).
    loops : (c, 1 + w, 5) array
        Cycles of the window, in the order of `case_rows.Loop`, after a row for those before it. Cycles that are not
        measured keep their values (output).
    """
    for j in range(parameters.shape[0]):
        case = parameters[j]
        now = nows[j]
        seen = seens[j]
        omega = case[Number.OMEGA]
        n_cycles = int(case[Number.CYCLES])
        first = n_cycles - int(case[Number.WINDOW])

        # Initial state; a rigid point that moves slips in the direction of its velocity.
        now[Now.SLIDE] = case[Number.SLIDE]
        now[Now.VELOCITY] = case[Number.VELOCITY]
        if numbers[0, j] == Law.COULOMB and now[Now.VELOCITY] != 0:
            memory[0, j] = 1.0 if now[Now.VELOCITY] > 0 else -1.0
        find_force(0.0, case, now, numbers, memory, j)
        now[Now.STORED] = 0.5 * (
            now[Now.VELOCITY] ** 2 + case[Number.STIFFNESS] * now[Now.SLIDE] ** 2
        )

        cycle = 0
        while cycle < n_cycles:
            observes = cycle >= first
            if cycle == first:
                start_window(now, seen)
                seen[Seen.SHARE] = slip_share(
                    numbers, memory, j, case[Number.LOAD], now[Now.VELOCITY]
                )
            begin = now[Now.SLIDE], now[Now.VELOCITY], now[Now.FORCE]
            sums = now[Now.WORK_IN], now[Now.POWER], now[Now.VISCOUS], now[Now.FRICTION]
            loop = loops[j, max(loops.shape[1] - n_cycles + cycle, 0)]
            march_cycle(steps, tables[j], observes, case, now, numbers, memory, j, seen, loop)
            end_cycle(now, seen, loop, histories[j, cycle])
            cycle += 1

            # The cycles up to the last ones are repetitions of one that ends as it began.
            size = SAME_CASE_CYCLE * (now[Now.MAX] - now[Now.MIN])
            is_same = (
                abs(now[Now.SLIDE] - begin[0]) <= size
                and abs(now[Now.VELOCITY] - begin[1]) <= omega * size
                and abs(now[Now.FORCE] - begin[2]) <= SAME_CASE_CYCLE * abs(now[Now.MEAN])
            )
            if is_same and not observes and cycle < n_cycles - N_READ:
                n_skipped = n_cycles - N_READ - cycle
                for k in range(cycle, cycle + n_skipped):
                    for column in range(4):
                        histories[j, k, column] = histories[j, cycle - 1, column]
                for k in range(4):
                    now[Now.WORK_IN + k] += n_skipped * (now[Now.WORK_IN + k] - sums[k])
                cycle += n_skipped
                first = cycle

        now[Now.ELASTIC] = read(numbers, memory, j, case[Number.LOAD]).energy
