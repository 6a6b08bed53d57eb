"""Compiled time loops of the three methods of the report, for modes and one interface (`report_methods`).

A rig is the tuple (omega (n,), damping (n, n), face (n,), base (n,), mass) of its modes; a law is the tuple (kind,
limit [N], scale), where the scale is the stick speed of Coulomb's law, the transition speed of the rate law [m/s] or
the yield displacement of the elastic-plastic laws [m]. A history is the tuple (z (k, n), v (k, n), force (k,)), whose
first entries are the start; the loops fill the others under the drive (k,) [m s-2]. A workspace is an array (4, n).
"""

from math import tanh

import numpy as np

from patchfem.kernel_cache import njit
from patchfem.kernel_cache.flags_kernels import NJIT_NO_REFCOUNT

# kinds of laws
COULOMB = 0
RATE = 1
ELASTIC_PLASTIC = 2
ELASTIC_PLASTIC_AS_PRINTED = 3  # equation 3.12: the force stays at the limit once it is reached


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def dot(row, x):
    """Return the scalar product of two rows."""
    out = 0.0
    for i in range(row.size):
        out += row[i] * x[i]
    return out


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def law_force(law, speed, travel, before, hold):
    """Return the friction force [N] at a slide speed [m/s].

    Parameters
    ----------
    law : tuple
    speed, travel : float
        Slide speed [m/s], and slide [m] since the force was `before` [N].
    before : float
    hold : float
        Force [N] under which the slide speed does not change.
    """
    kind, limit, scale = law
    if kind == COULOMB:
        if abs(speed) < scale:
            return min(max(hold, -limit), limit)
        return limit * np.sign(speed)
    if kind == RATE:
        return limit * tanh(speed / scale)
    if kind == ELASTIC_PLASTIC_AS_PRINTED and abs(before) >= limit:
        return before
    return min(max(before + limit / scale * travel, -limit), limit)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def accelerate(rig, drive, z, v, force, out):
    """Write the modal accelerations (n,) [m s-2] under a friction force [N] into `out`."""
    omega, damping, face, base, mass = rig
    for i in range(omega.size):
        friction = face[i] * force / mass
        out[i] = -base[i] * drive - omega[i] ** 2 * z[i] - dot(damping[i], v) - friction


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def holding_force(rig, accel, force):
    """Return the friction force [N] that makes the slide acceleration zero, from the accelerations under `force`."""
    face = rig[2]
    mass = rig[4]
    return force + dot(face, accel) * mass / dot(face, face)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def duhamel_loop(rig, maps, stop, drive, law, history, residual, workspace):
    """Integrate by Duhamel's integral and fixed-point iteration; return the number of steps that did not converge.

    Parameters
    ----------
    rig : tuple
    maps : (n, 2, 4) array
        Maps from z, z', f at the start and f at the end of a step to z and z' at its end.
    stop : tuple
        Criterion (0 displacement, 1 velocity, 2 force), tolerance, relaxation, largest number of iterations.
    drive : (k,) array
    law : tuple
    history : tuple
    residual : (k,) array
        Filled with the force of the law at the end of a step less the force that the step used [N].
    workspace : (4, n) array
    """
    (criterion, tolerance, relaxation, max_iterations), (z, v, force) = stop, history
    face, base, mass = rig[2:]
    accel = workspace[0]
    n_failed = 0
    slide = 0.0
    speed = 0.0
    for k in range(drive.size - 1):
        trial = force[k]
        for count in range(1, max_iterations + 1):
            for i in range(base.size):
                first = -base[i] * drive[k] - face[i] * force[k] / mass
                last = -base[i] * drive[k + 1] - face[i] * trial / mass
                for part, out in enumerate((z, v)):
                    row = maps[i, part]
                    out[k + 1, i] = (
                        row[0] * z[k, i] + row[1] * v[k, i] + row[2] * first + row[3] * last
                    )
            accelerate(rig, drive[k + 1], z[k + 1], v[k + 1], trial, accel)
            new_slide = dot(face, z[k + 1])
            new_speed = dot(face, v[k + 1])
            travel = new_slide - dot(face, z[k])
            hold = holding_force(rig, accel, trial)
            residual[k + 1] = law_force(law, new_speed, travel, force[k], hold) - trial
            change = residual[k + 1]
            if criterion == 0:
                change = new_slide - slide
            elif criterion == 1:
                change = new_speed - speed
            slide = new_slide
            speed = new_speed
            has_converged = (count > 1 or criterion == 2) and abs(change) <= tolerance
            if has_converged or count == max_iterations:
                break
            trial += relaxation * residual[k + 1]
        force[k + 1] = trial
        if not has_converged:
            n_failed += 1
    return n_failed


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def arrest(rig, v, accel, force):
    """Set slide speed and slide acceleration to zero; return the friction force [N] that does so."""
    face = rig[2]
    mass = rig[4]
    square = dot(face, face)
    speed = dot(face, v)
    slide_accel = dot(face, accel)
    for i in range(v.size):
        v[i] -= face[i] * speed / square
        accel[i] -= face[i] * slide_accel / square
    return force + slide_accel * mass / square


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def newmark_loop(rig, maps, drive, law, needs_force, history, workspace):
    """Integrate by average acceleration with Coulomb's law.

    Parameters
    ----------
    rig : tuple
    maps : tuple
        Step h [s], the inverse (n, n) of 1 + h D/2 + h^2 omega^2/4, and the slide speed that a force of 1 N takes away
        in a step.
    drive : (k,) array
    law : tuple
    needs_force : int
        1 if the interface stops only where its friction suffices to hold it, 0 otherwise.
    history : tuple
    workspace : (4, n) array
        Its rows are zero.
    """
    (h, inverse, softness), (z, v, force), (_, limit, stick_speed) = maps, history, law
    face = rig[2]
    n = face.size
    accel = workspace[0]
    half = workspace[1]
    ahead = workspace[2]
    scratch = workspace[3]
    accelerate(rig, drive[0], z[0], v[0], force[0], accel)
    speed = dot(face, v[0])
    direction = np.sign(speed)
    hold = holding_force(rig, accel, force[0])
    is_stuck = abs(speed) < stick_speed
    if is_stuck and needs_force and abs(hold) > limit:
        is_stuck = False
        direction = np.sign(hold)
        force[0] = limit * direction
        accelerate(rig, drive[0], z[0], v[0], force[0], accel)
    if is_stuck:
        # `scratch` has no speed, so that the start keeps its own
        arrest(rig, scratch, accel, force[0])
    for k in range(drive.size - 1):
        for i in range(n):
            half[i] = v[k, i] + h / 2 * accel[i]
            ahead[i] = z[k, i] + h * (v[k, i] + h / 4 * accel[i])
        accelerate(rig, drive[k + 1], ahead, half, 0.0, scratch)
        speed = dot(face, half)
        for i in range(n):
            speed += h / 2 * face[i] * dot(inverse[i], scratch)
        if not is_stuck and k > 0:
            direction = np.sign(dot(face, v[k]))
        now = speed / softness
        if is_stuck and abs(now) > limit:
            is_stuck = False
            direction = np.sign(now)
        if not is_stuck:
            now = limit * direction
        accelerate(rig, drive[k + 1], ahead, half, now, scratch)
        for i in range(n):
            accel[i] = dot(inverse[i], scratch)
            z[k + 1, i] = ahead[i] + h * h / 4 * accel[i]
            v[k + 1, i] = half[i] + h / 2 * accel[i]
        hold = holding_force(rig, accel, now)
        if not is_stuck and abs(dot(face, v[k + 1])) < stick_speed:
            is_stuck = not needs_force or abs(hold) <= limit
        if is_stuck:
            now = arrest(rig, v[k + 1], accel, now)
        force[k + 1] = min(max(now, -limit), limit)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def euler_loop(rig, h, drive, law, history, workspace):
    """Integrate by explicit steps of h [s]: z += h z', z' += h z'', with all rates from the start of the step."""
    z, v, force = history
    face = rig[2]
    accel = workspace[0]
    for k in range(drive.size):
        force[k] = law_force(law, dot(face, v[k]), 0.0, 0.0, 0.0)
        if k + 1 < drive.size:
            accelerate(rig, drive[k], z[k], v[k], force[k], accel)
            for i in range(accel.size):
                z[k + 1, i] = z[k, i] + h * v[k, i]
                v[k + 1, i] = v[k, i] + h * accel[i]
