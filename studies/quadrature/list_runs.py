"""Runs of the sum over bonds along a sine: forces, microseconds per step and the longest list of strips."""

from math import ceil
from time import process_time

import numpy as np

from patchfem.dynamics.march.models import list_model, load_kernels
from patchfem.friction.bonds.list_numbers import cutoff, status_of
from patchfem.friction.bonds.list_rows_kernels import N_ROWS, STATUS
from patchfem.friction.bonds.parameters import Bonds

ROOM = 200_000  # strips of a list that keeps every bond


def bonds(amplitude: float) -> Bonds:
    """The printed law of order 1 with growing bonds whose healing at a reversal is the same at every amplitude."""
    return Bonds(1.0, 1.0, 1.0, "report", 0.5, 0.3 * amplitude, 0.05, 1e-2 * amplitude / 3, 0.0)


def slide(amplitude: float, steps: int) -> tuple:
    """(path, step) until bonds of the first stroke are gone: 20 bond lengths, two cycles at least."""
    cycles = max(2, ceil(20 / (4 * amplitude)))
    return amplitude * np.sin(2 * np.pi * np.arange(cycles * steps + 1) / steps), 2 * np.pi / steps


def along(law, path, dt, tail, merge, repeats=1) -> tuple:
    """(forces at the samples, microseconds per step, longest list) of one engine."""
    model = list_model(law, 1.0, cutoff(law.order, tail) if tail else np.inf, merge)
    if not merge:
        model.fields.update(bondlist=np.zeros((N_ROWS, ROOM)), status=status_of(ROOM))
    loops, best = load_kernels(), np.inf
    for _ in range(repeats):
        contact = model.build()
        energies, forces = np.zeros((path.size, 2)), np.zeros((path.size, 3))
        begin = process_time()
        bad = loops.follow_path(path, dt, model.kind, contact, 1e-11, energies, forces)
        best = min(best, process_time() - begin)
        assert bad == 0
    return forces[:, 0], 1e6 * best / (path.size - 1), int(contact.status[STATUS.max_strips])
