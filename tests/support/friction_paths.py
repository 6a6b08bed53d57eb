"""Paths, pressure patterns and explicit sums over bonds for tests of the friction laws.

Lengths are in units of eps_0 and tractions in units of mu_s sigma, unless a law says otherwise.
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.special import gamma

sys.path.append(str(Path(__file__).parents[2] / "studies/drift"))
from force_control import drift, slides  # noqa: F401  (force control: one door for the tests of the laws)

GAUSS = np.polynomial.legendre.leggauss(12)


class PathHistory(NamedTuple):
    """Histories of a law along a path: step means, tractions after each step, energies per area."""

    mean: np.ndarray
    traction: np.ndarray
    dissipated: np.ndarray
    stored: np.ndarray
    state: object


def triangle_path(amplitude, cycles, per_stroke, start=0.0):
    """Return the knots of a triangle wave with `per_stroke` equal steps between reversals.

    It begins at -amplitude if start < 0, else at 0.
    """
    stroke = np.linspace(-amplitude, amplitude, per_stroke + 1)
    cycle = np.concatenate([stroke[1:], stroke[::-1][1:]])
    path = np.concatenate([[-amplitude], *[cycle] * cycles])
    if start < 0:
        return path
    return np.concatenate([np.linspace(0, -amplitude, per_stroke // 2 + 1)[:-1], path])


def upper_pressure(sigma):
    """Return a pressure that is fixed to the upper body, and so does not depend on the relative displacement."""
    sigma = np.asarray(sigma, float)
    return lambda q: sigma


def lower_pressure(x, wave, floor=0.0):
    """Return a pressure (m,) fixed to the lower body with unloaded zones: max(0, sine) pattern at x + q."""
    return lambda q: np.maximum(np.sin(2 * np.pi * (np.asarray(x) + q) / wave) + floor, 0.0)


def march_path(law, path, pressure, dt=1.0):
    """March `law` along the knots `path`; `pressure` maps a displacement to (m,) values; dt: scalar or per step."""
    times = np.broadcast_to(dt, len(path) - 1)
    state = law.initial_state(pressure(path[0]))
    rows = []
    for k, dq in enumerate(np.diff(path)):
        step = law.step(state, float(dq), pressure(path[k]), pressure(path[k + 1]), float(times[k]))
        state = step.state
        rows.append((step.mean, law.traction(state), step.dissipated, law.stored_energy(state)))
    return PathHistory(*(np.array(part) for part in zip(*rows)), state)


def bond_length_rates(law, speed):
    """Return the growth rates of the bond length at rest and in slip (2.10) at a constant speed [1/s]."""
    return law.rest_growth / max(abs(speed), law.rest_speed), abs(speed) / law.slip_growth


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
