"""Stops and releases of set-valued elements (faces) inside a step, and their forces.

A march moves the modes under mean forces, so a stop or a release inside the step would be wrong by up to a step, and a slide
that sticks would keep a speed. Here the forces h(x) that would hold all faces change linearly over the step, 0 <= x <= 1,
and a slide accelerates by the difference between h and the friction. So every stop and every release is the root of a line
or a parabola. Between events some faces rest and the others slide. Faces that rest share the force that the others and the
modes exert on them; dependent ones share it by least squares, and one that would be overloaded while the others hold it
carries its static friction. The limits may change linearly over the step, as under a load that varies.

The step then needs slides and speeds at its end. Mean forces give the slides, and impulses at the end give the speeds; both
are of second order in the step. `find_impulses` computes the work of all friction. If the friction would do work on the
modes, the loop steps by mean forces alone. Read `follow_step_events` first.

Stiff elastic-plastic faces do not replace this module, because they have one coefficient of friction: a kinetic
coefficient below the static one cannot be given to them. With equal coefficients, on 119 random rigs, 98 % of the errors
hold with set-valued faces; with elastic-plastic ones 50 %, 74 % and 81 % hold for bond lengths of 0.1, 0.01 and 0.001 of
the tolerance times the friction force over the stiffness of the mode, and 72 %, 88 % and 91 % of the values are within the
tolerance, if all set-valued ones are.
"""

from typing import NamedTuple

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INTERNAL, NJIT_NO_REFCOUNT
from ..dense_kernels import factorise, solve_factorised
from ..modal_kernels import project_modes, write_accelerations
from .element_arrays import ComplianceRow, FaceRow, LimitRow

# Law number of a set-valued element in `num`; such an element sticks without stretch.
SET_VALUED = 0
# Relative shift of the diagonal that regularises the equations of dependent faces.
DIAGONAL_SHIFT = 1e-10
# Largest compliance of a face at which the other resting faces prevent its motion, relative to its
# compliance when they are free.
DEPENDENT_TOL = 1e-7
OVERLOAD_TOL = 1e-9  # relative excess over the static friction that is attributed to round-off
SAME_TIME_TOL = 1e-12  # largest relative speed of faces that stop at the same time
ZERO_SLIDE_TOL = 1e-14  # largest slide increment that counts as zero, relative to its terms
TINY = 1e-300  # smallest divisor, which prevents a division by 0


class StepEvent(NamedTuple):
    """Next stop or release of a face within a step.

    - distance: time from now to the event, as a fraction of the step
    - face: number of the face, -1 for no event
    - slip_sign: sign of the slide after a release, 0 for a stop
    """

    distance: float
    face: int
    slip_sign: float


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_friction_limit(which, face, step_fraction, stops):
    """Return the static or kinetic friction limit [N] of a face at a fraction of the step.

    Parameters
    ----------
    which : int
        LimitRow.STATIC or LimitRow.KINETIC.
    face : int
        Number of the face.
    step_fraction : float
        Fraction of the step, from 0 at its start to 1.
    stops : element_arrays.SetValuedElements

    Returns
    -------
    float
    """
    return stops.limit[which, face] + step_fraction * (
        stops.limit[which + LimitRow.AT_END, face] - stops.limit[which, face]
    )


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_shared_forces(which, count, stops):
    """Solve for the forces of coupled faces from their compliances and right-hand sides.

    The faces are `stops.names[:count]`. The equations are A x = b with A = stops.compliances[which] of these faces and
    b their row RIGHT_SIDE of stops.field; x is written into the row SOLUTION, both in the order of the names. For
    dependent faces the x of least norm is found: a shift of the diagonal makes A regular, and one step of iterative
    refinement removes the shift where it has no effect.

    Parameters
    ----------
    which : int
        ComplianceRow.SLIDE, SPEED or ACCELERATION.
    count : int
        Number of faces.
    stops : element_arrays.SetValuedElements

    Returns
    -------
    bool
        Whether A has a positive diagonal.
    """
    a = stops.system[:count, :count]
    b = stops.field[FaceRow.RIGHT_SIDE]
    x = stops.field[FaceRow.SOLUTION]
    r = stops.field[FaceRow.RESIDUAL]
    names = stops.names
    if count == 1:
        compliance = stops.compliances[which, names[0], names[0]]
        x[0] = b[0] / compliance
        return compliance > 0.0
    for i in range(count):
        for k in range(count):
            a[i, k] = stops.compliances[which, names[i], names[k]]
        a[i, i] *= 1 + DIAGONAL_SHIFT
        x[i] = 0.0
    if not factorise(a):
        return False
    # The second pass removes the effect of the diagonal shift from independent faces.
    for _ in range(2):
        for i in range(count):
            r[i] = b[i]
            for k in range(count):
                r[i] -= stops.compliances[which, names[i], names[k]] * x[k]
        solve_factorised(a, r[:count])
        for i in range(count):
            x[i] += r[i]
    return True


