"""`joints_stops_kernels` of a loop in which no law is set-valued: nothing to do, and nothing to compile."""

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN


@njit(error_model="numpy", **LEAN)
def watched(dt, s):
    """False: there is nothing to follow."""
    return False


@njit(error_model="numpy", **LEAN)
def met(s):
    """False: there are no forces."""
    return False


@njit(error_model="numpy", **LEAN)
def blows(s):
    """0 J: there are no blows."""
    return 0.0


@njit(error_model="numpy", **LEAN)
def brought(motion, s):
    """Nothing."""


@njit(error_model="numpy", **LEAN)
def struck(motion, mass, s):
    """0 J: there are no blows."""
    return 0.0
