"""Compiled loops of the comparison methods: Duhamel's integral by fixed point, Newmark with a stick speed, Euler.

laws (i, k): a row per interface as `point_laws.rows` writes it: 0 for set-valued friction, limit, kinetic force, stick
speed; or 1, limit, 0, whether as printed, and the numbers of its law. The text runs with any laws.
"""

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from ...friction.laws import tanh_kernels as law
from ..modal_kernels import narrowed

COULOMB, HEAD = 0, 4  # first number of a row of set-valued friction; numbers of a row before those of its law


@njit(error_model="numpy", **LEAN)
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
    return law.at_end(laws[:, HEAD:], c, before, speed, travel)[0]


@njit(error_model="numpy", cache=True, **LEAN)
def first_forces(laws, speed, force):
    """Forces (i,) [N] of a start at slide speeds (i,) [m/s] into `force`; 0 where a force may hold the interface."""
    for c in range(force.size):
        held = laws[c, 0] == COULOMB and abs(speed[c]) < laws[c, 3]
        force[c] = 0.0 if held else law_force(laws, c, speed[c], 0.0, 0.0, 0.0)


@njit(error_model="numpy", **LEAN)
def pull(row, z, v, omega, dampers, base, drive, out):
    """Modal accelerations (n,) [m s-2] without friction into `out`; returns their part along an interface `row`
    (n,)."""
    along = 0.0
    for i in range(omega.size):
        a = -base[i] * drive - omega[i] ** 2 * z[i]
        for j in range(omega.size):
            a -= dampers[i, j] * v[j]
        out[i] = a
        along += row[i] * a
    return along


@njit(error_model="numpy", **LEAN)
def holding(c, along, faces, force, mass):
    """Force [N] at interface c that leaves it no acceleration, the forces (i,) [N] of the others given.

    along [m s-2]: acceleration of the slide without friction; faces: (i, n); mass [kg].
    """
    own = 0.0
    for d in range(force.size):
        share = 0.0
        for i in range(faces.shape[1]):
            share += faces[c, i] * faces[d, i]
        if d == c:
            own = share
        else:
            along -= share * force[d] / mass
    return along * mass / own


@njit(error_model="numpy", **LEAN)
def dot(row, x):
    """Scalar product of two rows."""
    out = 0.0
    for i in range(row.size):
        out += row[i] * x[i]
    return out


@njit(error_model="numpy", **LEAN)
def step_of(row, z, v, first, last):
    """Value at the end of a step by a row (4,) of a map: of z, v and the accelerations at both ends of the step."""
    return row[0] * z + row[1] * v + row[2] * first + row[3] * last


@njit(error_model="numpy", **LEAN)
def copied(values, out):
    """Write values (n,) into `out`; as a slice, numba would allocate a copy of what it cannot tell apart."""
    for i in range(out.size):
        out[i] = values[i]


@njit(error_model="numpy", cache=True, **LEAN)
def duhamel_loop(maps, coupling, solve, omega, dampers, faces, base, mass, drive, laws, criterion, tolerance, relax,
                 most, room, z, v, force, residual, iterations):
    """Fill z, v (k, n), force (i, k), residual (i, k) [N] and iterations (k,) from their first entries on.

    maps (n, 2, 4): (z, z', f at the start, f at the end) to (z, z') at the end of a step; coupling (n, n): dampers that
    are no part of the maps, solve (n, n): inverse of 1 + their effect on z' by f at the end; criterion 0 displacement,
    1 velocity, 2 force; room: (numbers (3, i), numbers (3, n)) to work in. Returns the number of steps that did not
    converge.
    """
    n, m = omega.size, laws.shape[0]
    trial, slide, speed = room[0][0], room[0][1], room[0][2]
    scratch, starts, ends = room[1][0], room[1][1], room[1][2]
    failed = 0
    for k in range(drive.size - 1):
        copied(force[:, k], trial)
        for count in range(1, most + 1):
            for i in range(n):
                first, last = -base[i] * drive[k] - dot(coupling[i], v[k]), -base[i] * drive[k + 1]
                for c in range(m):
                    first -= faces[c, i] * force[c, k] / mass
                    last -= faces[c, i] * trial[c] / mass
                starts[i], ends[i] = first, last
                scratch[i] = step_of(maps[i, 1], z[k, i], v[k, i], first, last)
            for i in range(n):
                v[k + 1, i] = dot(solve[i], scratch)
            for i in range(n):
                z[k + 1, i] = step_of(maps[i, 0], z[k, i], v[k, i], starts[i], ends[i] - dot(coupling[i], v[k + 1]))
            change, good = 0.0, count > 1 or criterion == 2
            for c in range(m):
                q, w = dot(faces[c], z[k + 1]), dot(faces[c], v[k + 1])
                along = pull(faces[c], z[k + 1], v[k + 1], omega, dampers, base, drive[k + 1], scratch)
                wanted = law_force(laws, c, w, q - dot(faces[c], z[k]), force[c, k],
                                   holding(c, along, faces, trial, mass))
                residual[c, k + 1] = wanted - trial[c]
                if criterion == 0:
                    change = abs(q - slide[c])
                elif criterion == 1:
                    change = abs(w - speed[c])
                else:
                    change = abs(residual[c, k + 1])
                good = good and change <= tolerance
                slide[c], speed[c] = q, w
            iterations[k + 1] = count
            if good:
                break
            if count < most:
                for c in range(m):
                    trial[c] += relax * residual[c, k + 1]
        else:
            failed += 1
        copied(trial, force[:, k + 1])
    return failed