@njit(error_model="numpy", **NJIT_INTERNAL)
def list_resting_faces(stops):
    """Write the numbers of the resting faces into stops.names; return their count."""
    count = 0
    for e in range(stops.names.size):
        if stops.field[FaceRow.SLIP_STATE, e] == 0.0:
            stops.names[count] = e
            count += 1
    return count


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_face_forces(x, stops):
    """Compute the forces of all faces and their slopes at a fraction of the step.

    The results are in stops.field. Returns whether the equations have a solution.
    """
    f = stops.field
    force = f[FaceRow.FORCE]
    force_slope = f[FaceRow.FORCE_SLOPE]
    holding_start = f[FaceRow.HOLDING_START]
    slip_state = f[FaceRow.SLIP_STATE]
    count = list_resting_faces(stops)
    for e in range(stops.names.size):
        is_static = abs(slip_state[e]) == 2.0
        which = LimitRow.STATIC if is_static else LimitRow.KINETIC
        slip_sign = np.sign(slip_state[e])
        limit_rise = stops.limit[which + LimitRow.AT_END, e] - stops.limit[which, e]
        force[e] = slip_sign * find_friction_limit(which, e, x, stops)
        force_slope[e] = slip_sign * limit_rise
    for derivative in range(2):
        for i in range(count):
            f[FaceRow.RIGHT_SIDE, i] = 0.0
            for e in range(stops.names.size):
                if slip_state[e] != 0.0:
                    rise = f[FaceRow.HOLDING_END, e] - holding_start[e]
                    excess = rise - force_slope[e]
                    if derivative == 0:
                        excess = holding_start[e] + rise * x - force[e]
                    compliance = stops.compliances[ComplianceRow.ACCELERATION, stops.names[i], e]
                    f[FaceRow.RIGHT_SIDE, i] += compliance * excess
        if count and not solve_shared_forces(ComplianceRow.ACCELERATION, count, stops):
            return False
        for i in range(count):
            e = stops.names[i]
            rise = f[FaceRow.HOLDING_END, e] - holding_start[e]
            if derivative == 0:
                force[e] = holding_start[e] + rise * x + f[FaceRow.SOLUTION, i]
            else:
                force_slope[e] = rise + f[FaceRow.SOLUTION, i]
    return True


@njit(error_model="numpy", **NJIT_INTERNAL)
def release_face(e, slip_sign, stops):
    """Release a face: it slides, or carries its static friction if other faces hold it.

    Parameters
    ----------
    e : int
        Number of the face.
    slip_sign : float
        Sign of the slide.
    stops : element_arrays.SetValuedElements
    """
    f = stops.field
    # The slip state is set first, so that the list of resting faces excludes this face.
    f[FaceRow.SLIP_STATE, e] = slip_sign
    f[FaceRow.SLIDES_ON, e] = 0.0
    count = list_resting_faces(stops)
    for i in range(count):
        f[FaceRow.RIGHT_SIDE, i] = stops.compliances[ComplianceRow.ACCELERATION, stops.names[i], e]
    if count == 0 or not solve_shared_forces(ComplianceRow.ACCELERATION, count, stops):
        return
    compliance = stops.compliances[ComplianceRow.ACCELERATION, e, e]
    for i in range(count):
        compliance -= (
            stops.compliances[ComplianceRow.ACCELERATION, e, stops.names[i]]
            * f[FaceRow.SOLUTION, i]
        )
    if compliance <= DEPENDENT_TOL * stops.compliances[ComplianceRow.ACCELERATION, e, e]:
        f[FaceRow.SLIP_STATE, e] = 2 * slip_sign


