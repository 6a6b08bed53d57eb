"""The loop of lanes on a graphics processor: the same text, told to numba's CUDA compiler, a case in each thread.

Numba's simulator runs it as Python (NUMBA_ENABLE_CUDASIM=1). Twin: the loop of the processor.
"""

from functools import cache
from types import SimpleNamespace

import numpy as np
from numba import cuda

from ...compiled.plain import PACKAGE, retold
from . import names_kernels as at

BLOCK = 128  # threads of a block


def device(function=None, **_):
    """In place of `inner.njit`: a function of the device, which others call."""
    return cuda.jit(device=True)(function) if function is not None else device


@cache
def kernels(law: str) -> SimpleNamespace:
    """`march` and `read` of the loop of a law, with the arguments of `loop_kernels`."""
    home, known = __name__.rpartition(".")[0], {}
    inner = SimpleNamespace(njit=device, LEAN={}, INNER={})
    names = retold(f"{home}.names_kernels", inner, known)
    names.LANES, names.GROUP = 1, 0
    loop = retold(f"{home}.loop_kernels", inner, known)
    if "." in law:  # of a stretch
        loop.law = retold(f"{home}.flowing_kernels", inner, known)
        loop.law.friction = retold(f"{PACKAGE}.{law}", inner, known)
    else:
        loop.law = retold(f"{home}.{law}_kernels", inner, known)
    one_march, one_read = loop.march, loop.read

    @cuda.jit
    def march(cases, order, motion, table, until, history, ended, room, marked):
        i = cuda.grid(1)
        if i < order.size:
            one_march(cases, order[i:i + 1], motion, table, until, history, ended, room[i], marked[i])

    @cuda.jit
    def read(cases, order, motion, table, cycles, history, ended, shown, felt, room, marked):
        i = cuda.grid(1)
        if i < order.size:
            one_read(cases, order[i:i + 1], motion, table, cycles, history, ended, shown, felt, room[i], marked[i])

    def marched(cases, order, motion, table, until, history, ended, room, _):
        _run(march, (cases, order), (motion, table), until, (history, ended), _rooms(order, room))

    def seen(cases, order, motion, table, cycles, history, ended, shown, felt, room, _):
        _run(read, (cases, order), (motion, table), cycles, (history, ended, shown, felt), _rooms(order, room))

    return SimpleNamespace(march=marched, read=seen)


def _rooms(order, room) -> tuple:
    """A room of one lane for each case, as long as a lane of `room`, and one for its mark."""
    return np.zeros((order.size, room.size // at.LANES)), np.zeros((order.size, 2), np.int64)


def _run(kernel, given: tuple, moving: tuple, count: int, found: tuple, rooms: tuple) -> None:
    """Run a kernel over all cases; what it writes comes back into the arrays of the caller."""
    cases, order = given
    kernel[-(-order.size // BLOCK), min(BLOCK, order.size)](cases, order, *moving, count, *found, *rooms)
