"""Flags of compiled code: fast-math is limited to options under which NaN and infinity keep their meaning."""

from .jit import NJIT_NO_REFCOUNT

FASTMATH_FLAGS = {"reassoc", "contract", "arcp"}

# Compiler options of a kernel that allocates nothing and divides by zero as NumPy does
NJIT_KERNEL = {"error_model": "numpy", "fastmath": FASTMATH_FLAGS, **NJIT_NO_REFCOUNT}
# The same options for a kernel that stays a call in callers that are inlined themselves
NJIT_CALL = NJIT_KERNEL | {"forceinline": False}