@njit(error_model="numpy", **LEAN)
def implicit_force(laws, c, speed, travel, back_speed, back_travel, before):
    """Force [N] of a law at the end of a step in which it acts back on the slide.

    Every newton takes `back_speed` [m/s] off the slide speed and `back_travel` [m] off the travel that they would be
    without it.
    """
    limit = laws[c, 1]
    if laws[c, 3] != 0 and abs(before) >= limit:
        return before
    low, high, force = -1.001 * limit, 1.001 * limit, before  # a force at the limit lies inside the bracket
    for count in range(200):
        found, by_speed, by_travel = law.at_end(laws[:, HEAD:], c, before, speed - back_speed * force,
                                                travel - back_travel * force)
        last = force
        gain = 1 + by_speed * back_speed + by_travel * back_travel
        low, high, force = narrowed(low, high, force, force - found, gain, count - 40)
        if abs(force - last) <= 1e-15 * limit:
            break
    return min(max(force, -limit), limit)


@njit(error_model="numpy", **LEAN)
def sweeps(laws, stuck, direction, speed, travel, soft_speed, soft_travel, before, force):
    """Forces (i,) [N] of all interfaces at the end of a step, the stuck ones given, by sweeps over them; their number.

    Arguments as in `settle`.
    """
    count, change = 0, 1.0
    while count < 500 and change > 1e-15:  # of the limit: round-off
        count += 1
        change = 0.0
        for c in range(force.size):
            w, q = speed[c], travel[c]
            for d in range(force.size):
                if d != c:
                    w -= soft_speed[c, d] * force[d]
                    q -= soft_travel[c, d] * force[d]
            if laws[c, 0] != COULOMB:
                new = implicit_force(laws, c, w, q, soft_speed[c, c], soft_travel[c, c], before[c])
            else:
                new = w / soft_speed[c, c] if stuck[c] else laws[c, 2] * direction[c]
            change = max(change, abs(new - force[c]) / laws[c, 1])
            force[c] = new
        if force.size == 1:
            break
    return count


@njit(error_model="numpy", **LEAN)
def settle(laws, stuck, direction, speed, travel, soft_speed, soft_travel, before, force):
    """Forces (i,) at the end of a step; stuck interfaces that need more than their static limit are released.
    soft_speed [m/s/N], soft_travel [m/N]: (i, i) what each force takes off each slide. Returns the sweeps it took."""
    count, again = 0, True
    while again:
        count += sweeps(laws, stuck, direction, speed, travel, soft_speed, soft_travel, before, force)
        again = False
        for c in range(force.size):
            if stuck[c] and abs(force[c]) > laws[c, 1]:
                stuck[c], direction[c], again = False, np.sign(force[c]), True
    return count


@njit(error_model="numpy", **LEAN)
def arrest(stuck, faces, mass, crossed, v, accel, force):
    """Stop all stuck interfaces: take their slide speed and slide acceleration away, by sweeps.

    force [N] keeps what the second one needs. crossed: (i, i) faces_c . faces_d.
    """
    for _ in range(500):
        change = 0.0
        for c in range(force.size):
            if not stuck[c]:
                continue
            w, a = dot(faces[c], v), dot(faces[c], accel)
            change = max(change, abs(w), abs(a))
            force[c] += a * mass / crossed[c, c]
            for i in range(v.size):
                v[i] -= faces[c, i] * w / crossed[c, c]
                accel[i] -= faces[c, i] * a / crossed[c, c]
        if change == 0.0 or force.size == 1:
            return


