"""Executors that compute the chunks of a sweep: in this process, in several, or with Dask.

Each has `workers` and `run(work, take, say)`, which yields (chunk, seconds, answer or Died) of
every chunk that `take` returns; the answer is the result of `sweep.compute_chunk`. `make_executor`
returns an executor by its name.

Read `LocalExecutor` first.
"""

from collections.abc import Callable, Iterator

from ....core import PatchfemError
from ..sweep import Work, compute_timed
from . import cluster, pool


class LocalExecutor:
    """Executor that computes chunks one after the other in this process."""

    workers = 1

    def run(self, work: Work, take: Callable, say: Callable | None = None) -> Iterator[tuple]:
        """Compute the chunks of cases that the callback `take` supplies.

        Parameters
        ----------
        work : Work
        take : callable
            Returns the next chunk, or None.
        say : callable, optional
            Takes a line of text.

        Yields
        ------
        tuple
            Chunk, seconds, and the result of `compute_chunk`.
        """
        while (chunk := take()) is not None:
            yield chunk, *compute_timed(work, chunk, say)


def make_executor(name: str = "", jobs: int = 1):
    """Return the executor with a given name.

    Parameters
    ----------
    name : str
        "" for processes of this machine, "dask" for a Dask cluster that is started here,
        "dask:ADDRESS" for that of a scheduler.
    jobs : int
        Number of processes. For "", 1 means this process alone; for "dask", 1 means one process per
        core.

    Raises
    ------
    PatchfemError
        For another name, or less than one process.
    Missing
        If Dask is not installed or does not answer.
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
