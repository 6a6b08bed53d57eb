"""Executor for Dask: the workers of a cluster compute the chunks.

The cluster is a local one, or that of a scheduler with an address.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from hashlib import sha256
from logging import CRITICAL, getLogger
from pathlib import Path

import numpy as np

from .... import __version__
from ....core import Missing, PatchfemError
from ..sweep import Died, Work, compute_timed, write_or_return

_TLS = "DASK_DISTRIBUTED__COMM__TLS__"
CERTIFICATES = f"{_TLS}CA_FILE, {_TLS}CLIENT__CERT and {_TLS}CLIENT__KEY"
CHUNKS_PER_WORKER = (
    2  # chunks that each worker holds beyond the present one, so it never waits for the next
)
CONNECT_TIMEOUT = "10s"  # maximum time to wait for the scheduler


class Cluster:
    """Executor of a Dask cluster.

    Parameters
    ----------
    address : str
        Address of the scheduler; "" to start a cluster on this machine.
    workers : int
        Number of processes of such a cluster; 0 for one per core.

    Raises
    ------
    Missing
        If Dask is not installed, no scheduler answers, or a worker has another version.
    PatchfemError
        If TLS has no certificates.
    """

    def __init__(self, address: str = "", workers: int = 0):
        try:
            import distributed
        except ImportError:
            raise Missing(
                "--executor dask: the package dask.distributed is not installed; pip install "
                '"patchfem[cluster]", or use -j N'
            ) from None
        self.own = None
        if not address:
            import dask

            # The sweep counts repeated attempts itself. The profile of a worker, which nobody
            # reads, would take a third of the time in which a chunk is sent and received.
            dask.config.set(
                {
                    "distributed.scheduler.allowed-failures": 0,
                    "distributed.worker.profile.enabled": False,
                    "distributed.scheduler.http.routes": [],
                    "distributed.worker.http.routes": [],
                    "distributed.nanny.pre-spawn-environ.PYTHONSAFEPATH": 1,
                }
            )
            # no dashboard, on a port of this machine
            quiet = {
                "dashboard": False,
                "dashboard_address": "127.0.0.1:0",
            }
            self.own = distributed.LocalCluster(
                workers or os.cpu_count() or 1,
                threads_per_worker=1,
                processes=True,
                scheduler_kwargs=quiet,
                silence_logs="CRITICAL",
            )
        self.name = f"--executor dask{':' * bool(address)}{address}"
        for one in (*getLogger("distributed").handlers, getLogger("tornado"), getLogger("asyncio")):
            one.setLevel(CRITICAL)  # their messages are reported by this class
        tls = distributed.Security().get_connection_args("client")["ssl_context"] is not None
        if address.startswith("tls:") and not tls:
            raise PatchfemError(
                f"{self.name}: TLS needs certificates; give the paths of their files in the "
                f"environment variables {CERTIFICATES}"
            )
        try:
            self.client = distributed.Client(
                self.own or address, timeout=CONNECT_TIMEOUT, set_as_default=False
            )
        except (OSError, TimeoutError, ValueError) as error:
            raise Missing(f"{self.name}: no scheduler answers at this address ({error})") from None
        found = self.client.run(environment_versions, on_error="return")
        self.workers = max(len(found), 1)
        for own in found.values():
            if own != environment_versions():
                self.client.close()
                raise self._worker_error(own, environment_versions())

    def run(self, work: Work, take: Callable, say: Callable | None = None) -> Iterator[tuple]:
        """Yield (chunk, seconds, answer or Died) of each chunk that `take` returns, as they come in."""
        from distributed import as_completed
        from distributed.client import ClosedClientError

        path = work.asked.path
        want = environment_versions(work)
        there = replace(work, asked=replace(work.asked, path=Path(os.path.abspath(path))))
        try:
            # Dask repeats this task if all workers that store its result have died.
            shared = self.client.submit(_identity, there, pure=False)
            ready = as_completed(loop=self.client.loop, with_results=True, raise_errors=False)
            on_the_way = {}
            while True:
                while (
                    len(on_the_way) < CHUNKS_PER_WORKER * self.workers
                    and (chunk := take(not on_the_way)) is not None
                ):
                    future = self.client.submit(_answer, shared, chunk, (want, path), pure=False)
                    on_the_way[future] = chunk
                    ready.add(future)
                if not on_the_way:
                    return
                future, found = next(ready)
                chunk = on_the_way.pop(future)
                if isinstance(found, dict):
                    raise self._worker_error(found, want)
                yield chunk, *(found if future.status == "finished" else self._report_death(future))
        except ClosedClientError:
            raise self._connection_error() from None
        finally:
            self.client.close()
            if self.own is not None:
                self.own.close()

    def _connection_error(self) -> Missing:
        """Return the error of a lost connection."""
        return Missing(f"{self.name}: the connection to the scheduler is lost")

    def _worker_error(self, found: dict | Exception, want: dict) -> Missing:
        """Return the error of a worker that cannot compute the work.

        found: versions of the worker, or the exception in place of them; want: those of this
        machine.
        """
        if isinstance(found, Exception):
            said = f"{type(found).__name__}: {found}"
            return Missing(
                f"{self.name}: patchfem {want['patchfem']} is not installed on a worker ({said})"
            )
        names = [name for name in want if found[name] != want[name] and name != "files"]
        there, here = (", ".join(f"{name} {one[name]}" for name in names) for one in (found, want))
        if names:
            return Missing(
                f"{self.name}: a worker has {there}, but this machine has {here}; install the same version "
                "on all machines"
            )
        return Missing(
            f"{self.name}: the files named in the scene differ between a worker and this machine; put the "
            "files where all machines can read them"
        )

    def _report_death(self, future) -> tuple:
        """Return (0 s, Died) for a chunk whose worker died or failed.

        Missing if the connection to the scheduler is lost.
        """
        if future.status == "cancelled":  # nothing in this process cancels a chunk
            raise self._connection_error()
        error = future.exception()
        killed = type(error).__name__ == "KilledWorker"
        return 0.0, Died(
            "its worker died"
            if killed
            else f"the worker of this case failed ({type(error).__name__}: {error})"
        )


@cache
def _source() -> str:
    """Return a hash of the sources of this package."""
    root = Path(__file__).parents[3]
    texts = sorted(
        (path.relative_to(root).as_posix(), path.read_bytes()) for path in root.rglob("*.py")
    )
    return sha256(repr(texts).encode()).hexdigest()[:8]


def environment_versions(work: Work | None = None) -> dict:
    """Return what a worker must have in common with the process that sends it work.

    These are versions by name and, as `files`, the hash of the scene with the files that it names.
    """
    own = {
        "patchfem": f"{__version__} (sources {_source()})",
        "numpy": np.__version__,
        "python": "{}.{}".format(*sys.version_info),
    }
    return own if work is None else own | {"files": work.asked.digest()}


def _identity(work: Work) -> Work:
    """Return the work unchanged; a call of this function stores the work on the cluster."""
    return work


def _answer(work: Work, chunk: list, asked: tuple) -> tuple | dict:
    """Compute a chunk in a worker; return (seconds, answer).

    If the worker has another version or other files, return what it has (`environment_versions`) instead.

    Parameters
    ----------
    work : Work
    chunk : list
        Numbers of cases.
    asked : tuple
        `environment_versions` of the process that runs the sweep, and the path of the scene there, which messages
        must name.
    """
    want, path = asked
    if (own := environment_versions(work)) != want:
        return own
    seconds, (found, told) = compute_timed(replace(work, write=None), chunk)
    folder = f"{work.asked.path.parent}{os.sep}"
    named = str(path.parent / "_")[:-1]
    found.messages.update(
        {case: text.replace(folder, named) for case, text in found.messages.items()}
    )
    return seconds, write_or_return(work, chunk, found, told)
