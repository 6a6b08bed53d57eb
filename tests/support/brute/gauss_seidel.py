"""Points of friction laws on the ports of a linear structure, one small step after another, by Gauss-Seidel.

The slide of point j over a step is linear in the forces at its end, ds_j = a_j - sum_k M_jk f_k, with the compliance of the
pieces and that of the structure in a step. Each point in turn gets the force at which its own law agrees with its slide,
until no force changes. Rigid points (COULOMB) are projected onto their limits: by the slide behind a compliance, or by the
velocity at the end of the step (Moreau) without one.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from .laws_by_steps import BONDS, COULOMB, LUGRE, STRIPS, bond_weight, slide_point

PRESCRIBED, CONTACT, LOWER, GROOVES = range(4)
MAX_SWEEPS = 4000
TOLERANCE = 1e-10  # largest change of a force in the last sweep, relative to the largest limit
MAX_AGE = 45.0  # path in bond lengths after which a bond carries nothing


class Points(NamedTuple):
    """m contact points.

    - port (m,): number of the port
    - kind (m,), numbers (m, 6), cells (m, k, 2), memory (m, 2 k): see `laws_by_steps`
    - limits (m, 2): factors of the load for a slide to +x and to -x (1, or those of an averaged pressure)
    - average (w + 1,): spacing [m] and w weights of an averaged pressure that changes; (0,) for other laws
    - compliance (m, m) [m/N]: of the pieces
    """

    port: np.ndarray
    kind: np.ndarray
    numbers: np.ndarray
    cells: np.ndarray
    memory: np.ndarray
    limits: np.ndarray
    average: np.ndarray
    compliance: np.ndarray


class Structure(NamedTuple):
    """Linear structure in steps of equal length, or none (n = 0) where the slide of the ports is prescribed.

    - rows (p, n): slide of each port per coordinate
    - transition (2 n, 2 n): of displacements and velocities in a step
    - start, end (2 n, n): response to generalised forces that fall from 1 to 0, and rise from 0 to 1
    - output (n,): displacement of the output per coordinate
    - drive (k, n): generalised forces of the drive at the samples
    - spring_rows (s, n), springs (s, 2): displacement of nonlinear springs per coordinate, their stiffness [N/m3] and 0, or
      stiffness [N/m] and wave number [rad/m] of a sinusoidal force
    - path (k, 2 p): prescribed slides [m] and velocities [m/s] of the ports at the samples, with n = 0
    """

    rows: np.ndarray
    transition: np.ndarray
    start: np.ndarray
    end: np.ndarray
    output: np.ndarray
    drive: np.ndarray
    spring_rows: np.ndarray
    springs: np.ndarray
    path: np.ndarray


class Loads(NamedTuple):
    """Normal loads of the points.

    - kind: PRESCRIBED, CONTACT, LOWER or GROOVES
    - values (k, m) [N]: at the samples, with PRESCRIBED and GROOVES; (1, m) loads at the start otherwise
    - x (m,) [m], area (m,) [m2]: of the nodes of a patch
    - opening (m,) [m], compliance (m, m) [m/N]: CONTACT without forces at the start
    - motions (2, n): heave and pitch per coordinate
    - pressure (2, q): positions [m] and pressure [Pa] of the lower piece
    - grooves (3,): wave number [rad/m], amplitude [m], phase [rad]
    """

    kind: int
    values: np.ndarray
    x: np.ndarray
    area: np.ndarray
    opening: np.ndarray
    compliance: np.ndarray
    motions: np.ndarray
    pressure: np.ndarray
    grooves: np.ndarray


@njit(cache=True)
def solve_contact(loads, heave, pitch, force):
    """Solve the unilateral contact w = opening + heave + pitch x + C f >= 0, f >= 0, f w = 0 from the set of `force` > 0."""
    m = force.size
    active = force > 0
    for trial in range(6 * m + 20):
        index = np.flatnonzero(active)
        force[:] = 0.0
        if index.size:
            matrix = np.empty((index.size, index.size))
            right = np.empty(index.size)
            for i in range(index.size):
                right[i] = -(loads.opening[index[i]] + heave + pitch * loads.x[index[i]])
                for k in range(index.size):
                    matrix[i, k] = loads.compliance[index[i], index[k]]
            force[index] = np.linalg.solve(matrix, right)
        n_wrong = 0
        size = np.abs(force).max()
        gap = loads.opening + heave + pitch * loads.x + loads.compliance @ force
        for i in range(m):
            wrong = force[i] < -1e-12 * size if active[i] else gap[i] < -1e-18
            # A single node changes after many trials, which cannot cycle.
            if wrong and (trial < 20 or n_wrong == 0):
                active[i] = not active[i]
            n_wrong += wrong
        if n_wrong == 0:
            break
    for i in range(m):
        force[i] = max(force[i], 0.0)


@njit(cache=True)
def average_behind(place, sign, x, pressure, average):
    """Return the pressure averaged over the path behind a place, with the spacing and the weights of `average`.

    A point on which nothing presses carries nothing, and the average ends where the pressure vanishes.
    """
    total = 0.0
    for k in range(average.size - 1):
        at = place - sign * k * average[0]
        value = np.interp(at, x, pressure) if x[0] <= at <= x[-1] else 0.0
        if value <= 0.0:
            break
        total += average[k + 1] * value
    return total


@njit(cache=True)
def sum_strips(strips, n_strips, numbers, slide, path):
    """Return the force of a list of bonds at a slide [m] after a path [m]; strips (n, 3) have birth slide, path and load."""
    total = 0.0
    for k in range(n_strips):
        weight = strips[k, 2]
        if weight != 0.0:
            total += weight * bond_weight(
                numbers[2], numbers[3] != 0, slide - strips[k, 0], path - strips[k, 1], numbers[1]
            )
    return numbers[0] * total


@njit(cache=True)
def march(points, structure, loads, dt, state, samples):
    """March over all samples; returns the number of steps whose forces did not converge.

    Parameters
    ----------
    points, structure, loads
    dt : float
        Step [s].
    state : (2 n,) array
        Displacements and velocities at the start, changed in place.
    samples : (k, 2 p + 1) array
        Slide [m] and force [N] of each port, and the displacement of the output [m], at every sample, zeros at first.
    """
    m = points.port.size
    n_ports, n = structure.rows.shape
    n_steps = samples.shape[0] - 1
    cells = points.cells
    memory = points.memory
    new = memory.copy()
    force = np.zeros(m)
    next_force = np.zeros(m)
    load = loads.values[0].copy()
    end_load = load.copy()
    normal = load.copy()
    start_load = load.copy()
    rigid = False
    has_strips = False
    for j in range(m):
        rigid = rigid or (points.kind[j] == COULOMB and points.compliance[j, j] == 0.0)
        has_strips = has_strips or points.kind[j] == STRIPS

    # A rigid point takes the force at the end for the whole step (Moreau), others a force that is linear in the step.
    by_end = structure.end + structure.start if rigid else structure.end
    by_start = 0 * structure.start if rigid else structure.start
    slide_by_force = np.zeros((n_ports, n_ports))
    rate_by_force = np.zeros((n_ports, n_ports))
    for p in range(n_ports):
        for r in range(n_ports):
            for i in range(n):
                for k in range(n):
                    slide_by_force[p, r] += (
                        structure.rows[p, i] * by_end[i, k] * structure.rows[r, k]
                    )
                    rate_by_force[p, r] += (
                        structure.rows[p, i] * by_end[n + i, k] * structure.rows[r, k]
                    )

    # Bonds of the kind STRIPS: birth slide, birth path and load of each; slide and path of each point
    strips = np.zeros((m if has_strips else 0, n_steps + 2 if has_strips else 0, 3))
    first = np.zeros(m, np.int64)
    at = np.zeros(m)
    path = np.zeros(m)
    if has_strips:
        for j in range(m):
            strips[j, 0, 2] = points.numbers[j, 4] * load[j]
    scale = 0.0
    n_unsolved = 0
    general = np.zeros(n)
    old_general = np.zeros(n)
    old = np.zeros(n)
    climb = 1.0
    slope = 0.0
    slides = np.zeros(n_ports)
    rates = np.zeros(n_ports)
    base = loads.values[0].copy()

    for row in range(n_steps + 1):
        # record the state at this sample
        for p in range(n_ports):
            q = structure.path[row, p] if n == 0 else 0.0
            for i in range(n):
                q += structure.rows[p, i] * state[i]
            samples[row, 2 * p] = q
            samples[row, 2 * p + 1] = 0.0
            slides[p] = q
        for j in range(m):
            samples[row, 2 * points.port[j] + 1] += climb * force[j]
        if loads.kind == GROOVES:
            samples[row, 1] += slope * base.sum()
        for i in range(n):
            samples[row, 2 * n_ports] += structure.output[i] * state[i]
        if row == n_steps:
            break

        free = state.copy()
        if n:
            free = structure.transition @ state + structure.start @ structure.drive[row]
            free += structure.end @ structure.drive[row + 1] - by_start @ old_general
        guess = force.copy()
        done = False
        start_climb = climb
        for _ in range(40):
            # motion of the ports with the generalised forces of the last iteration that friction does not give
            y = free.copy()
            if n:
                y -= by_end @ general
            for p in range(n_ports):
                if n == 0:
                    rates[p] = structure.path[row + 1, n_ports + p]
                    samples[row + 1, 2 * p] = structure.path[row + 1, p]
                    continue
                q = v = 0.0
                for i in range(n):
                    q += structure.rows[p, i] * y[i]
                    v += structure.rows[p, i] * y[n + i]
                samples[row + 1, 2 * p] = q
                rates[p] = v
            # state at the end with the present friction forces
            for j in range(m if n else 0):
                y -= by_end @ structure.rows[points.port[j]] * (climb * guess[j])
            for p in range(n_ports):
                slides[p] = structure.path[row + 1, p] if n == 0 else 0.0
                for i in range(n):
                    slides[p] += structure.rows[p, i] * y[i]

            # loads at the end
            if loads.kind == PRESCRIBED:
                end_load[:] = loads.values[row + 1]
            elif loads.kind == LOWER:
                for j in range(m):
                    place = loads.x[j] + slides[0]
                    inside = loads.pressure[0, 0] <= place <= loads.pressure[0, -1]
                    p_at = np.interp(place, loads.pressure[0], loads.pressure[1]) if inside else 0.0
                    end_load[j] = loads.area[j] * p_at
            elif loads.kind == CONTACT:
                heave = pitch = 0.0
                for i in range(n):
                    heave += loads.motions[0, i] * y[i]
                    pitch += loads.motions[1, i] * y[i]
                solve_contact(loads, heave, pitch, normal)
                end_load[:] = normal
            else:
                base = loads.values[row + 1]
                turn = loads.grooves[0] * slides[0] - loads.grooves[2]
                slope = loads.grooves[0] * loads.grooves[1] * np.sin(turn)
                climb = np.sqrt(1 + slope * slope)
                for j in range(m):
                    end_load[j] = base[j] * climb + guess[j] * slope
            for j in range(m):
                # Bonds on a moving pressure keep that under which they formed: no load changes at rest.
                keeps = loads.kind == LOWER and (points.kind[j] == BONDS or points.kind[j] == LUGRE)
                start_load[j] = end_load[j] if keeps else load[j]
                scale = max(scale, end_load[j] * max(points.numbers[j, 0], 1e-3))

            if points.average.size > 1:
                shift = slides[0] if loads.kind == LOWER else 0.0
                field = loads.pressure[1] if loads.kind == LOWER else end_load / loads.area
                for j in range(m):
                    nominal = end_load[j] / loads.area[j]
                    for side in range(2):
                        sign = 1.0 - 2 * side
                        mean = average_behind(
                            loads.x[j] + shift, sign, loads.x, field, points.average
                        )
                        points.limits[j, side] = mean / nominal if nominal > 0 else 0.0

            # Gauss-Seidel over the points
            mean_climb = 0.5 * (climb + start_climb)
            for sweep in range(MAX_SWEEPS):
                change = 0.0
                for j in range(m):
                    p = points.port[j]
                    ds = mean_climb * (samples[row + 1, 2 * p] - samples[row, 2 * p])
                    v = climb * rates[p]
                    for k in range(m):
                        bent = points.compliance[j, k] * (guess[k] - force[k])
                        r = points.port[k]
                        ds -= bent + mean_climb * slide_by_force[p, r] * climb * guess[k]
                        v -= bent / dt + climb * rate_by_force[p, r] * climb * guess[k]
                    own = points.compliance[j, j] + mean_climb * slide_by_force[p, p] * climb
                    own_rate = points.compliance[j, j] / dt + climb * rate_by_force[p, p] * climb
                    f = guess[j]
                    if points.kind[j] == COULOMB:
                        limit = points.numbers[j, 0] * end_load[j]
                        if points.compliance[j, j] > 0:
                            f += ds / own
                        elif own_rate > 0:
                            f += v / own_rate
                        elif v != 0.0:
                            f = limit if v > 0 else -limit
                        f = min(max(f, -limit * points.limits[j, 1]), limit * points.limits[j, 0])
                        change = max(change, abs(f - guess[j]))
                        guess[j] = f
                        continue

                    # residual law(f) - f falls with f by at least 1, so that f + residual is beyond the root
                    low = f
                    residual = _residual(
                        points,
                        strips,
                        first,
                        at,
                        path,
                        j,
                        new,
                        low,
                        guess[j],
                        ds,
                        v,
                        own,
                        own_rate,
                        dt,
                        start_load[j],
                        end_load[j],
                        row,
                    )
                    low_residual = residual
                    high = f + residual
                    high_residual = 0.0
                    if residual != 0.0:
                        high_residual = _residual(
                            points,
                            strips,
                            first,
                            at,
                            path,
                            j,
                            new,
                            high,
                            guess[j],
                            ds,
                            v,
                            own,
                            own_rate,
                            dt,
                            start_load[j],
                            end_load[j],
                            row,
                        )
                    f = high
                    side = 0
                    for _ in range(80):
                        if abs(high - low) <= 1e-3 * TOLERANCE * scale or high_residual == 0.0:
                            f = high
                            break
                        f = (low * high_residual - high * low_residual) / (
                            high_residual - low_residual
                        )
                        residual = _residual(
                            points,
                            strips,
                            first,
                            at,
                            path,
                            j,
                            new,
                            f,
                            guess[j],
                            ds,
                            v,
                            own,
                            own_rate,
                            dt,
                            start_load[j],
                            end_load[j],
                            row,
                        )
                        if abs(residual) <= 1e-2 * TOLERANCE * scale:
                            break
                        # Illinois method
                        if residual * high_residual > 0:
                            high = f
                            high_residual = residual
                            if side == 1:
                                low_residual *= 0.5
                            side = 1
                        else:
                            low = f
                            low_residual = residual
                            if side == -1:
                                high_residual *= 0.5
                            side = -1
                    change = max(change, abs(f - guess[j]))
                    guess[j] = f
                if change <= TOLERANCE * scale or m == 1:
                    break
                if sweep == MAX_SWEEPS - 1:
                    n_unsolved += 1

            # forces on the coordinates besides friction, at the last estimate of the end
            old[:] = general
            general[:] = 0.0
            for k in range(structure.springs.shape[0]):
                stiffness, wave = structure.springs[k]
                x = structure.spring_rows[k] @ y[:n]
                pull = stiffness / wave * np.sin(wave * x) if wave > 0 else stiffness * x**3
                general += structure.spring_rows[k] * pull
            if loads.kind == CONTACT:
                lift = normal.sum() - loads.values[0].sum()
                moment = (normal - loads.values[0]) @ loads.x
                general -= loads.motions[0] * lift + loads.motions[1] * moment
            elif loads.kind == GROOVES and n:
                general += structure.rows[0] * (slope * base.sum())
            moved = np.abs(guess - next_force).max()
            if n:
                moved = max(moved, np.abs(general - old).max())
            next_force[:] = guess
            if moved <= 1e-9 * scale:
                done = True
                break
        if not done:
            n_unsolved += 1

        # commit: memory at the forces found, motion, bonds that form in this step
        for j in range(m):
            p = points.port[j]
            ds = mean_climb * (samples[row + 1, 2 * p] - samples[row, 2 * p])
            v = climb * rates[p]
            for k in range(m):
                bent = points.compliance[j, k] * (guess[k] - force[k])
                r = points.port[k]
                ds -= bent + mean_climb * slide_by_force[p, r] * climb * guess[k]
                v -= bent / dt + climb * rate_by_force[p, r] * climb * guess[k]
            if points.kind[j] == STRIPS:
                length = points.numbers[j, 1]
                strips[j, row + 1, 0] = at[j] + 0.5 * ds
                strips[j, row + 1, 1] = path[j] + 0.5 * abs(ds)
                strips[j, row + 1, 2] = 0.5 * (load[j] + end_load[j]) * abs(ds) / length
                at[j] += ds
                path[j] += abs(ds)
                while first[j] <= row and path[j] - strips[j, first[j], 1] > MAX_AGE * length:
                    first[j] += 1
            elif points.kind[j] != COULOMB:
                slide_point(
                    points.kind[j],
                    points.numbers[j],
                    cells[j],
                    memory[j],
                    new[j],
                    ds,
                    dt,
                    v,
                    start_load[j],
                    end_load[j],
                )
                memory[j] = new[j]
                if loads.kind == LOWER and start_load[j] <= 0.0:
                    memory[j] = 0.0
            load[j] = end_load[j]
        force[:] = guess
        if n:
            y = free - by_end @ general
            for j in range(m):
                y -= by_end @ structure.rows[points.port[j]] * (climb * force[j])
            state[:] = y
            old_general[:] = general
            for j in range(m):
                old_general += structure.rows[points.port[j]] * (climb * force[j])
    return n_unsolved


@njit(cache=True)
def _residual(
    points, strips, first, at, path, j, new, f, old, ds, v, own, own_rate, dt, load, end_load, row
):
    """Return the force of the law of point j, if its force is f, less f. ds and v belong to the force `old`."""
    move = ds - own * (f - old)
    if points.kind[j] == STRIPS:
        numbers = points.numbers[j]
        k = first[j]
        total = sum_strips(strips[j, k:], row + 1 - k, numbers, at[j] + move, path[j] + abs(move))
        middle = bond_weight(numbers[2], numbers[3] != 0, 0.5 * move, 0.5 * abs(move), numbers[1])
        total += numbers[0] * 0.5 * (load + end_load) * abs(move) / numbers[1] * middle
        return total - f
    velocity = v - own_rate * (f - old)
    return (
        slide_point(
            points.kind[j],
            points.numbers[j],
            points.cells[j],
            points.memory[j],
            new[j],
            move,
            dt,
            velocity,
            load,
            end_load,
        )
        - f
    )
