"""Compiled events of one mode with one Coulomb interface: the arithmetic of `slip_kernels`, `sdof_kernels` and
`keep_kernels`, and runs in batches."""

from types import FunctionType

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from . import keep_kernels, sdof_kernels, slip_kernels

SLIP = ("size_of", "oscillator", "series", "step_answer", "moved", "motion", "first_leap", "_free", "leap", "bend",
        "over_parts", "forced_part", "clear", "stop")
INNER = ("need_slopes", "release", "crossing", "_turn", "closed_books", "add", "book_slip", "note", "note_stick",
         "note_slip", "_keep", "begin")


def compiled_copy(module, inner, outer, known=None):
    """Names of a module with its functions `inner` and `outer` compiled in that order, which call each other and those
    that are `known` by name; the module stays as it is."""
    scope = dict(vars(module)) | (known or {})
    for name in (*inner, *outer):
        source = vars(module)[name]
        copy = FunctionType(source.__code__, scope, name, source.__defaults__)
        copy.__module__ = module.__name__
        options = {"cache": True, **LEAN} if name in outer else LEAN
        scope[name] = njit(error_model="numpy", **options)(copy)
    return scope


_SLIP = compiled_copy(slip_kernels, SLIP, ())
_EVENTS = compiled_copy(sdof_kernels, INNER, ("enter", "march"), {name: _SLIP[name] for name in SLIP})
_KEEP = compiled_copy(keep_kernels, ("by_parts", "wave", "by_points", "add_phasors", "listed_event"), ("keep",),
                      {name: _SLIP[name] for name in SLIP})
COMPILED = {name: _SLIP[name] for name in SLIP} | {name: _EVENTS[name] for name in INNER} | \
    {"add_phasors": _KEEP["add_phasors"]}
march, enter, keep = _EVENTS["march"], _EVENTS["enter"], _KEEP["keep"]


@njit(error_model="numpy", cache=True, **LEAN)
def batch(table, cycles, last, room, amplitude, books, ends):
    """Runs under one sine each, from rest or not. table (n, 9): w, decay, static, kinetic (over the mass), B, om, push,
    and z, v at t = 0. room: (rows (0, 10), state (9,), segments (1, 6), extremes (cycles, 2)) to work in. amplitude
    (n, 2): least and largest z of the `last` cycles; books (n, 10) as in `march`; ends (n, 2): z and v at the end.
    Returns the worst code of `march`."""
    worst, (none, state, segments, extremes) = 1, room
    for n in range(table.shape[0]):
        w, decay, static, kinetic, b, om, push, z, v = table[n]
        per = 2 * np.pi / om
        segments[0, 0], segments[0, 1], segments[0, 2] = 0.0, cycles * per, push
        segments[0, 3], segments[0, 4], segments[0, 5] = b, om, 0.0
        extremes[:, 0], extremes[:, 1] = np.inf, -np.inf
        books[n] = 0.0
        enter(state, segments, 0, 0.0, 0.0, z, v, 1.0, static, kinetic, w * w)
        code, _ = march((w, decay), (static, kinetic), segments, (per, np.inf, 1.0, 1.0), state, none, extremes,
                        books[n])
        amplitude[n, 0], amplitude[n, 1] = np.inf, -np.inf
        for k in range(extremes.shape[0] - last, extremes.shape[0]):
            amplitude[n, 0] = min(amplitude[n, 0], extremes[k, 0])
            amplitude[n, 1] = max(amplitude[n, 1], extremes[k, 1])
        ends[n, 0], ends[n, 1] = state[3], state[4]
        worst = max(worst, code)
    return worst
