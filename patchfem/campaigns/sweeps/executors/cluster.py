"""Executor that computes the cases of a sweep on the workers of a Dask cluster.

The cluster is started on this machine, or belongs to a scheduler at a given address.
"""

import os
import sys
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from hashlib import sha256
from logging import CRITICAL, getLogger
from pathlib import Path

import numpy as np

from .... import __version__
from ....core import Missing, PatchfemError
from ..sweep import WorkerData, compute_chunk
from .pool import FutureExecutor

_TLS = "DASK_DISTRIBUTED__COMM__TLS__"
CERTIFICATES = f"{_TLS}CA_FILE, {_TLS}CLIENT__CERT and {_TLS}CLIENT__KEY"
CONNECT_TIMEOUT = "10s"  # Longest time to wait for a connection to the scheduler.


class Cluster(FutureExecutor):
    """Executor that computes the chunks of a sweep on the workers of a Dask cluster.

    Parameters
    ----------
    address : str
        Address of the scheduler; "" to start a cluster on this machine.
    workers : int
        Number of processes of a new cluster; 0 for one per core.

    Raises
    ------
    Missing
        If Dask is not installed, no scheduler answers, or a worker has another version.
    PatchfemError
        If the certificates for TLS are missing.
    """

    chunks_per_worker = (
        2  # A worker has its next chunk before it returns the results of the last one.
    )

    def __init__(self, address: str = "", workers: int = 0):
        try:
            import distributed
        except ImportError:
            raise Missing(
                "--executor dask: the package dask.distributed is not installed; pip install "
                '"patchfem[cluster]", or use -j N'
            ) from None
        self.local_cluster = None
        if not address:
            import dask

            # Dask must not repeat failed tasks, because `ChunkQueue` does this. The profiler of the
            # workers is disabled because it takes a third of the transfer time of a chunk.
            dask.config.set(
                {
                    "distributed.scheduler.allowed-failures": 0,
                    "distributed.worker.profile.enabled": False,
                    "distributed.scheduler.http.routes": [],
                    "distributed.worker.http.routes": [],
                    "distributed.nanny.pre-spawn-environ.PYTHONSAFEPATH": 1,
                }
            )
            # The cluster has no dashboard and listens only on a port of this machine.
            scheduler_options = {"dashboard": False, "dashboard_address": "127.0.0.1:0"}
            self.local_cluster = distributed.LocalCluster(
                workers or os.cpu_count() or 1,
                threads_per_worker=1,
                processes=True,
                scheduler_kwargs=scheduler_options,
                silence_logs="CRITICAL",
            )
        self.name = f"--executor dask{':' * bool(address)}{address}"
        # This class reports the errors that these loggers would print.
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
                self.local_cluster or address, timeout=CONNECT_TIMEOUT, set_as_default=False
            )
        except (OSError, TimeoutError, ValueError) as error:
            raise Missing(f"{self.name}: no scheduler answers at this address ({error})") from None
        versions = self.client.run(environment_versions, on_error="return")
        self.workers = max(len(versions), 1)
        for worker_versions in versions.values():
            if worker_versions != environment_versions():
                self.client.close()
                raise self._worker_error(worker_versions, environment_versions())

    def begin(self, work: WorkerData, *, is_silent: bool) -> None:
        """Store the data of the sweep on the cluster; raise Missing if the connection to the scheduler is lost."""
        path = work.sweep_scene.path
        self.origin = (environment_versions(work), path)
        scene = replace(work.sweep_scene, path=Path(os.path.abspath(path)))
        # Dask repeats this task if the workers that store its result die.
        with self._report_lost_connection():
            self.shared = self.client.submit(
                _identity, replace(work, sweep_scene=scene), pure=False
            )
            self.executor = self.client.get_executor(pure=False)

    def submit(self, chunk: list) -> Future:
        """Submit a chunk; raise Missing if the connection to the scheduler is lost."""
        with self._report_lost_connection():
            return self.executor.submit(_compute_on_worker, self.shared, chunk, self.origin)

    @contextmanager
    def _report_lost_connection(self) -> Iterator[None]:
        """Raise Missing in place of the error of a client whose connection is closed."""
        from distributed.client import ClosedClientError

        try:
            yield
        except ClosedClientError:
            raise self.make_connection_error() from None

    def receive(self, future: Future) -> tuple:
        """Return the result of a chunk; raise Missing if its worker has other versions or files."""
        answer = super().receive(future)
        if isinstance(answer, dict):
            raise self._worker_error(answer, self.origin[0])
        return answer

    def end(self) -> None:
        """Close the connection, and the cluster if it was started here."""
        self.client.close()
        if self.local_cluster is not None:
            self.local_cluster.close()

    def _worker_error(self, on_worker: dict | Exception, local: dict) -> Missing:
        """Return the error for a worker whose software or files do not match.

        on_worker: versions of the worker, or an exception instead; local: versions of this
        machine.
        """
        if isinstance(on_worker, Exception):
            reason = f"{type(on_worker).__name__}: {on_worker}"
            return Missing(
                f"{self.name}: patchfem {local['patchfem']} is not installed on a worker ({reason})"
            )
        names = [name for name in local if on_worker[name] != local[name] and name != "files"]
        if names:
            other_versions = ", ".join(f"{name} {on_worker[name]}" for name in names)
            own_versions = ", ".join(f"{name} {local[name]}" for name in names)
            return Missing(
                f"{self.name}: a worker has {other_versions}, but this machine has {own_versions}; install "
                "the same version on all machines"
            )
        return Missing(
            f"{self.name}: the files named in the scene differ between a worker and this machine; put the "
            "files where all machines can read them"
        )


@cache
def _hash_source_files() -> str:
    """Return a hash of the source files of this package."""
    root = Path(__file__).parents[3]
    paths = root.rglob("*.py")
    texts = [(path.relative_to(root).as_posix(), path.read_bytes()) for path in paths]
    return sha256(repr(sorted(texts)).encode()).hexdigest()[:8]


def environment_versions(work: WorkerData | None = None) -> dict:
    """Return the versions and file hashes that must be equal on a worker and in this process.

    Returns a dict of versions by name; `files` is the hash of the scene and the files that it names.
    """
    versions = {
        "patchfem": f"{__version__} (sources {_hash_source_files()})",
        "numpy": np.__version__,
        "python": "{}.{}".format(*sys.version_info),
    }
    if work is not None:
        versions["files"] = work.sweep_scene.hash_common_data()
    return versions


def _identity(work: WorkerData) -> WorkerData:
    """Return the data of a sweep unchanged; a call as a Dask task stores them on the cluster."""
    return work


def _compute_on_worker(work: WorkerData, chunk: list, origin: tuple) -> tuple | dict:
    """Compute a chunk on a Dask worker; return (CPU time [s], results).

    If the worker has other versions or files, its `environment_versions` are returned instead.

    Parameters
    ----------
    work : WorkerData
    chunk : list
        Case numbers.
    origin : tuple
        `environment_versions` and scene path of the process that started the sweep; error messages
        contain this path.
    """
    versions, path = origin
    worker_versions = environment_versions(work)
    if worker_versions != versions:
        return worker_versions
    folder = f"{work.sweep_scene.path.parent}{os.sep}"
    origin_folder = str(path.parent / "_")[:-1]
    return compute_chunk(work, chunk, rewrite=lambda text: text.replace(folder, origin_folder))
