"""Chunks answered by the workers of a Dask cluster: one of this machine, or any whose scheduler has an address."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from time import perf_counter

from ....core import Missing
from ..sweep import Died, Work, answer

AHEAD = 2  # chunks on their way per worker, so that none waits for the next
PATIENCE = "10s"  # for a scheduler to answer


class Cluster:
    """The executor of a Dask cluster; address: of its scheduler, "" to start one of `workers` processes here."""

    def __init__(self, address: str = "", workers: int = 0):
        try:
            import distributed
        except ImportError:
            raise Missing('--executor dask: the package dask.distributed is not installed; pip install '
                          '"patchfem[cluster]", or take -j N') from None
        self.own = None
        if not address:
            import dask

            # tries are counted by the sweep; a profile of the workers, which nobody sees, is a third of a chunk's way
            dask.config.set({"distributed.scheduler.allowed-failures": 0, "distributed.worker.profile.enabled": False,
                             "distributed.nanny.pre-spawn-environ.PYTHONSAFEPATH": 1})
            self.own = distributed.LocalCluster(workers or os.cpu_count() or 1, threads_per_worker=1, processes=True,
                                                dashboard_address=None, silence_logs="CRITICAL")
        try:
            self.client = distributed.Client(self.own or address, timeout=PATIENCE, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise Missing(f"--executor dask:{address}: no scheduler answers there ({error})") from None
        self.workers = max(len(self.client.scheduler_info(n_workers=-1)["workers"]), 1)

    def run(self, work: Work, take: Callable, say: Callable | None = None) -> Iterator[tuple]:
        """(chunk, seconds, answer or Died) of each chunk that `take` hands out, as they come in."""
        from distributed import as_completed

        try:
            shared = self.client.submit(_as_it_is, work, pure=False)  # made again where all that hold it have died
            ready, on_the_way = as_completed(loop=self.client.loop, with_results=True, raise_errors=False), {}
            while True:
                while len(on_the_way) < AHEAD * self.workers and (chunk := take(not on_the_way)) is not None:
                    future = self.client.submit(_answer, shared, chunk, os.getcwd(), pure=False)
                    on_the_way[future] = chunk
                    ready.add(future)
                if not on_the_way:
                    return
                future, found = next(ready)
                chunk = on_the_way.pop(future)
                yield chunk, *(found if future.status == "finished" else _died(future))
        finally:
            self.client.close()
            if self.own is not None:
                self.own.close()


def _as_it_is(work: Work) -> Work:
    return work


def _answer(work: Work, chunk: list, folder: str) -> tuple:
    """(seconds, answer) of a chunk, in a worker; folder: which the paths of the scene are relative to."""
    if os.path.isdir(folder):
        os.chdir(folder)
    begin = perf_counter()
    found = answer(work, chunk)
    return perf_counter() - begin, found


def _died(future) -> tuple:
    error = future.exception()
    killed = type(error).__name__ == "KilledWorker"
    return 0.0, Died("its worker died" if killed else f"its worker failed ({type(error).__name__}: {error})")
