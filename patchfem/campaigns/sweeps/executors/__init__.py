"""Ways to work on the chunks of a sweep: in this process, in others beside it, on a Dask cluster.

Each has `workers` and `run(work, take, say)`, which gives (chunk, seconds, answer or Died) of every chunk that `take`
hands out. `of` finds one by its name; read `LocalExecutor` first.
"""

from collections.abc import Callable, Iterator

from ....core import PatchfemError
from ..sweep import Work, timed
from . import cluster, pool


class LocalExecutor:
    """The executor of this process: chunks one after the other."""

    workers = 1

    def run(self, work: Work, take: Callable, say: Callable | None = None) -> Iterator[tuple]:
        """(chunk, seconds, what `answer` gives) of each chunk that `take` hands out."""
        while (chunk := take()) is not None:
            yield chunk, *timed(work, chunk, say)


def of(name: str = "", jobs: int = 1):
    """The executor of a name: "" for `jobs` processes of this machine, this one alone where it is 1; "dask" for a Dask
    cluster of `jobs` processes here (one per core where it is 1), "dask:ADDRESS" for that of a scheduler.

    PatchfemError for another name or less than one process, Missing where Dask is not there.
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
