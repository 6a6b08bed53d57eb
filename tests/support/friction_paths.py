"""Paths, pressure patterns and explicit sums over bonds for tests of the friction laws.

Lengths are in units of eps_0 and tractions in units of mu_s sigma, unless a law says otherwise.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from march_contacts import make_bond_contact, make_pressed_contact
from scipy.special import gamma

from patchfem.friction import Bonds
from patchfem.friction.bonds.list_numbers import cutoff_age
from patchfem.time_steps.contacts import BondSum, Contact
from patchfem.time_steps.slides import follow

GAUSS = np.polynomial.legendre.leggauss(12)


class PathHistory(NamedTuple):
    """Histories of contact points along a path of k steps.

    - traction (k, m): tractions of the points after each step, positive against slip to +x
    - mean, dissipated, stored (k,): sums over the points of the path-mean traction of each step, the energy per area that
      it dissipates, and the stored energy after it
    """

    traction: np.ndarray
    mean: np.ndarray
    dissipated: np.ndarray
    stored: np.ndarray


def triangle_path(amplitude, cycles, per_stroke):
    """Return the knots of a triangle wave with `per_stroke` equal steps between reversals.

    It begins at 0.
    """
    stroke = np.linspace(-amplitude, amplitude, per_stroke + 1)
    cycle = np.concatenate([stroke[1:], stroke[::-1][1:]])
    path = np.concatenate([[-amplitude], *[cycle] * cycles])
    return np.concatenate([np.linspace(0, -amplitude, per_stroke // 2 + 1)[:-1], path])


def upper_pressure(sigma):
    """Return a pressure that is fixed to the upper body, and so does not depend on the relative displacement."""
    sigma = np.asarray(sigma, float)
    return lambda q: sigma


class LowerPressure(NamedTuple):
    """Pressure that is fixed to the lower body, linear between the positions of the points and 0 beyond them.

    - places, sigma (m,): positions, and the pressure at them
    """

    places: np.ndarray
    sigma: np.ndarray

    def __call__(self, q):
        """Return the pressure (m,) at the points of the upper body after a displacement q."""
        return np.interp(self.places + q, self.places, self.sigma, left=0.0, right=0.0)


def make_bond_sum(law: Bonds, tail, merge=0.0) -> BondSum:
    """Return the settings of a list that loses at most a fraction `tail` of the friction limit; 0 keeps every bond.

    merge: widest merged strip in bond lengths; 0 merges nothing.
    """
    return BondSum(law, cutoff_age(law.order, tail) if tail else np.inf, merge)


def make_points(law: Bonds, pressure, tail=None, merge=0.0) -> Contact:
    """Return contact points of unit area under a pressure.

    Their bonds are known by their moments without a `tail`, else summed over lists; a tail of 0 keeps every bond.
    """
    bond_sum = None if tail is None else make_bond_sum(law, tail, merge)
    row = np.zeros(0)
    if isinstance(pressure, LowerPressure):
        lower = np.stack([pressure.places, pressure.sigma])
        return make_bond_contact(law, np.ones(pressure.sigma.size), row, None, bond_sum, lower)
    return make_bond_contact(law, pressure(0.0), row, None, bond_sum)


def march_path(contact: Contact, path, dt=1.0) -> PathHistory:
    """Move contact points along the knots `path`; dt: scalar or per step."""
    times = np.concatenate([[0.0], np.cumsum(np.broadcast_to(dt, len(path) - 1))])
    motion = follow(contact, times, path, np.arange(1, len(path)))
    assert motion.n_unsolved == 0
    traction = np.array([snapshot.forces for snapshot in motion.snapshots])
    return PathHistory(traction, motion.mean, motion.losses, motion.stored[1:])


def march_bonds(law: Bonds, path, pressure, dt=1.0, tail=None, merge=0.0) -> PathHistory:
    """Move `make_points` along the knots `path`; dt: scalar or per step."""
    return march_path(make_points(law, pressure, tail, merge), path, dt)


def march_under_loads(law, path, loads, dt=1.0, tail=None) -> PathHistory:
    """Move a point along the knots `path` under `loads` at them, linear between them; dt: scalar or per step.

    `law` is a `Bonds`, or has the keys of a table [friction]; `tail` as in `make_points`.
    """
    times = np.concatenate([[0.0], np.cumsum(np.broadcast_to(dt, len(path) - 1))])
    bond_sum = None if tail is None else make_bond_sum(law, tail)
    contact = make_pressed_contact(
        law,
        float(loads[0]),
        np.zeros(0),
        None,
        bond_sum,
        load=lambda time: np.interp(time, times, loads),
    )
    return march_path(contact, path, dt)


def bond_length_rates(law, speed):
    """Return the growth rates of the bond length at rest and in slip (2.10) at a constant speed [1/s]."""
    growth = law.growth
    return growth.rest_growth / max(abs(speed), growth.rest_speed), abs(speed) / growth.slip_growth


def reference_bond_lengths(law, path, times):
    """Return the bond lengths at the knots and in the middle of each step.

    They solve 2.10 at constant speed in closed form.
    """
    knots = [law.length]
    middles = []
    for dq, dt in zip(np.diff(path), times):
        if not law.has_growth or dt == 0:
            middles.append(knots[-1])
            knots.append(knots[-1])
            continue
        a, b = bond_length_rates(law, dq / dt)
        goal = law.length * (a + law.ratio * b) / (a + b)
        middles.append(goal + (knots[-1] - goal) * np.exp(-(a + b) * dt / 2))
        knots.append(goal + (knots[-1] - goal) * np.exp(-(a + b) * dt))
    return np.array(knots), np.array(middles)


def integrate_bonds(law, path, dt, max_piece):
    """Yield (step, weights, stretches u, forces) of the bonds formed in each step of `path`.

    Each piece has 12 Gauss points. No bond is dropped or merged. Reading "stretch": damage uses the
    bond length in the middle of a step; reading "report": each bond integrates its own length from
    zero through every later step. `max_piece` is the largest piece of a step in bond lengths; the
    forces are (x/eps)^p exp(-x/eps) with x = |u| or the distance R.
    """
    steps = np.diff(path)
    times = np.broadcast_to(dt, len(steps)).astype(float)
    _, middles = reference_bond_lengths(law, path, times)
    y, w = GAUSS
    damage_after = np.append(np.cumsum((np.abs(steps) / middles)[::-1])[::-1], 0.0)
    travel_after = np.append(np.cumsum(np.abs(steps)[::-1])[::-1], 0.0)
    for k, dq in enumerate(steps):
        if dq == 0:
            continue
        breaks = set(np.linspace(0, 1, int(np.ceil(abs(dq) / (max_piece * middles[k]))) + 1))
        zero_crossing = (path[-1] - path[k]) / dq
        if 0 < zero_crossing < 1:
            breaks.add(zero_crossing)
        breaks = np.array(sorted(breaks))
        part = (breaks[:-1, None] + np.diff(breaks)[:, None] * (1 + y) / 2).ravel()
        weight = (np.diff(breaks)[:, None] * w / 2).ravel() * abs(dq) / law.length
        u = path[-1] - (path[k] + part * dq)
        travel = travel_after[k + 1] + (1 - part) * abs(dq)
        if law.reading == "stretch":
            damage = damage_after[k + 1] + (1 - part) * abs(dq) / middles[k]
            yield k, weight, u, (np.abs(u) / middles[k]) ** law.order * np.exp(-damage)
            continue
        bond_length = np.full(part.size, law.length)
        if law.has_growth:
            bond_length = np.zeros(part.size)
            for j in range(k, len(steps)):
                span = times[j] * (1 - part if j == k else 1.0)
                a, b = bond_length_rates(law, steps[j] / times[j])
                goal = law.length * (a + law.ratio * b) / (a + b)
                bond_length = goal + (bond_length - goal) * np.exp(-(a + b) * span)
        yield k, weight, u, (travel / bond_length) ** law.order * np.exp(-travel / bond_length)


def reference_traction(law, path, pressure, dt=1.0):
    """Return the traction (m,) over mu_s at the end of `path`: 2.17 as an explicit sum over bonds."""
    total = np.zeros_like(pressure(path[0]), float)
    for k, weight, u, force in integrate_bonds(law, path, dt, 0.5):
        mean = (pressure(path[k]) + pressure(path[k + 1])) / 2
        total += mean * (weight @ (np.sign(u) * force))
    net_displacement = path[-1] - path[0]
    if law.initial and net_displacement != 0:
        steps = np.abs(np.diff(path))
        x = steps.sum() / law.length
        size = x
        damage = x
        if law.reading == "stretch":
            size = abs(net_displacement) / law.length
            damage = (
                steps / reference_bond_lengths(law, path, np.broadcast_to(dt, steps.size))[1]
            ).sum()
        total += (
            law.initial
            * pressure(path[0])
            * np.sign(net_displacement)
            * size**law.order
            * np.exp(-damage)
        )
    return total / gamma(law.order + 1)


def reference_with_lift_off(law, path, pressure: LowerPressure, dt=1.0):
    """Return `reference_traction` (m,) of points that lose all bonds where a step ends without pressure."""
    is_bare = np.array([pressure(q) <= 0 for q in path])
    tractions = np.zeros(is_bare.shape[1])
    times = np.broadcast_to(dt, len(path) - 1)
    for point in np.flatnonzero(~is_bare[-1]):
        bare_knots = np.flatnonzero(is_bare[:, point])
        start = bare_knots[-1] if bare_knots.size else 0
        kept = replace(law, initial=0.0) if bare_knots.size else law
        at_point = lambda q: pressure(q)[point : point + 1]  # noqa: B023, E731
        tractions[point] = reference_traction(kept, path[start:], at_point, times[start:])[0]
    return tractions


def reference_energy(law, path, dt=1.0):
    """Return the stored energy at the end of `path` [m] per mu_s N.

    It is force times stretch at constant damage, summed over bonds.
    """
    total = sum(
        weight @ (force * np.abs(u)) for _, weight, u, force in integrate_bonds(law, path, dt, 0.25)
    )
    return total / gamma(law.order + 1) / (law.order + 1 if law.reading == "stretch" else 1.0)


def random_walk(seed, count, size):
    """Return the knots of a random walk from 0 with normally distributed steps."""
    return np.concatenate([[0], np.cumsum(np.random.default_rng(seed).normal(0, size, count))])
