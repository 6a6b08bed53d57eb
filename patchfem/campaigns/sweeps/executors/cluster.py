"""Executor of a sweep on the workers of a Dask cluster.

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
    # number of chunks a worker holds besides the present one, so that it never waits for the next
    2
)
CONNECT_TIMEOUT = "10s"  # Longest time to wait for the scheduler.


class Cluster:
    """Executor that computes chunks on the workers of a Dask cluster.

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
            # The cluster has no dashboard and uses a port of this machine.
            scheduler_options = {"dashboard": False, "dashboard_address": "127.0.0.1:0"}
            self.own = distributed.LocalCluster(
                workers or os.cpu_count() or 1,
                threads_per_worker=1,
                processes=True,
                scheduler_kwargs=scheduler_options,
                silence_logs="CRITICAL",
            )
        self.name = f"--executor dask{':' * bool(address)}{address}"
        # The messages of these loggers are reported by this class.
        loggers = (getLogger("tornado"), getLogger("asyncio"))
        for logger in (*getLogger("distributed").handlers, *loggers):
            logger.setLevel(CRITICAL)
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
        versions = self.client.run(environment_versions, on_error="return")
        self.workers = max(len(versions), 1)
        for worker_versions in versions.values():
            if worker_versions != environment_versions():
                self.client.close()
                raise self._worker_error(worker_versions, environment_versions())

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
            (chunk, seconds, answer or Died), as they come in.
        """
        from distributed import as_completed
        from distributed.client import ClosedClientError

        path = work.sweep_scene.path
        versions = environment_versions(work)
        shared_work = replace(
            work, sweep_scene=replace(work.sweep_scene, path=Path(os.path.abspath(path)))
        )
        try:
            # Dask repeats this task if all workers that store its result have died.
            shared = self.client.submit(_identity, shared_work, pure=False)
            ready = as_completed(loop=self.client.loop, with_results=True, raise_errors=False)
            pending = {}
            while True:
                while len(pending) < CHUNKS_PER_WORKER * self.workers:
                    chunk = take(idle=not pending)
                    if chunk is None:
                        break
                    future = self.client.submit(
                        _answer, shared, chunk, (versions, path), pure=False
                    )
                    pending[future] = chunk
                    ready.add(future)
                if not pending:
                    return
                future, answer = next(ready)
                chunk = pending.pop(future)
                if isinstance(answer, dict):
                    raise self._worker_error(answer, versions)
                if future.status != "finished":
                    answer = self._report_death(future)
                yield chunk, *answer
        except ClosedClientError:
            raise self._connection_error() from None
        finally:
            self.client.close()
            if self.own is not None:
                self.own.close()

    def _connection_error(self) -> Missing:
        """Return the error for a lost connection to the scheduler."""
        return Missing(f"{self.name}: the connection to the scheduler is lost")

    def _worker_error(self, on_worker: dict | Exception, here: dict) -> Missing:
        """Return the error for a worker that cannot compute the cases.

        on_worker: versions of the worker, or the exception in place of them; here: those of this
        machine.
        """
        if isinstance(on_worker, Exception):
            reason = f"{type(on_worker).__name__}: {on_worker}"
            return Missing(
                f"{self.name}: patchfem {here['patchfem']} is not installed on a worker ({reason})"
            )
        names = [name for name in here if on_worker[name] != here[name] and name != "files"]
        if names:
            other_versions = ", ".join(f"{name} {on_worker[name]}" for name in names)
            own_versions = ", ".join(f"{name} {here[name]}" for name in names)
            return Missing(
                f"{self.name}: a worker has {other_versions}, but this machine has {own_versions}; install "
                "the same version on all machines"
            )
        return Missing(
            f"{self.name}: the files named in the scene differ between a worker and this machine; put the "
            "files where all machines can read them"
        )

    def _report_death(self, future) -> tuple:
        """Return (0 s, Died) for a chunk whose worker died or failed.

        Missing if the connection to the scheduler is lost.
        """
        if future.status == "cancelled":  # Nothing in this process cancels a chunk.
            raise self._connection_error()
        error = future.exception()
        kind = type(error).__name__
        reason = f"the worker of this case failed ({kind}: {error})"
        return 0.0, Died("its worker died" if kind == "KilledWorker" else reason)


@cache
def _source() -> str:
    """Return a hash of the source files of this package."""
    root = Path(__file__).parents[3]
    paths = root.rglob("*.py")
    texts = [(path.relative_to(root).as_posix(), path.read_bytes()) for path in paths]
    return sha256(repr(sorted(texts)).encode()).hexdigest()[:8]


def environment_versions(work: Work | None = None) -> dict:
    """Return the versions and file hashes that a worker must share with this process.

    The versions are given by name, the hash of the scene with the files that it names as `files`.
    """
    versions = {
        "patchfem": f"{__version__} (sources {_source()})",
        "numpy": np.__version__,
        "python": "{}.{}".format(*sys.version_info),
    }
    if work is not None:
        versions["files"] = work.sweep_scene.digest()
    return versions


def _identity(work: Work) -> Work:
    """Return the work unchanged; calling this function stores the work on the cluster."""
    return work


def _answer(work: Work, chunk: list, origin: tuple) -> tuple | dict:
    """Compute a chunk in a worker; return (CPU time [s], results).

    If the worker has another version or other files, it returns its `environment_versions` instead.

    Parameters
    ----------
    work : Work
    chunk : list
        Numbers of cases.
    origin : tuple
        `environment_versions` of the process that runs the sweep, and the path of the scene there, which messages
        must name.
    """
    versions, path = origin
    worker_versions = environment_versions(work)
    if worker_versions != versions:
        return worker_versions
    seconds, (results, extras) = compute_timed(replace(work, write=None), chunk)
    folder = f"{work.sweep_scene.path.parent}{os.sep}"
    origin_folder = str(path.parent / "_")[:-1]
    for case, text in results.messages.items():
        results.messages[case] = text.replace(folder, origin_folder)
    return seconds, write_or_return(work, chunk, results, extras)
