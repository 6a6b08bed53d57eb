"""Cases of one compiled call, divided among the cores of this machine.

In: a function of a part of the cases. Out: nothing; the function writes its results. Threads
are not used if another process already uses the cores.
"""

import multiprocessing
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

# Smallest number of cases of a thread: fewer end before the thread has started.
MIN_CASES_PER_THREAD = 32


def run_in_threads(work: Callable[[slice], None], count: int, least: int = 0) -> None:
    """Apply a function to slices of the cases, in parallel threads if processor cores are idle.

    Parameters
    ----------
    work : callable
        Function of a slice; it must release the interpreter lock to run in parallel.
    count : int
        Number of cases.
    least : int
        Smallest number of cases of a thread; 0 for MIN_CASES_PER_THREAD.
    """
    parts = max(1, min(count_cores(), count // (least or MIN_CASES_PER_THREAD)))
    ends = [count * k // parts for k in range(parts + 1)]
    pieces = [slice(*pair) for pair in pairwise(ends)]
    work(pieces[0]) if parts == 1 else list(_get_thread_pool().map(work, pieces))


def count_cores() -> int:
    """Return the number of processor cores that this process may use.

    The number is 1 in a worker of another process, and at most OMP_NUM_THREADS.
    """
    if multiprocessing.parent_process() is not None:
        return 1
    mine = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    asked = os.environ.get("OMP_NUM_THREADS", "")
    return min(mine, int(asked)) if asked.isdecimal() and int(asked) > 0 else mine


@cache
def _get_thread_pool() -> ThreadPoolExecutor:
    """Return the thread pool of the batches, which is created on the first call."""
    return ThreadPoolExecutor(count_cores(), "lumped")