@njit(error_model="numpy", cache=True, **LEAN)
def newmark_loop(inverse, omega, dampers, faces, base, mass, drive, laws, h, by_force, room, z, v, force, residual,
                 iterations):
    """Fill z, v (k, n), force (i, k), residual (i, k) [N] and iterations (k,) from their first entries on.

    Average acceleration; inverse (n, n): of 1 + h D/2 + h^2 omega^2/4. A Coulomb interface below its stick speed after
    a step is stopped, with by_force only where its static force suffices. room: (zeros (3, i, i), flags (i,), numbers
    (4, i), numbers (4, n)) to work in. Returns the number of such stops.
    """
    n, m = omega.size, laws.shape[0]
    crossed, soft_speed, soft_travel, stuck = room[0][0], room[0][1], room[0][2], room[1]
    direction, now, speed, travel = room[2][0], room[2][1], room[2][2], room[2][3]
    accel, new, scratch, half = room[3][0], room[3][1], room[3][2], room[3][3]
    copied(force[:, 0], now)
    for c in range(m):
        for d in range(m):
            for i in range(n):
                crossed[c, d] += faces[c, i] * faces[d, i]
                for j in range(n):
                    soft_speed[c, d] += faces[c, i] * inverse[i, j] * faces[d, j] / mass
            soft_travel[c, d] = soft_speed[c, d] * (h * h / 4)
            soft_speed[c, d] *= h / 2
    stops = 0
    accelerate(z[0], v[0], omega, dampers, faces, base, mass, drive[0], now, accel)
    for c in range(m):
        stuck[c] = laws[c, 0] == COULOMB and abs(dot(faces[c], v[0])) < laws[c, 3]
        direction[c] = np.sign(dot(faces[c], v[0]))
        hold = now[c] + dot(faces[c], accel) * mass / crossed[c, c]
        if stuck[c] and by_force and abs(hold) > laws[c, 1]:
            stuck[c], direction[c] = False, np.sign(hold)
            force[c, 0] = laws[c, 2] * direction[c]
    copied(force[:, 0], now)
    accelerate(z[0], v[0], omega, dampers, faces, base, mass, drive[0], now, accel)
    copied(v[0], scratch)
    arrest(stuck, faces, mass, crossed, scratch, accel, now)
    for k in range(drive.size - 1):
        for i in range(n):
            half[i] = v[k, i] + h / 2 * accel[i]
        for i in range(n):
            scratch[i] = -base[i] * drive[k + 1] - omega[i] ** 2 * (z[k, i] + h * (v[k, i] + h / 4 * accel[i])) \
                - dot(dampers[i], half)
        for i in range(n):
            new[i] = dot(inverse[i], scratch)
        for c in range(m):
            w = dot(faces[c], new)
            speed[c], travel[c] = dot(faces[c], half) + h / 2 * w, h * dot(faces[c], v[k]) \
                + h * h / 4 * (dot(faces[c], accel) + w)
            if not stuck[c] and k > 0:
                direction[c] = np.sign(dot(faces[c], v[k]))
            now[c] = force[c, k]
        iterations[k + 1] = settle(laws, stuck, direction, speed, travel, soft_speed, soft_travel, force[:, k], now)
        for i in range(n):
            scratch[i] = -base[i] * drive[k + 1] - omega[i] ** 2 * (z[k, i] + h * (v[k, i] + h / 4 * accel[i])) \
                - dot(dampers[i], half)
            for c in range(m):
                scratch[i] -= faces[c, i] * now[c] / mass
        for i in range(n):
            new[i] = dot(inverse[i], scratch)
        for i in range(n):
            z[k + 1, i] = z[k, i] + h * (v[k, i] + h / 4 * (accel[i] + new[i]))
            v[k + 1, i] = half[i] + h / 2 * new[i]
        copied(new, accel)
        for c in range(m):
            w = dot(faces[c], v[k + 1])
            hold = now[c] + dot(faces[c], accel) * mass / crossed[c, c]
            if laws[c, 0] == COULOMB:
                wanted = now[c] if stuck[c] else laws[c, 2] * np.sign(w)
                residual[c, k + 1] = wanted - now[c]
                if not stuck[c] and abs(w) < laws[c, 3] and (not by_force or abs(hold) <= laws[c, 1]):
                    stuck[c] = True
                    stops += 1
        arrest(stuck, faces, mass, crossed, v[k + 1], accel, now)
        for c in range(m):
            force[c, k + 1] = min(max(now[c], -laws[c, 1]), laws[c, 1])
    return stops


@njit(error_model="numpy", **LEAN)
def accelerate(z, v, omega, dampers, faces, base, mass, drive, force, out):
    """Modal accelerations (n,) into `out`."""
    for i in range(omega.size):
        out[i] = -base[i] * drive - omega[i] ** 2 * z[i] - dot(dampers[i], v)
        for c in range(force.size):
            out[i] -= faces[c, i] * force[c] / mass


@njit(error_model="numpy", cache=True, **LEAN)
def euler_loop(omega, dampers, faces, base, mass, drive, laws, h, room, z, v, force):
    """Fill z, v (k, n) and force (i, k) from their first entries on: z += h z', z' += h z'', all from the step's start.
    room: (numbers (i,), numbers (n,)) to work in.
    """
    n, m = omega.size, laws.shape[0]
    now, accel = room
    copied(force[:, 0], now)
    for k in range(drive.size):
        for c in range(m):
            along = pull(faces[c], z[k], v[k], omega, dampers, base, drive[k], accel)
            travel = dot(faces[c], z[k]) - dot(faces[c], z[k - 1]) if k > 0 else 0.0
            now[c] = law_force(laws, c, dot(faces[c], v[k]), travel, now[c], holding(c, along, faces, now, mass))
            force[c, k] = now[c]
        if k + 1 < drive.size:
            accelerate(z[k], v[k], omega, dampers, faces, base, mass, drive[k], now, accel)
            for i in range(n):
                z[k + 1, i] = z[k, i] + h * v[k, i]
                v[k + 1, i] = v[k, i] + h * accel[i]
    return 0
