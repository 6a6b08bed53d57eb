"""Paths, pressure patterns and a sum over bonds written out by hand, shared by the tests of the friction laws.

Everything here is in units of eps_0 and mu_s sigma unless a law says otherwise.
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.special import gamma

from patchfem.friction.bonds.quadrature import Quadrature

sys.path.append(str(Path(__file__).parents[2] / "studies/drift"))
from force_control import drift, slides  # noqa: F401  (force control: one door for the tests of the laws)

GAUSS = np.polynomial.legendre.leggauss(12)


class Walk(NamedTuple):
    """Histories of a law along a path: step means, tractions after each step, energies per area."""

    mean: np.ndarray
    traction: np.ndarray
    dissipated: np.ndarray
    stored: np.ndarray
    state: object


def triangle(amplitude, cycles, per_stroke, start=0.0):
    """Knots of a triangle wave, `per_stroke` equal steps between turns; from -amplitude when start < 0, else from 0."""
    one = np.linspace(-amplitude, amplitude, per_stroke + 1)
    cycle = np.concatenate([one[1:], one[::-1][1:]])
    whole = np.concatenate([[-amplitude], *[cycle] * cycles])
    if start < 0:
        return whole
    return np.concatenate([np.linspace(0, -amplitude, per_stroke // 2 + 1)[:-1], whole])


def upper_pressure(sigma):
    """Pressure that rides on the upper piece: the same at every slide."""
    sigma = np.asarray(sigma, float)
    return lambda q: sigma


def lower_pressure(x, wave, floor=0.0):
    """Pressure fixed to the lower piece with bare places: max(0, sin) pattern at x + q, (m,)."""
    return lambda q: np.maximum(np.sin(2 * np.pi * (np.asarray(x) + q) / wave) + floor, 0.0)


def walk(law, path, pressure, dt=1.0):
    """March `law` over the knots `path`; `pressure` maps a slide to (m,) values; dt scalar or one per step."""
    times = np.broadcast_to(dt, len(path) - 1)
    state = law.start(pressure(path[0]))
    rows = []
    for k, dq in enumerate(np.diff(path)):
        step = law.step(state, float(dq), pressure(path[k]), pressure(path[k + 1]), float(times[k]))
        state = step.state
        rows.append((step.mean, law.traction(state), step.dissipated, law.stored_energy(state)))
    return Walk(*(np.array(part) for part in zip(*rows)), state)


class Pulled(NamedTuple):
    """Tractions of a law after each step of a path, and its last state."""

    traction: np.ndarray
    state: object


def pulled(law, path, pressure, dt=1.0) -> Pulled:
    """As `walk`, without means and energies: of a sum over bonds at a tenth of the cost."""
    times = np.broadcast_to(dt, len(path) - 1)
    state = law.start(pressure(path[0]))
    rows = []
    for k, dq in enumerate(np.diff(path)):
        given = state, float(dq), pressure(path[k]), pressure(path[k + 1]), float(times[k])
        state = law.advance(*given) if isinstance(law, Quadrature) else law.step(*given).state
        rows.append(law.traction(state))
    return Pulled(np.array(rows), state)


def rates(law, speed):
    """(rest rate, slide rate) of 2.10 at a constant speed [1/s]."""
    return law.rest_growth / max(abs(speed), law.rest_speed), abs(speed) / law.slip_growth


def lengths_by_hand(law, path, times):
    """(length at the knots, length half way through each step): 2.10 at constant speed, solved in closed form."""
    knots = [law.length]
    middles = []
    for dq, dt in zip(np.diff(path), times):
        if not law.has_growth or dt == 0:
            middles.append(knots[-1])
            knots.append(knots[-1])
            continue
        a, b = rates(law, dq / dt)
        goal = law.length * (a + law.ratio * b) / (a + b)
        middles.append(goal + (knots[-1] - goal) * np.exp(-(a + b) * dt / 2))
        knots.append(goal + (knots[-1] - goal) * np.exp(-(a + b) * dt))
    return np.array(knots), np.array(middles)


def sum_by_hand(law, path, pressure, dt=1.0, pieces=None):
    """Traction (m,) at the end of `path` over mu_s: 2.17 as a plain sum over bonds, 12 Gauss points per piece.

    No bond is lost, kept apart or summed cleverly. stretch: damage with the length of the middle of a step; report:
    every bond integrates its own length from zero through every later step.
    """
    steps = np.diff(path)
    times = np.broadcast_to(dt, len(steps)).astype(float)
    _, middles = lengths_by_hand(law, path, times)
    y, w = GAUSS
    total = np.zeros_like(pressure(path[0]), float)
    harm_after = np.append(np.cumsum((np.abs(steps) / middles)[::-1])[::-1], 0.0)
    travel_after = np.append(np.cumsum(np.abs(steps)[::-1])[::-1], 0.0)
    for k, dq in enumerate(steps):
        if dq == 0:
            continue
        count = pieces or max(1, int(np.ceil(abs(dq) / (0.5 * middles[k]))))
        cuts = set(np.linspace(0, 1, count + 1))
        turn = (path[-1] - path[k]) / dq
        if 0 < turn < 1:
            cuts.add(turn)
        cuts = np.array(sorted(cuts))
        part = (cuts[:-1, None] + np.diff(cuts)[:, None] * (1 + y) / 2).ravel()
        weight = (np.diff(cuts)[:, None] * w / 2).ravel() * abs(dq) / law.length
        u = path[-1] - (path[k] + part * dq)
        travel = travel_after[k + 1] + (1 - part) * abs(dq)
        if law.reading == "stretch":
            harm = harm_after[k + 1] + (1 - part) * abs(dq) / middles[k]
            f = (np.abs(u) / middles[k]) ** law.order * np.exp(-harm)
        elif not law.has_growth:
            f = (travel / law.length) ** law.order * np.exp(-travel / law.length)
        else:
            own = np.zeros_like(part)
            for j in range(k, len(steps)):
                span = times[j] * (1 - part if j == k else 1.0)
                a, b = rates(law, steps[j] / times[j])
                goal = law.length * (a + law.ratio * b) / (a + b)
                own = goal + (own - goal) * np.exp(-(a + b) * span)
            f = (travel / own) ** law.order * np.exp(-travel / own)
        total += (pressure(path[k]) + pressure(path[k + 1])) / 2 * (weight @ (np.sign(u) * f))
    cohort = path[-1] - path[0]
    if law.initial and cohort != 0:
        x = travel_after[0] / law.length
        size, harm = (
            (abs(cohort) / law.length, harm_after[0]) if law.reading == "stretch" else (x, x)
        )
        total += law.initial * pressure(path[0]) * np.sign(cohort) * size**law.order * np.exp(-harm)
    return total / gamma(law.order + 1)


def random_walk(seed, count, size):
    """Knots of a walk from 0 with normal steps."""
    return np.concatenate([[0], np.cumsum(np.random.default_rng(seed).normal(0, size, count))])
