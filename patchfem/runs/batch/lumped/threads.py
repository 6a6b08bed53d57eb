"""Cases of one compiled call shared over the cores of this machine, where no other process does so already."""

import multiprocessing
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

LEAST = 32  # cases of a thread: fewer are done before it has begun


def in_threads(work: Callable[[slice], None], count: int, least: int = 0) -> None:
    """Call work(part) for parts of range(count), in parallel threads if there are cores."""
    parts = max(1, min(cores(), count // (least or LEAST)))
    ends = [count * k // parts for k in range(parts + 1)]
    pieces = [slice(*pair) for pair in pairwise(ends)]
    work(pieces[0]) if parts == 1 else list(_pool().map(work, pieces))


def cores() -> int:
    """Cores that this process may use for itself: one where it is a worker of others, or where OMP_NUM_THREADS says."""
    if multiprocessing.parent_process() is not None:
        return 1
    mine = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    asked = os.environ.get("OMP_NUM_THREADS", "")
    return min(mine, int(asked)) if asked.isdecimal() and int(asked) > 0 else mine


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(cores(), "lumped")
