"""Flags of compiled code: only fast-math that keeps NaN and infinity meaningful."""

from numba.core.options import DefaultOptions

# no counting of references in functions that allocate nothing: 1.3 of the 1.6 us of a step of a march
LEAN = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
FAST = {"reassoc", "contract", "arcp"}
