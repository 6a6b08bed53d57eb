"""Friction laws over one small step: force at its end, and new memory, by implicit Euler or the exact path solution.

Numbers and memory belong to a point under a load n, and all forces are proportional to loads, so that no load is divided by
another one unless it is positive.

========= ============================================= ==========================================================
kind      numbers                                       memory
========= ============================================= ==========================================================
CELLS     mu, 1 if the stiffness is constant            stretch y and springs s of each cell, as loads: force = mu w y
BOUC_WEN  mu, length [m], exponent, shape               y, s as for one cell
BONDS     mu, length [m], density of first bonds        bonds m, their stretch z = sum(w u), s2 = sum(w u^2)
LUGRE     stiffness, damping, viscous, static, kinetic  m, z, s2; the numbers are per load, the last is the Stribeck
                                                        velocity
TANH      mu, reference speed [m/s]                     none
COULOMB   mu                                            none
STRIPS    mu, length [m], order, 1 for "report", speed  bonds of `gauss_seidel.Strips`
========= ============================================= ==========================================================

Change of the load of a point at rest (see the guide and `friction.bonds`): springs and bonds that a rising load adds are
unstretched. Elastic forces are clipped at a falling limit; springs beyond the load break only as the point slips, over a
bond length. Bonds without stretch are lost first, so that the moments stay until z^2/s2 exceeds what is left of m.
"""

from math import exp, gamma, tanh

from numba import njit

CELLS, BOUC_WEN, BONDS, LUGRE, TANH, COULOMB, STRIPS = range(7)


@njit(cache=True)
def press_cell(y, springs, load, is_constant):
    """Return stretch and springs of a cell after its load has changed to `load`."""
    y = min(max(y, -load), load)
    if is_constant:
        return y, springs
    return y, (max(springs, load) if load > 0 else 0.0)


@njit(cache=True)
def press_bonds(m, z, s2, before, after, density, length):
    """Return the moments of bonds after a change of the load from `before` to `after`."""
    if after >= before:
        return m + density * (after - before), z, s2
    rest = m * after / before
    needed = z * z / s2 if s2 > 0 else 0.0
    factor = rest / needed if needed > rest else 1.0
    if factor * abs(z) > length * after:
        factor = length * after / abs(z)
    return rest, z * factor, s2 * factor


@njit(cache=True)
def slide_bonds(m, z, s2, ds, load, length):
    """Return the moments after a slide: dm = (load - m) dx, dz = m ds - z dx, d(s2) = 2 z ds - s2 dx, dx = |ds|/length."""
    x = abs(ds) / length
    sign = 1.0 if ds > 0 else -1.0
    decay = exp(-x)
    lack = load - m
    end = z * decay + sign * length * (load * (1 - decay) - lack * x * decay)
    middle = z * exp(-x / 2) + sign * length * (
        load * (1 - exp(-x / 2)) - lack * x / 2 * exp(-x / 2)
    )
    # Simpson's rule for the sum of the squares
    source = (z * decay + 4 * middle * exp(-x / 2) + end) / 6
    return load - lack * decay, end, s2 * decay + 2 * source * ds


@njit(cache=True)
def bond_weight(order, is_report, stretch, path, length):
    """Return the force of a bond relative to its load: phi sgn(u), eqs. 2.14 and 2.17, or 0 for an unstretched bond."""
    if stretch == 0.0:
        return 0.0
    rise = path if is_report else abs(stretch)
    size = (rise / length) ** order * exp(-path / length) / gamma(order + 1)
    return size if stretch > 0 else -size


@njit(cache=True)
def slide_point(kind, numbers, cells, memory, new, ds, dt, velocity, before, after):
    """Return the force at the end of a step of the kinds CELLS to TANH, and write the `new` memory.

    Parameters
    ----------
    kind : int
    numbers : (6,) array
    cells : (k, 2) array
        Share of the limit and yield displacement [m] of each cell.
    memory, new : (2 k,) array
        Memory before and after.
    ds, dt : float
        Slide [m] and duration [s].
    velocity : float
        Velocity at the end [m/s].
    before, after : float
        Loads at both ends [N].
    """
    mu = numbers[0]
    if kind == CELLS:
        force = 0.0
        for k in range(cells.shape[0]):
            share = cells[k, 0]
            length = cells[k, 1]
            y, springs = press_cell(memory[2 * k], memory[2 * k + 1], after, numbers[1] != 0)
            move = springs / length * ds
            end = min(max(y + move, -after), after)
            if numbers[1] == 0 and springs > after and move != 0:
                slip = 1 - (end - y) / move
                springs = after + (springs - after) * exp(-slip * abs(ds) / length)
            new[2 * k] = end
            new[2 * k + 1] = springs
            force += share * end
        return mu * force

    if kind == BOUC_WEN:
        y, springs = press_cell(memory[0], memory[1], after, False)
        if after <= 0:
            new[0] = new[1] = 0.0
            return 0.0
        # dy = springs/length ds (1 - |y/n|^e (shape sgn(ds y) + 1 - shape)), by the classical Runge-Kutta method
        sign = 1.0 if ds > 0 else -1.0
        pieces = int(abs(ds) / numbers[1] * 20 * max(1.0, numbers[2]) + 1)
        h = abs(ds) / pieces
        slipped = 0.0
        for _ in range(pieces):
            last = 0.0
            total = 0.0
            for stage in range(4):
                at = y + (0.0 if stage == 0 else 0.5 if stage < 3 else 1.0) * h * last
                turn = numbers[3] * (1.0 if sign * at > 0 else -1.0) + 1 - numbers[3]
                slip = min(abs(at / after), 1.0) ** numbers[2] * turn
                last = sign * springs / numbers[1] * (1 - slip)
                total += last * (1.0 if stage in (0, 3) else 2.0) / 6
            new_y = min(max(y + h * total, -after), after)
            share = 1 - abs(new_y - y) * numbers[1] / max(springs * h, 1e-300)
            slipped += max(share, 0.0) * h
            y = new_y
        if springs > after:
            springs = after + (springs - after) * exp(-slipped / numbers[1])
        new[0] = y
        new[1] = springs
        return mu * y

    if kind == BONDS:
        m, z, s2 = press_bonds(
            memory[0], memory[1], memory[2], before, after, numbers[2], numbers[1]
        )
        new[0], new[1], new[2] = slide_bonds(m, z, s2, ds, after, numbers[1])
        return mu / numbers[1] * new[1]

    if kind == LUGRE:
        stiffness = numbers[0]
        speed = abs(ds) / dt if dt > 0 else 0.0
        limit = numbers[4] + (numbers[3] - numbers[4]) * exp(-((speed / numbers[5]) ** 2))
        m, z, s2 = press_bonds(
            memory[0], memory[1], memory[2], before, after, 1.0, numbers[3] / stiffness
        )
        new[0], new[1], new[2] = slide_bonds(m, z, s2, ds, after, limit / stiffness)
        damping = numbers[1] * (new[1] - z) / dt + numbers[2] * after * ds / dt if dt > 0 else 0.0
        return stiffness * new[1] + damping

    return mu * after * tanh(velocity / numbers[1])
