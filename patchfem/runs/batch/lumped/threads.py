"""Parallel threads for the cases of a batch.

In: a function of a slice of the cases, which stores its own results. Threads are not used in a
worker process, where the cores are already in use.
"""

import multiprocessing
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

# Smallest number of cases per thread; for fewer cases, starting a thread takes longer than the work.
MIN_CASES_PER_THREAD = 32


def apply_in_threads(function: Callable[[slice], None], count: int, min_cases: int = 0) -> None:
    """Apply a function to slices of the cases, in parallel threads if cores are available.

    Parameters
    ----------
    function : callable
        Function of a slice of the cases; it must release the interpreter lock to run in parallel.
    count : int
        Number of cases.
    min_cases : int
        Smallest number of cases per thread; 0 for MIN_CASES_PER_THREAD.
    """
    n_threads = max(1, min(count_cores(), count // (min_cases or MIN_CASES_PER_THREAD)))
    ends = [count * k // n_threads for k in range(n_threads + 1)]
    slices = [slice(*pair) for pair in pairwise(ends)]
    function(slices[0]) if n_threads == 1 else list(_get_thread_pool().map(function, slices))


def count_cores() -> int:
    """Return the number of processor cores that this process may use.

    The number is 1 in a worker process, and at most OMP_NUM_THREADS.
    """
    if multiprocessing.parent_process() is not None:
        return 1
    n_cores = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    limit = os.environ.get("OMP_NUM_THREADS", "")
    return min(n_cores, int(limit)) if limit.isdecimal() and int(limit) > 0 else n_cores


@cache
def _get_thread_pool() -> ThreadPoolExecutor:
    """Return the thread pool of the batches, which is created lazily."""
    return ThreadPoolExecutor(count_cores(), "lumped")
