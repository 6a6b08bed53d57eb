"""Compiled runs of one mode with one Coulomb interface, many in one call, each with what its last cycles show: the
arithmetic of `sdof_kernels` and `window_kernels`."""

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from . import window_kernels as plain
from .event_kernels import COMPILED, compiled_copy, enter, march

_SCOPE = compiled_copy(plain, ("fading", "place", "integrals", "integral", "means", "acceleration", "peaks", "refined",
                               "held", "noted", "force_beside", "ranges", "window", "energy", "cycle_parts"),
                       (), COMPILED)
window, energy, cycle_parts = _SCOPE["window"], _SCOPE["energy"], _SCOPE["cycle_parts"]


@njit(error_model="numpy", cache=True, nogil=True, **LEAN)
def runs(table, shape, room, answers, codes):
    """Runs from rest or not under one sine each. table (n, 9): w, decay, static, kinetic, B, om, share, as `rig` of
    `window_kernels`, and z, v at t = 0; shape: (cycles, cycles of the window). room: (phases (r, 10), brackets (TURNS,
    4), numbers (6,), parts (c, 2), state (9,), segments (1, 6)) to work in. answers: (extremes of z per cycle (n, c,
    2), its parts at the drive's frequency in the last cycle of the last windows (n, windows, 2), books (n, 10) of
    `sdof_kernels.march`, numbers (n, NUMBERS) of `window_kernels`, (z, v at the end, largest z'^2 + w^2 z^2) (n, 3)).
    codes (n,): 1 of a run that came to its end, else as of `march`, 0 where the room was too small."""
    cycles, last = shape
    rows, turns, found, parts, state, segments = room
    extremes, phasors, books, numbers, ends = answers
    windows = phasors.shape[1]
    for n in range(table.shape[0]):
        w, decay, static, kinetic, b, om, share, z, v = table[n]
        per = 2 * np.pi / om
        segments[0, 0], segments[0, 1], segments[0, 2] = 0.0, cycles * per, 0.0
        segments[0, 3], segments[0, 4], segments[0, 5] = b, om, 0.0
        extremes[n, :, 0], extremes[n, :, 1], books[n], parts[:] = np.inf, -np.inf, 0.0, 0.0
        enter(state, segments, 0, 0.0, 0.0, z, v, 1.0, static, kinetic, w * w)
        code, used = march((w, decay), (static, kinetic), segments, (per, np.inf, 0.0, 1.0), state, rows, extremes[n],
                           books[n])
        if code == 1:
            rig = (w, decay, static, kinetic, b, om, share)
            ends[n, 0], ends[n, 1] = state[3], state[4]
            ends[n, 2] = energy(rows, used, rig)
            cycle_parts(rows, used, (cycles - 1, last, cycles - 1 - (windows - 1) * last), rig, parts)
            for k in range(windows):
                at = cycles - 1 - k * last
                phasors[n, windows - 1 - k, 0], phasors[n, windows - 1 - k, 1] = parts[at, 0], parts[at, 1]
            if not window(rows, used, cycles * per - last * per, last, rig, (turns, found), numbers[n]):
                code = 0
        codes[n] = code
