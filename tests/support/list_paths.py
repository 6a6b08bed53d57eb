"""The compiled list of bonds along a path, and the energies of 2.17 in closed form, for tests of the engines."""

from typing import NamedTuple

import numpy as np

from patchfem.friction import (
    N_ROWS,
    STATUS,
    gamma_table,
    growth_numbers,
    law_numbers,
    make_path_state,
    make_status,
)
from patchfem.friction.bonds import list_kernels, list_step_kernels
from patchfem.friction.bonds.list_numbers import cutoff_age
from patchfem.friction.bonds.list_rows_kernels import STRIP, BondList

for kernel in (
    list_kernels.list_mean,
    list_kernels.sum_list,
    list_kernels.total,
    list_step_kernels.list_step,
):
    if hasattr(kernel, "enable_caching"):  # Without compilation there is no cache to enable.
        # Only tests call these kernels from Python, so only here is their compiled code cached.
        kernel.enable_caching()


class ListHistory(NamedTuple):
    """Step means, forces after the steps, forces predicted for their ends, energies after them, and the status array."""

    mean: np.ndarray
    after: np.ndarray
    ahead: np.ndarray
    stored: np.ndarray
    status: np.ndarray


def make_empty_list(law, tail=0.0, merge=0.0, capacity=60_000):
    """Return a list of bonds before any displacement, as the functions of `list_kernels` take it."""
    numbers = law_numbers(law, cutoff_age(law.order, tail) if tail else np.inf, merge)
    path_state = make_path_state(law)
    return BondList(
        np.zeros((N_ROWS, capacity)),
        path_state,
        make_status(capacity),
        numbers,
        gamma_table(law),
        growth_numbers(law),
    )


def march_list(law, path, times=1.0, merge=0.0, tail=0.0, capacity=60_000):
    """March the list along the knots `path`; times: scalar or one per step."""
    bond_list = make_empty_list(law, tail, merge, capacity)
    rows = []
    status = bond_list.status
    for dq, dt in zip(np.diff(path), np.broadcast_to(np.asarray(times, float), len(path) - 1)):
        v = dq / dt if dt > 0 else 0.0
        mean = list_kernels.list_mean(dq, bond_list, v, dt)
        list_kernels.sum_list(1.0, dq, bond_list, v, dt)
        ahead = list_kernels.total(STRIP.force, bond_list)
        assert list_step_kernels.list_step(dq, bond_list, v, v, dt)
        rows.append((mean, status[STATUS.force], ahead, status[STATUS.energy]))
    return ListHistory(*np.array(rows).T, status)
