"""Flags of compiled code: fast-math is limited to what keeps NaN and infinity meaningful."""

from ..compiled.jit import NJIT_INTERNAL, NJIT_NO_REFCOUNT

FASTMATH_FLAGS = {"reassoc", "contract", "arcp"}

__all__ = ["FASTMATH_FLAGS", "NJIT_INTERNAL", "NJIT_NO_REFCOUNT"]