@njit(error_model="numpy", **NJIT_INTERNAL)
def choose_slip_states(x, stops):
    """Determine which faces rest, slide or carry static friction at a fraction of a step.

    Returns whether consistent states are found.
    """
    f = stops.field
    slip_state = f[FaceRow.SLIP_STATE]
    for e in range(stops.names.size):
        if abs(slip_state[e]) == 2.0:
            slip_state[e] = 0.0
    for _ in range(2 * stops.names.size + 2):
        if not find_face_forces(x, stops):
            return False
        worst_overload = OVERLOAD_TOL
        worst_face = -1
        for e in range(stops.names.size):
            overload = (
                abs(f[FaceRow.FORCE, e])
                / max(find_friction_limit(LimitRow.STATIC, e, x, stops), TINY)
                - 1
            )
            if slip_state[e] == 0.0 and overload > worst_overload:
                worst_overload = overload
                worst_face = e
        if worst_face < 0:
            return True
        release_face(worst_face, 1.0 if f[FaceRow.FORCE, worst_face] > 0 else -1.0, stops)
    return False


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_first_zero(speed, rate, half_slope):
    """Return the first zero y >= 0 of a decreasing speed that is quadratic in time.

    The speed is speed + rate y + half_slope y^2; the result is infinite if there is no zero.

    The speed must not be negative, and `rate` not negative where the speed is 0.

    Parameters
    ----------
    speed : float
    rate : float
    half_slope : float

    Returns
    -------
    float
    """
    if speed == 0.0:
        return -rate / half_slope if half_slope < 0 else np.inf
    discriminant = rate * rate - 4 * half_slope * speed
    if discriminant < 0:
        return np.inf
    denominator = np.sqrt(discriminant) - rate
    return 2 * speed / denominator if denominator > 0 else np.inf


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_speed_rates(e, x, dt, stops):
    """Return the speed change of a face per step length, and half of its derivative.

    Parameters
    ----------
    e : int
        Number of the face.
    x : float
        Fraction of the step, from 0 at its start to 1.
    dt : float
        Length of the step [s].
    stops : element_arrays.SetValuedElements

    Returns
    -------
    float
        [m/s]
    float
        [m/s]
    """
    rate = 0.0
    half_slope = 0.0
    f = stops.field
    for k in range(stops.names.size):
        g = dt * stops.compliances[ComplianceRow.ACCELERATION, e, k]
        rise = f[FaceRow.HOLDING_END, k] - f[FaceRow.HOLDING_START, k]
        rate += g * (f[FaceRow.HOLDING_START, k] + rise * x - f[FaceRow.FORCE, k])
        half_slope += 0.5 * g * (rise - f[FaceRow.FORCE_SLOPE, k])
    # A face that was just released slides forward, except for round-off.
    if f[FaceRow.SPEED, e] == 0.0:
        rate = f[FaceRow.SLIP_STATE, e] * max(f[FaceRow.SLIP_STATE, e] * rate, 0.0)
    return rate, half_slope


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_next_event(x, dt, stops):
    """Find the next stop or release of a face after a fraction of the step.

    Parameters
    ----------
    x : float
        Fraction of the step, from 0 at its start to 1.
    dt : float
        Length of the step [s].
    stops : element_arrays.SetValuedElements

    Returns
    -------
    StepEvent
    """
    f = stops.field
    slip_state = f[FaceRow.SLIP_STATE]
    distance = 1.0 - x
    face = -1
    slip_sign = 0.0
    for e in range(stops.names.size):
        if abs(slip_state[e]) == 1.0:
            rate, half_slope = find_speed_rates(e, x, dt, stops)
            root = find_first_zero(
                slip_state[e] * f[FaceRow.SPEED, e],
                slip_state[e] * rate,
                slip_state[e] * half_slope,
            )
            if root < distance:
                distance = root
                face = e
                slip_sign = 0.0
        elif slip_state[e] == 0.0:
            for sign in (1.0, -1.0):
                rise = sign * f[FaceRow.FORCE_SLOPE, e] - (
                    stops.limit[LimitRow.STATIC + LimitRow.AT_END, e]
                    - stops.limit[LimitRow.STATIC, e]
                )
                if rise > 0:
                    root = max(
                        (
                            find_friction_limit(LimitRow.STATIC, e, x, stops)
                            - sign * f[FaceRow.FORCE, e]
                        )
                        / rise,
                        0.0,
                    )
                    if root < distance:
                        distance = root
                        face = e
                        slip_sign = sign
    return StepEvent(distance, face, slip_sign)


