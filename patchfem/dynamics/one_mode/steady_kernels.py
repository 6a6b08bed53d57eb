"""Compiled periodic motion of one mode with one Coulomb interface: the arithmetic of `orbit_kernels`."""

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from . import orbit_kernels as plain
from .event_kernels import COMPILED, compiled_copy

point = compiled_copy(plain, ("impulse", "flow", "newton", "sliding_guess", "settle", "at_phase_0", "report",
                              "recurrence", "point"), (), COMPILED)["point"]


@njit(error_model="numpy", cache=True, **LEAN)
def points(table, patience, out, found, phases):
    """Steady motion of many cases, in one call. table (n, 8): w, decay, static, kinetic, B, om and z, v at phase 0,
    forces over the mass; out (24,) to work in; found (n, 14) and phases (n, 16) as in `point`; phases (1, 16) are
    written over by every case."""
    last = phases.shape[0] - 1
    for n in range(table.shape[0]):
        w, decay, static, kinetic, b, om, z, v = table[n]
        point(w, decay, static, kinetic, b, om, z, v, patience, out, phases[min(n, last)], found[n])
