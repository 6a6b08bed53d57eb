"""Flags of compiled code: fast-math is limited to what keeps NaN and infinity meaningful."""

from ..compiled.jit import NJIT_INTERNAL, NJIT_NO_REFCOUNT

FASTMATH_FLAGS = {"reassoc", "contract", "arcp"}

# Options of a kernel that allocates nothing and divides by zero as NumPy does.
NJIT_KERNEL = {"error_model": "numpy", "fastmath": FASTMATH_FLAGS, **NJIT_NO_REFCOUNT}
# The same for a kernel that is compiled into its callers, so that a loop over lanes can take several lanes at once.
NJIT_INLINE = NJIT_KERNEL | {"forceinline": True}

__all__ = [
    "FASTMATH_FLAGS",
    "NJIT_INLINE",
    "NJIT_INTERNAL",
    "NJIT_KERNEL",
    "NJIT_NO_REFCOUNT",
]