@njit(error_model="numpy", **NJIT_INTERNAL)
def advance_faces(x, distance, face, dt, stops):
    """Advance the slides and speeds of all faces to the next event.

    Parameters
    ----------
    x : float
        Fraction of the step, from 0 at its start to 1.
    distance : float
        Time to the event as a fraction of the step.
    face : int
        Number of the face that has the event, -1 for none; it stops if it slides.
    dt : float
        Length of the step [s].
    stops : element_arrays.SetValuedElements
    """
    f = stops.field
    slip_state = f[FaceRow.SLIP_STATE]
    speed = f[FaceRow.SPEED]
    for e in range(stops.names.size):
        f[FaceRow.MEAN_FORCE, e] += distance * (
            f[FaceRow.FORCE, e] + 0.5 * distance * f[FaceRow.FORCE_SLOPE, e]
        )
        if abs(slip_state[e]) == 1.0:
            rate, half_slope = find_speed_rates(e, x, dt, stops)
            f[FaceRow.SLIDE, e] += (
                distance * dt * (speed[e] + distance * (0.5 * rate + distance * half_slope / 3))
            )
            f[FaceRow.RESIDUAL, e] = speed[e] + distance * (rate + distance * half_slope)
    for e in range(stops.names.size):
        if abs(slip_state[e]) == 1.0:
            last_speed = abs(speed[e])
            speed[e] = f[FaceRow.RESIDUAL, e]
            # Equal faces stop at the same time.
            smallest_speed = SAME_TIME_TOL * last_speed if last_speed > 0.0 else -1.0
            if (
                e == face
                or (face < 0 and slip_state[e] * speed[e] <= 0)
                or slip_state[e] * speed[e] <= smallest_speed
            ):
                speed[e] = 0.0
                slip_state[e] = 0.0
                f[FaceRow.SLIDES_ON, e] = 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def follow_events(dt, stops):
    """Follow all faces from event to event to the end of a step; return whether this succeeds.

    The results are in stops.field.

    """
    x = 0.0
    for _ in range(6 * stops.names.size + 12):
        if not choose_slip_states(x, stops):
            return False
        event = find_next_event(x, dt, stops)
        advance_faces(x, event.distance, event.face, dt, stops)
        if event.face < 0:
            return True
        x += event.distance
        if event.slip_sign != 0.0:
            release_face(event.face, event.slip_sign, stops)
    return False


