"""The compiled list of bonds along a path, and energies of 2.17 written out by hand, for the tests of the engines."""

from typing import NamedTuple

import numpy as np
from friction_paths import GAUSS, lengths_by_hand, rates
from scipy.special import gamma

from patchfem.dynamics.interfaces.arrays import BondList
from patchfem.friction.bonds import list_kernels
from patchfem.friction.bonds.list_numbers import gamma_table, law_numbers, make_clocks, make_status
from patchfem.friction.bonds.list_rows_kernels import N_ROWS, STATUS
from patchfem.friction.bonds.quadrature import cutoff_age
from patchfem.friction.laws.stretch import growth_numbers

for kernel in (list_kernels.list_mean, list_kernels.list_force, list_kernels.list_step):
    if hasattr(kernel, "enable_caching"):  # not where numba is told to compile nothing
        kernel.enable_caching()  # called from Python here alone: compiled once for all workers and runs


class Listed(NamedTuple):
    """Step means, forces after the steps, forces foreseen for their ends, energies after them, and the tally."""

    mean: np.ndarray
    after: np.ndarray
    ahead: np.ndarray
    stored: np.ndarray
    status: np.ndarray


def empty_list(law, tail=0.0, merge=0.0, capacity=60_000):
    """A list before any slide, as the functions of `list_kernels` take it."""
    numbers = law_numbers(law, cutoff_age(law.order, tail) if tail else np.inf, merge)
    now = make_clocks(law)
    return BondList(
        np.ones(1),
        np.zeros((N_ROWS, capacity)),
        now,
        make_status(capacity),
        numbers,
        gamma_table(law),
        growth_numbers(law),
        np.zeros(2),
        np.ones(1),
    )


def follow_list(law, path, times=1.0, merge=0.0, tail=0.0, capacity=60_000):
    """March the list over the knots `path`, times scalar or one per step."""
    held = empty_list(law, tail, merge, capacity)
    rows = []
    status = held.status
    for dq, dt in zip(np.diff(path), np.broadcast_to(np.asarray(times, float), len(path) - 1)):
        v = dq / dt if dt > 0 else 0.0
        mean = list_kernels.list_mean(dq, held, v, dt)
        ahead = list_kernels.list_force(dq, held, v, dt)
        assert list_kernels.list_step(dq, held, v, v, dt)
        rows.append((mean, status[STATUS.force], ahead, status[STATUS.energy]))
    return Listed(*np.array(rows).T, status)


def energy_by_hand(law, path, dt=1.0):
    """Sum over the bonds of force times stretch at frozen damage [m] per mu_s N at the end of `path`.

    stretch: (|u|/eps)^p exp(-damage) |u|/(p + 1); report: (R/eps)^p exp(-R/eps) |u|, both over Gamma(p + 1) eps_0.
    """
    steps = np.diff(path)
    times = np.broadcast_to(dt, len(steps)).astype(float)
    _, middles = lengths_by_hand(law, path, times)
    y, w = GAUSS
    total = 0.0
    harm_after = np.append(np.cumsum((np.abs(steps) / middles)[::-1])[::-1], 0.0)
    travel_after = np.append(np.cumsum(np.abs(steps)[::-1])[::-1], 0.0)
    for k, dq in enumerate(steps):
        cuts = {0.0, 1.0, *np.linspace(0, 1, int(np.ceil(abs(dq) / 0.25)) + 1)}
        turn = (path[-1] - path[k]) / dq
        cuts = np.array(sorted(cuts | ({turn} if 0 < turn < 1 else set())))
        part = (cuts[:-1, None] + np.diff(cuts)[:, None] * (1 + y) / 2).ravel()
        weight = (np.diff(cuts)[:, None] * w / 2).ravel() * abs(dq) / law.length
        u = np.abs(path[-1] - (path[k] + part * dq))
        travel = travel_after[k + 1] + (1 - part) * abs(dq)
        if law.reading == "stretch":
            harm = harm_after[k + 1] + (1 - part) * abs(dq) / middles[k]
            f = (u / middles[k]) ** law.order * np.exp(-harm) / (law.order + 1)
        else:
            own = np.full(part.size, law.length)
            if law.has_growth:
                own = np.zeros(part.size)
                for j in range(k, len(steps)):
                    span = times[j] * (1 - part if j == k else 1.0)
                    a, b = rates(law, steps[j] / times[j])
                    goal = law.length * (a + law.ratio * b) / (a + b)
                    own = goal + (own - goal) * np.exp(-(a + b) * span)
            f = (travel / own) ** law.order * np.exp(-travel / own)
        total += weight @ (f * u)
    return total / gamma(law.order + 1)
