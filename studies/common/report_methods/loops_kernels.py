"""Compiled loops of the comparison methods: Duhamel's integral by fixed point, Newmark with a stick speed, Euler.

rig: (omega (n,), dampers (n, n), faces (i, n), base (n,), mass) of the modes. laws (i, k): a row per interface as
`point_laws.rows` writes it: 0 for set-valued friction, limit, kinetic force, stick speed; or 1, limit, 0, whether as
printed, and the numbers of its law. filled: (z, v (k, n), force, residual (k, i) [N], iterations (k,)), which the loops
fill from their first entries on under the drive (k,) [m s-2]."""

from math import tanh
from typing import NamedTuple

import numpy as np

from patchfem.compiled.jit import njit
from patchfem.dynamics.modal_kernels import narrowed
from patchfem.friction.flags_kernels import NJIT_NO_REFCOUNT
from patchfem.friction.laws.elastic_plastic_kernels import stretch_spring

# first number of a row of set-valued friction; numbers of a row before those of its law
COULOMB, HEAD = (
    0,
    4,
)
ELASTIC_PLASTIC = 1  # number in a row of the first law of `point_laws.SMOOTH`


class EndForce(NamedTuple):
    """Force [N] at the end of a step and its derivatives over speed [N s/m] and travel [N/m]."""

    force: float
    by_speed: float
    by_travel: float


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def end_force(row, before, speed, travel):
    """Return the force at the end of a step and its derivatives over speed and travel.

    Parameters
    ----------
    row : (k,) array
        Row of an elastic-plastic element or of the rate law, see `point_laws.SMOOTH`.
    before : float
        Force [N] before the travel.
    speed, travel : float
        Slide speed at the end [m/s] and slide since the force `before` [m].

    Returns
    -------
    EndForce
    """
    if row[HEAD] == ELASTIC_PLASTIC:
        stiffness = row[HEAD + 2]
        moved = stretch_spring(before / stiffness, travel, row[HEAD + 3])
        by_travel = stiffness if moved.elastic == travel else 0.0
        return EndForce(stiffness * moved.end, 0.0, by_travel)
    limit = row[HEAD + 1]
    inverse_speed = row[HEAD + 2]
    ratio = tanh(speed * inverse_speed)
    return EndForce(limit * ratio, limit * (1 - ratio) * (1 + ratio) * inverse_speed, 0.0)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def law_force(laws, c, speed, travel, before, hold):
    """Force [N] of interface c at a slide speed [m/s].

    travel [m] since the force was `before` [N]; hold [N]: the force that keeps the speed as it is.
    """
    if laws[c, 0] == COULOMB:
        if abs(speed) < laws[c, 3]:
            return min(max(hold, -laws[c, 1]), laws[c, 1])
        return laws[c, 2] * np.sign(speed)
    if laws[c, 3] != 0 and abs(before) >= laws[c, 1]:
        return before
    return end_force(laws[c], before, speed, travel)[0]


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def first_forces(laws, speed, force):
    """Forces (i,) [N] of a start at slide speeds (i,) [m/s] into `force`; 0 where a force may hold the interface."""
    for c in range(force.size):
        held = laws[c, 0] == COULOMB and abs(speed[c]) < laws[c, 3]
        force[c] = 0.0 if held else law_force(laws, c, speed[c], 0.0, 0.0, 0.0)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def dot(row, x):
    """Scalar product of two rows."""
    out = 0.0
    for i in range(row.size):
        out += row[i] * x[i]
    return out


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def accelerate(rig, drive, z, v, force, out):
    """Modal accelerations (n,) [m s-2] under friction forces (i,) [N] into `out`."""
    omega, dampers, faces, base, mass = rig
    for i in range(omega.size):
        out[i] = (
            -base[i] * drive
            - omega[i] ** 2 * z[i]
            - dot(dampers[i], v)
            - dot(faces[:, i], force) / mass
        )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def holding(rig, c, accel, force):
    """Force [N] at interface c that leaves it no acceleration, from the accelerations (n,) under all forces (i,)."""
    face = rig[2][c]
    return force[c] + dot(face, accel) * rig[4] / dot(face, face)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def step_of(row, z, v, first, last):
    """Value at the end of a step by a row (4,) of a map: of z, v and the accelerations at both ends of the step."""
    return row[0] * z + row[1] * v + row[2] * first + row[3] * last


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def copied(values, out):
    """Write values (n,) into `out`; as a slice, numba would allocate a copy of what it cannot tell apart."""
    for i in range(out.size):
        out[i] = values[i]


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def duhamel_loop(rig, maps, stop, drive, laws, filled, room):
    """Fill z, v, force, residual and iterations; returns the number of steps that did not converge.

    maps: ((n, 2, 4) from z, z', f at the start and f at the end to z and z' after a step, coupling (n, n): dampers that
    are no part of these, inverse (n, n) of 1 + their effect on z' by f at the end); stop: (criterion 0 displacement, 1
    velocity, 2 force, tolerance, relaxation, most iterations of a step); room: numbers (3, i) and (3, n) to work in.
    """
    (whole, coupling, solve), (criterion, tolerance, relax, most), (few, many) = maps, stop, room
    (z, v, force, residual, iterations), (_, _, faces, base, mass) = filled, rig
    slide, speed, first, last, free, failed = few[0], few[1], many[0], many[1], many[2], 0
    for k in range(drive.size - 1):
        trial = force[k + 1]
        copied(force[k], trial)
        for i in range(base.size):
            first[i] = -base[i] * drive[k] - dot(coupling[i], v[k]) - dot(faces[:, i], trial) / mass
        for count in range(1, most + 1):
            for i in range(base.size):
                last[i] = -base[i] * drive[k + 1] - dot(faces[:, i], trial) / mass
                free[i] = step_of(whole[i, 1], z[k, i], v[k, i], first[i], last[i])
            for i in range(base.size):
                v[k + 1, i] = dot(solve[i], free)
            for i in range(base.size):
                z[k + 1, i] = step_of(
                    whole[i, 0], z[k, i], v[k, i], first[i], last[i] - dot(coupling[i], v[k + 1])
                )
            accelerate(rig, drive[k + 1], z[k + 1], v[k + 1], trial, free)
            good = count > 1 or criterion == 2
            for c in range(trial.size):
                q, w = dot(faces[c], z[k + 1]), dot(faces[c], v[k + 1])
                wanted = law_force(
                    laws, c, w, q - dot(faces[c], z[k]), force[k, c], holding(rig, c, free, trial)
                )
                residual[k + 1, c] = wanted - trial[c]
                change = (
                    q - slide[c]
                    if criterion == 0
                    else w - speed[c]
                    if criterion == 1
                    else residual[k + 1, c]
                )
                good = good and abs(change) <= tolerance
                slide[c], speed[c] = q, w
            iterations[k + 1] = count
            if good:
                break
            if count < most:
                for c in range(trial.size):
                    trial[c] += relax * residual[k + 1, c]
        else:
            failed += 1
    return failed


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def implicit_force(laws, c, speed, travel, back_speed, back_travel, before):
    """Force [N] of a law at the end of a step in which it acts back on the slide.

    Every newton takes `back_speed` [m/s] off the slide speed and `back_travel` [m] off the travel that they would be
    without it.
    """
    limit = laws[c, 1]
    if laws[c, 3] != 0 and abs(before) >= limit:
        return before
    # a force at the limit lies inside the bracket
    low, high, force = (
        -1.001 * limit,
        1.001 * limit,
        before,
    )
    for count in range(200):
        found, by_speed, by_travel = end_force(
            laws[c], before, speed - back_speed * force, travel - back_travel * force
        )
        last = force
        gain = 1 + by_speed * back_speed + by_travel * back_travel
        low, high, force = narrowed(low, high, force, force - found, gain, count - 40)
        if abs(force - last) <= 1e-15 * limit:
            break
    return min(max(force, -limit), limit)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def settle(laws, stuck, direction, free, soft, before, force):
    """Forces (i,) at the end of a step by sweeps over the interfaces; stuck ones that need more than their static limit
    are released. free: (speed, travel) (i,) without friction; soft: ([m/s/N], [m/N]), (i, i) what each force takes off
    each of them. Returns the number of sweeps."""
    (speed, travel), (by_speed, by_travel), count, again = free, soft, 0, True
    while again:
        change, again, last = 1.0, False, count + 500
        while count < last and change > 1e-15:  # of the limit: round-off
            count, change = count + 1, 0.0
            for c in range(force.size):
                own = force[c]
                force[c] = 0.0
                w, q = speed[c] - dot(by_speed[c], force), travel[c] - dot(by_travel[c], force)
                if laws[c, 0] != COULOMB:
                    force[c] = implicit_force(
                        laws, c, w, q, by_speed[c, c], by_travel[c, c], before[c]
                    )
                else:
                    force[c] = w / by_speed[c, c] if stuck[c] else laws[c, 2] * direction[c]
                change = max(change, abs(force[c] - own) / laws[c, 1])
            if force.size == 1:
                break
        for c in range(force.size):
            if stuck[c] and abs(force[c]) > laws[c, 1]:
                stuck[c], direction[c], again = False, np.sign(force[c]), True
    return count


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def arrest(rig, stuck, v, accel, force):
    """Stop all stuck interfaces: take their slide speed and slide acceleration away, by sweeps.

    force [N] keeps what the second one needs.
    """
    for _ in range(500):
        change = 0.0
        for c in range(force.size):
            if stuck[c]:
                face = rig[2][c]
                own, w, a = dot(face, face), dot(face, v), dot(face, accel)
                change = max(change, abs(w), abs(a))
                force[c] += a * rig[4] / own
                for i in range(v.size):
                    v[i] -= face[i] * w / own
                    accel[i] -= face[i] * a / own
        if change == 0.0 or force.size == 1:
            return


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def newmark_loop(rig, maps, drive, laws, by_force, filled, room):
    """Fill z, v, force, residual and iterations by average acceleration; returns the number of stops.

    maps: (step h [s], inverse (n, n) of 1 + h D/2 + h^2 omega^2/4, softness as in `settle`). A Coulomb interface below
    its stick speed after a step is stopped, with by_force only where its static force suffices. room: numbers (5, i)
    and (5, n), flags (i,) to work in.
    """
    (h, inverse, soft), (z, v, force, residual, iterations), (few, many, stuck) = maps, filled, room
    faces, accel, half, ahead, scratch, new = rig[2], many[0], many[1], many[2], many[3], many[4]
    now, none, direction, speed, travel = few[0], few[1], few[2], few[3], few[4]
    stops = 0
    for turn in range(2):  # by the second one those that the first releases slide
        copied(force[0], now)
        accelerate(rig, drive[0], z[0], v[0], now, accel)
        for c in range(now.size if turn == 0 else 0):
            w, hold = dot(faces[c], v[0]), holding(rig, c, accel, now)
            stuck[c], direction[c] = laws[c, 0] == COULOMB and abs(w) < laws[c, 3], np.sign(w)
            if stuck[c] and by_force and abs(hold) > laws[c, 1]:
                stuck[c], direction[c] = False, np.sign(hold)
                force[0, c] = laws[c, 2] * direction[c]
    copied(v[0], scratch)
    arrest(rig, stuck, scratch, accel, now)
    for k in range(drive.size - 1):
        for i in range(accel.size):
            half[i], ahead[i] = (
                v[k, i] + h / 2 * accel[i],
                z[k, i] + h * (v[k, i] + h / 4 * accel[i]),
            )
        accelerate(rig, drive[k + 1], ahead, half, none, scratch)
        for i in range(accel.size):
            new[i] = dot(inverse[i], scratch)
        for c in range(now.size):
            w = dot(faces[c], new)
            speed[c] = dot(faces[c], half) + h / 2 * w
            travel[c] = dot(faces[c], ahead) - dot(faces[c], z[k]) + h * h / 4 * w
            if not stuck[c] and k > 0:
                direction[c] = np.sign(dot(faces[c], v[k]))
            now[c] = force[k, c]
        iterations[k + 1] = settle(laws, stuck, direction, (speed, travel), soft, force[k], now)
        accelerate(rig, drive[k + 1], ahead, half, now, scratch)
        for i in range(accel.size):
            accel[i] = dot(inverse[i], scratch)
            z[k + 1, i], v[k + 1, i] = ahead[i] + h * h / 4 * accel[i], half[i] + h / 2 * accel[i]
        for c in range(now.size):
            w, hold = dot(faces[c], v[k + 1]), holding(rig, c, accel, now)
            if laws[c, 0] == COULOMB and not stuck[c]:
                residual[k + 1, c] = laws[c, 2] * np.sign(w) - now[c]
                if abs(w) < laws[c, 3] and (not by_force or abs(hold) <= laws[c, 1]):
                    stuck[c] = True
                    stops += 1
        arrest(rig, stuck, v[k + 1], accel, now)
        for c in range(now.size):
            force[k + 1, c] = min(max(now[c], -laws[c, 1]), laws[c, 1])
    return stops


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def euler_loop(rig, drive, laws, h, filled, room):
    """Fill z, v and force: z += h z', z' += h z'', all from the start of the step. room: as of `duhamel_loop`."""
    z, v, force, faces, (few, many) = filled[0], filled[1], filled[2], rig[2], room
    now, accel = few[0], many[0]
    copied(force[0], now)
    for k in range(drive.size):
        for c in range(now.size):
            accelerate(rig, drive[k], z[k], v[k], now, accel)
            travel = dot(faces[c], z[k]) - dot(faces[c], z[k - 1]) if k > 0 else 0.0
            now[c] = law_force(
                laws, c, dot(faces[c], v[k]), travel, now[c], holding(rig, c, accel, now)
            )
        copied(now, force[k])
        if k + 1 < drive.size:
            accelerate(rig, drive[k], z[k], v[k], now, accel)
            for i in range(accel.size):
                z[k + 1, i], v[k + 1, i] = z[k, i] + h * v[k, i], v[k, i] + h * accel[i]
