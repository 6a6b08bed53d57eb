"""Equation 2.17 as a direct sum over all bonds of all nodes, written from 2.10-2.17 without the compiled lists.

Every node keeps every bond of its own path, in strips of 80 bond lengths over the steps of a cycle (0.2 at 400, which
alone has an error of 4e-4 of the friction limit), each with the midpoint rule and its fraction on either side of u = 0.
The bodies have their full compliance, s_i = q - sum_j C_ij F_j(s_j) at the end of each step, solved by Newton's method
on all nodes. No force is averaged over a step, and no bonds are merged. A bond forms under the pressure at its
position, or under the load, in the middle of its part of the step.
"""

from math import gamma

import numpy as np

# Maximum age of the bonds that are kept, and half-width of the initial bonds [bond lengths].
MOST, FIRST_WIDE = (25.0, 1e-6)
# Bond lengths per strip times steps per cycle; maximum number of parts per step.
FINEST, MOST_PARTS = 80.0, 60


class NodeBonds:
    """Bonds of m points, each along its own path, by 2.10 and 2.14-2.17.

    Parameters
    ----------
    f : Friction
        Law of the scene.
    size : int
        Number of points m.
    floor : float
        Smallest speed in the growth at rest [m/s].
    steps : int
        Steps per cycle.
    """

    def __init__(self, f, size: int, floor: float, steps: int = 400):
        self.f = f
        self.floor = floor
        self.mu = f.static
        self.finest = FINEST / steps
        self.at = np.zeros(size)
        self.path = np.zeros(size)
        self.harm = np.zeros(size)
        self.eps = np.full(size, f.bond_length)
        self.low, self.high, self.when, self.hurt, self.born, self.lag, self.dense = (
            np.zeros((0, size)) for _ in range(7)
        )
        self.first = np.ones(size)
        self.forming = lambda places, part: np.ones_like(places)

    def compute_lengths(self, displacement, dt):
        """Return bond lengths by 2.10 for points that move by `displacement` (m,) [m] in a step dt [s].

        Returns
        -------
        tuple
            Mature length after the step, factor on the distance of a bond from it, and length half
            way, (m,) each.
        """
        f = self.f
        if f.rest_growth is None:
            return self.eps, np.ones_like(displacement), self.eps
        out = []
        for part in (1.0, 0.5):
            rest_growth = f.rest_growth * part * dt / np.maximum(displacement / dt, self.floor)
            slip_growth = part * displacement / f.slip_growth
            target = (
                rest_growth * f.bond_length + slip_growth * f.bond_length * f.kinetic / f.static
            ) / (rest_growth + slip_growth)
            decay = np.exp(-rest_growth - slip_growth)
            out += [target + (self.eps - target) * decay, decay]
        return out[0], out[1], out[2]

    def weight(self, s, dt, keep: bool = False):
        """Return force / (mu_s sigma A) (m,) of points that slide to s (m,) [m] in a step dt [s].

        keep: whether s becomes the new state.
        """
        f = self.f
        p = self.f.order
        e0 = self.f.bond_length
        distance = np.abs(s - self.at)
        norm = gamma(self.f.order + 1)
        eps, decay, middle = self.compute_lengths(distance, dt)
        path = self.path + distance
        harm = self.harm + distance / middle
        parts = (
            int(np.ceil(distance.max() / (self.finest * e0 * (f.kinetic or f.static) / f.static)))
            or 1
        )
        parts = min(parts, MOST_PARTS)
        ends = self.at + np.arange(parts + 1)[:, None] / parts * (s - self.at)
        # Fraction of the step between the middle of a part and the end of the step.
        remaining_fraction = 1 - (np.arange(parts)[:, None] + 0.5) / parts
        low = np.vstack([self.low, ends[:-1]])
        high = np.vstack([self.high, ends[1:]])
        size = np.abs(high - low)
        position = np.divide(s - low, high - low, out=np.full(low.shape, 0.5), where=size > 0)
        # Bonds formed behind the point minus bonds formed ahead of it.
        side = np.where(high >= low, 1.0, -1.0) * (2 * np.clip(position, 0, 1) - 1)
        initial_path = np.vstack([self.when, path - remaining_fraction * distance])
        initial_damage = np.vstack([self.hurt, harm - remaining_fraction * distance / middle])
        initial_length = np.vstack([self.born, np.tile(middle, (parts, 1))])
        gone = np.zeros_like(distance) + decay
        # Difference between the mature length and the length of a bond, which grows from 0 by 2.10.
        lag = np.vstack([self.lag * gone, middle * gone**remaining_fraction])
        dense = np.vstack(
            [self.dense, self.forming((ends[1:] + ends[:-1]) / 2, 1 - remaining_fraction)]
        )
        age = path - initial_path
        if f.reading == "report":
            bond_length = np.maximum(eps - lag, 1e-9 * eps) if f.rest_growth is not None else e0
            x = age / bond_length
            contributions = np.where(size > 0, x**p * np.exp(-x), 0.0) * size / (e0 * norm)
            initial_bonds = (
                f.initial_bonds
                / norm
                * np.where(path > 0, (path / e0) ** p, float(p == 0))
                * np.exp(-path / e0)
            )
            initial_bonds = initial_bonds * self.first * np.clip(s / (FIRST_WIDE * e0), -1, 1)
        else:
            u = np.abs(s - (low + high) / 2)
            contributions = (
                (u / initial_length) ** p * np.exp(-(harm - initial_damage)) * size / (e0 * norm)
            )
            initial_bonds = (
                f.initial_bonds
                / norm
                * (np.abs(s) / e0) ** p
                * np.exp(-harm)
                * np.sign(s)
                * self.first
            )
        contributions = contributions * dense
        if keep:
            is_kept = (age / e0 < MOST).any(axis=1)
            self.low, self.high, self.when, self.hurt, self.born, self.lag, self.dense = (
                column[is_kept]
                for column in (low, high, initial_path, initial_damage, initial_length, lag, dense)
            )
            self.at = s
            self.path = path
            self.harm = harm
            self.eps = eps
        return (contributions * side).sum(axis=0) + initial_bonds


def solve_displacements(bonds: NodeBonds, limit, c, q: float, dt: float, guess):
    """Solve s = q - c F(s) by Newton's method with step halving.

    Parameters
    ----------
    bonds : Bonds
    limit : (m,) array
        Friction limits [N].
    c : (m, m) array
        Compliance [m/N].
    q : float
        Slide of the holder [m].
    dt : float
        Step [s].
    guess : (m,) array
        Initial slides [m].

    Returns
    -------
    tuple
        Slides (m,) [m] and forces (m,) [N].
    """
    s = guess.copy()
    increment = 1e-7 * bonds.f.bond_length
    force = limit * bonds.weight(s, dt)
    residual = s - q + c @ force
    for _ in range(25):
        if np.abs(residual).max() < 1e-9 * (abs(q) + bonds.f.bond_length):
            break
        slope = (
            limit
            * (bonds.weight(s + increment, dt) - bonds.weight(s - increment, dt))
            / (2 * increment)
        )
        step = np.linalg.solve(np.eye(s.size) + c * slope, residual)
        for part in 0.5 ** np.arange(8):
            new = s - part * step
            new_force = limit * bonds.weight(new, dt)
            new_residual = new - q + c @ new_force
            if np.linalg.norm(new_residual) < (1 - 0.1 * part) * np.linalg.norm(residual):
                break
        s = new
        force = new_force
        residual = new_residual
    return s, force