@njit(error_model="numpy", **NJIT_INTERNAL)
def do_all_slide(stops):
    """Return whether all faces keep sliding in one direction to the end of the step.

    If so, their speeds are written to stops.field.
    """
    f = stops.field
    slip_state = f[FaceRow.SLIP_STATE]
    count = stops.names.size
    for e in range(count):
        slip_state[e] = np.sign(f[FaceRow.START_SPEED, e])
        f[FaceRow.SLIDES_ON, e] = 1.0
        if f[FaceRow.START_SPEED, e] == 0.0:
            return False
    for e in range(count):
        dq = f[FaceRow.FREE_SLIDE, e]
        end = f[FaceRow.FREE_SPEED, e]
        for k in range(count):
            force = slip_state[k] * find_friction_limit(LimitRow.KINETIC, k, 0.5, stops)
            dq -= stops.compliances[ComplianceRow.SLIDE, e, k] * force
            end -= stops.compliances[ComplianceRow.SPEED, e, k] * force
        if slip_state[e] * dq < 0 or slip_state[e] * end <= 0:
            return False
        f[FaceRow.SPEED, e] = end
    return True


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_holding_forces(dt, stops):
    """Find the forces that would hold the faces at rest at both ends of the step.

    The results are in stops.field. Returns whether the equations have a solution.

    They are found for all faces at once, and then for the resting faces with the friction of
    those that slide: accelerations are known to first order of the step only, which would misplace a release
    by up to a step.
    """
    f = stops.field
    mean_force = f[FaceRow.MEAN_FORCE]
    solution = f[FaceRow.SOLUTION]
    n_faces = stops.names.size
    for stage in range(2):
        count = n_faces
        if stage == 0:
            for e in range(n_faces):
                stops.names[e] = e
        else:
            count = list_resting_faces(stops)
            if count == 0 or count == n_faces:
                return True
            if not find_face_forces(0.0, stops):
                return False
        # Mean forces determine the slides; forces weighted by the time
        # to the end determine the speeds.
        if not solve_holding_forces(ComplianceRow.SLIDE, stage, count, dt, stops):
            return False
        for i in range(count):
            mean_force[stops.names[i]] = solution[i]
        if not solve_holding_forces(ComplianceRow.SPEED, stage, count, dt, stops):
            return False
        for i in range(count):
            e = stops.names[i]
            start_force = 3 * mean_force[e] - 2 * solution[i]
            end_force = 4 * solution[i] - 3 * mean_force[e]
            if stage == 1:
                start_force = f[FaceRow.HOLDING_START, e] + start_force - f[FaceRow.FORCE, e]
                end_force = (
                    f[FaceRow.HOLDING_END, e]
                    + end_force
                    - f[FaceRow.FORCE, e]
                    - f[FaceRow.FORCE_SLOPE, e]
                )
            f[FaceRow.HOLDING_START, e] = start_force
            f[FaceRow.HOLDING_END, e] = end_force
    return True


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_holding_forces(which, stage, count, dt, stops):
    """Solve for the forces on listed faces that prevent their slide, or their change of speed.

    The faces are `stops.names[:count]`.

    Parameters
    ----------
    which : int
        ComplianceRow.SLIDE or ComplianceRow.SPEED.
    stage : int
        0 for all faces, 1 for the resting faces under the friction of those that slide.
    count : int
        Number of faces.
    dt : float
        Length of the step [s].
    stops : element_arrays.SetValuedElements

    Returns
    -------
    bool
        Whether the forces exist; they are in the row SOLUTION of stops.field.
    """
    f = stops.field
    right_side = f[FaceRow.RIGHT_SIDE]
    is_slide = which == ComplianceRow.SLIDE
    slope_weight = 1 / 3 if is_slide else 1 / 2
    for i in range(count):
        e = stops.names[i]
        if is_slide:
            right_side[i] = f[FaceRow.FREE_SLIDE, e] - f[FaceRow.START_SPEED, e] * dt
        else:
            right_side[i] = f[FaceRow.FREE_SPEED, e] - f[FaceRow.START_SPEED, e]
        if stage == 0:
            continue
        for k in range(stops.names.size):
            if f[FaceRow.SLIP_STATE, k] != 0.0:
                mean = f[FaceRow.FORCE, k] + f[FaceRow.FORCE_SLOPE, k] * slope_weight
                right_side[i] -= stops.compliances[which, e, k] * mean
    return solve_shared_forces(which, count, stops)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def follow_step_events(dt, stops):
    """Follow the stops and releases of all faces during a step; return whether this succeeds.

    The results are in stops.field.

    """
    f = stops.field
    start_speed = f[FaceRow.START_SPEED]
    is_resolved = True
    for e in range(stops.names.size):
        compliance = dt * stops.compliances[ComplianceRow.ACCELERATION, e, e]
        is_resolved = (
            is_resolved
            and stops.compliances[ComplianceRow.SLIDE, e, e] > 0.25 * compliance * dt
            and stops.compliances[ComplianceRow.SPEED, e, e] > 0.5 * compliance
        )
        start_speed[e] = 0.0 if f[FaceRow.WAS_RESTING, e] == 1.0 else start_speed[e]
    if do_all_slide(stops):
        return True
    if not is_resolved or not find_holding_forces(dt, stops):
        return False
    for e in range(stops.names.size):
        f[FaceRow.SPEED, e] = start_speed[e]
        f[FaceRow.SLIP_STATE, e] = np.sign(start_speed[e])
        f[FaceRow.SLIDE, e] = 0.0
        f[FaceRow.MEAN_FORCE, e] = 0.0
        f[FaceRow.SLIDES_ON, e] = abs(f[FaceRow.SLIP_STATE, e])
    return follow_events(dt, stops)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def match_mean_forces(stops):
    """Find the mean forces of all faces over a step that produce their slides.

    The results are in stops.field. Returns whether the equations have a solution.
    """
    f = stops.field
    free_slide = f[FaceRow.FREE_SLIDE]
    increment = f[FaceRow.INCREMENT]
    mean_force = f[FaceRow.MEAN_FORCE]
    count = 0
    for e in range(stops.names.size):
        if f[FaceRow.SLIDES_ON, e] == 1.0:
            mean_force[e] = f[FaceRow.SLIP_STATE, e] * find_friction_limit(
                LimitRow.KINETIC, e, 0.5, stops
            )
        else:
            stops.names[count] = e
            count += 1
    for i in range(count):
        e = stops.names[i]
        f[FaceRow.RIGHT_SIDE, i] = free_slide[e] - f[FaceRow.SLIDE, e]
        for k in range(stops.names.size):
            f[FaceRow.RIGHT_SIDE, i] -= stops.compliances[ComplianceRow.SLIDE, e, k] * mean_force[k]
    if count and not solve_shared_forces(ComplianceRow.SLIDE, count, stops):
        return False
    for i in range(count):
        e = stops.names[i]
        largest_limit = max(
            stops.limit[LimitRow.STATIC, e], stops.limit[LimitRow.STATIC + LimitRow.AT_END, e]
        )
        mean_force[e] = min(
            max(mean_force[e] + f[FaceRow.SOLUTION, i], -largest_limit), largest_limit
        )
    for e in range(stops.names.size):
        increment[e] = free_slide[e]
        scale = abs(free_slide[e])
        for k in range(stops.names.size):
            contribution = stops.compliances[ComplianceRow.SLIDE, e, k] * mean_force[k]
            increment[e] -= contribution
            scale += abs(contribution)
        if (
            f[FaceRow.SLIDE, e] == 0.0
            and f[FaceRow.SLIDES_ON, e] == 0.0
            and abs(increment[e]) <= ZERO_SLIDE_TOL * scale
        ):
            increment[e] = 0.0
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_impulses(stops):
    """Find the impulses at the end of a step that produce the end speeds of the faces.

    Returns the friction work of the step [J].

    """
    f = stops.field
    free_speed = f[FaceRow.FREE_SPEED]
    count = 0
    work = 0.0
    for e in range(stops.names.size):
        f[FaceRow.IMPULSE, e] = 0.0
        work += f[FaceRow.MEAN_FORCE, e] * f[FaceRow.INCREMENT, e]
        for k in range(stops.names.size):
            free_speed[e] -= stops.compliances[ComplianceRow.SPEED, e, k] * f[FaceRow.MEAN_FORCE, k]
        has_reversed = (
            f[FaceRow.SLIDES_ON, e] == 0.0 or f[FaceRow.SLIP_STATE, e] * free_speed[e] <= 0.0
        )
        if has_reversed and abs(f[FaceRow.SLIP_STATE, e]) != 2.0:
            stops.names[count] = e
            count += 1
    for i in range(count):
        f[FaceRow.RIGHT_SIDE, i] = free_speed[stops.names[i]] - f[FaceRow.SPEED, stops.names[i]]
    if count and not solve_shared_forces(ComplianceRow.ACCELERATION, count, stops):
        return -np.inf
    for i in range(count):
        e = stops.names[i]
        f[FaceRow.IMPULSE, e] = f[FaceRow.SOLUTION, i]
        work += 0.5 * f[FaceRow.SOLUTION, i] * (free_speed[e] + f[FaceRow.SPEED, e])
    return work


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_stopping_impulses(motion, stops):
    """Find the impulses that stop the faces that do not slide, after a step with mean forces."""
    f = stops.field
    count = 0
    for e in range(stops.names.size):
        f[FaceRow.IMPULSE, e] = 0.0
        f[FaceRow.SLIP_STATE, e] = np.sign(f[FaceRow.INCREMENT, e])
        if f[FaceRow.INCREMENT, e] == 0.0:
            f[FaceRow.RIGHT_SIDE, count] = project_modes(stops.rows[e], motion[1])
            stops.names[count] = e
            count += 1
    if count and solve_shared_forces(ComplianceRow.ACCELERATION, count, stops):
        for i in range(count):
            f[FaceRow.IMPULSE, stops.names[i]] = f[FaceRow.SOLUTION, i]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def apply_impulses(motion, mass, stops):
    """Apply the impulses of the faces to the modes; return the dissipated energy [J].

    Parameters
    ----------
    motion : (2, n) array
        Coordinates and rates of the modes.
    mass : float
        [kg]
    stops : element_arrays.SetValuedElements

    Returns
    -------
    float
    """
    f = stops.field
    loss = 0.0
    for k in range(motion.shape[1]):
        change = 0.0
        for e in range(stops.names.size):
            change -= stops.rows[e, k] * f[FaceRow.IMPULSE, e] / mass
        loss -= mass * change * (motion[1, k] + 0.5 * change)
        motion[1, k] += change
    for e in range(stops.names.size):
        f[FaceRow.WAS_RESTING, e] = 0.0 if abs(f[FaceRow.SLIP_STATE, e]) == 1.0 else 1.0
    return loss


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_reactions(motion, modal_system, drive, accel, stops):
    """Find the forces on the resting faces that keep them at rest at an instant.

    They are written into the row SOLUTION of stops.field, in the order of stops.names.

    Parameters
    ----------
    motion : (2, n) array
        Coordinates and rates of the modes.
    modal_system : interfaces.arrays.ModalArrays
    drive : float
        Acceleration of the base [m s-2].
    accel : (n,) array
        Modal accelerations of the forces [m s-2].
    stops : element_arrays.SetValuedElements

    Returns
    -------
    int
        Number of forces, 0 if there is no solution.
    """
    write_accelerations(motion, modal_system, drive, accel, modal_system.workspace[1:])
    count = list_resting_faces(stops)
    for i in range(count):
        stops.field[FaceRow.RIGHT_SIDE, i] = 0.0
        for k in range(accel.size):
            stops.field[FaceRow.RIGHT_SIDE, i] += (
                stops.rows[stops.names[i], k] * modal_system.workspace[1, k]
            )
    return count if count and solve_shared_forces(ComplianceRow.ACCELERATION, count, stops) else 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def rests_through_step(stops):
    """Return whether mean forces below the static friction hold all faces through the step."""
    f = stops.field
    n_faces = stops.names.size
    for e in range(n_faces):
        if f[FaceRow.WAS_RESTING, e] == 0.0 and f[FaceRow.START_SPEED, e] != 0.0:
            return False
        stops.names[e] = e
        f[FaceRow.RIGHT_SIDE, e] = f[FaceRow.FREE_SLIDE, e]
    if not solve_shared_forces(ComplianceRow.SLIDE, n_faces, stops):
        return False
    for e in range(n_faces):
        if abs(f[FaceRow.SOLUTION, e]) > min(
            stops.limit[LimitRow.STATIC, e], stops.limit[LimitRow.STATIC + LimitRow.AT_END, e]
        ):
            return False
        f[FaceRow.MEAN_FORCE, e] = f[FaceRow.SOLUTION, e]
        f[FaceRow.SLIP_STATE, e] = 0.0
        f[FaceRow.SLIDES_ON, e] = 0.0
        f[FaceRow.SLIDE, e] = 0.0
        f[FaceRow.SPEED, e] = 0.0
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def rests_at_end(motion, modal_system, drive, accel, stops):
    """Return whether static friction still holds the resting faces at the end of a step.

    Linear interpolation of the holding forces between both ends would miss their increase near the end.

    Parameters
    ----------
    motion : (2, n) array
        Coordinates and rates at the end of the step; they are changed.
    modal_system : interfaces.arrays.ModalArrays
    drive : float
        Acceleration of the base [m s-2].
    accel : (n,) array
        Modal accelerations of the forces [m s-2].
    stops : element_arrays.SetValuedElements

    Returns
    -------
    bool
    """
    n_faces = stops.names.size
    for e in range(n_faces):
        stops.field[FaceRow.RIGHT_SIDE, e] = project_modes(stops.rows[e], motion[1])
        stops.names[e] = e
    if not solve_shared_forces(ComplianceRow.ACCELERATION, n_faces, stops):
        return False
    for k in range(accel.size):
        for e in range(n_faces):
            motion[1, k] -= stops.rows[e, k] * stops.field[FaceRow.SOLUTION, e] / modal_system.mass
    if find_reactions(motion, modal_system, drive, accel, stops) < n_faces:
        return False
    for i in range(n_faces):
        if (
            abs(stops.field[FaceRow.SOLUTION, i])
            > stops.limit[LimitRow.STATIC + LimitRow.AT_END, stops.names[i]]
        ):
            return False
    return True
