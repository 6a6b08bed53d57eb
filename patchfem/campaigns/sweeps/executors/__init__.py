"""Executors that compute the chunks of a sweep: in this process, in several, or with Dask.

Each executor has the attribute `workers` and the method `run(work, next_chunk, say)`. The method yields
(chunk, seconds, answer) for every chunk that `next_chunk` returns, where the answer is the result of
`sweep.compute_chunk` or a WorkerDeath. `make_executor` returns an executor by its name.

Read `LocalExecutor` first, then `pool.FutureExecutor`.
"""

from collections.abc import Callable, Iterator

from ....core import PatchfemError
from ..sweep import WorkerData, compute_chunk
from . import cluster, pool


class LocalExecutor:
    """Executor that computes the chunks of a sweep sequentially in this process."""

    workers = 1

    def run(
        self,
        work: WorkerData,
        next_chunk: Callable[..., list[int] | None],
        say: Callable | None = None,
    ) -> Iterator[tuple]:
        """Compute the chunks that the callback `next_chunk` returns, and yield their results.

        Parameters
        ----------
        work : WorkerData
            What a worker needs to compute any case.
        next_chunk : callable
            Returns the case numbers of the next chunk, or None if none is left.
        say : callable, optional
            Called with a line of text.

        Yields
        ------
        tuple
            Chunk, seconds, and the result of `compute_chunk`.
        """
        while (chunk := next_chunk()) is not None:
            yield chunk, *compute_chunk(work, chunk, say)


def make_executor(name: str = "", jobs: int = 1):
    """Return the executor with a given name.

    Parameters
    ----------
    name : str
        "" for processes on this machine, "dask" for a new Dask cluster on this machine,
        "dask:ADDRESS" for the cluster of an existing scheduler.
    jobs : int
        Number of processes. For "", 1 means this process alone; for "dask", 1 means one process per
        core.

    Raises
    ------
    PatchfemError
        For an unknown name, or less than one process.
    Missing
        If Dask is not installed or its scheduler does not answer.
    """
    if jobs < 1:
        raise PatchfemError(f"-j {jobs}: the number of processes must be at least 1")
    kind, _, address = name.partition(":")
    if kind == "dask":
        return cluster.Cluster(address, jobs if jobs > 1 else 0)
    if name:
        raise PatchfemError(
            f"--executor {name}: not possible; use --executor dask, --executor dask:ADDRESS, or -j N "
            "without --executor"
        )
    if jobs == 1:
        return LocalExecutor()
    return pool.Pool(jobs)
