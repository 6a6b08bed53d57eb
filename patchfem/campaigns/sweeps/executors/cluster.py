"""Executor that computes the cases of a sweep on the workers of a Dask cluster.

The cluster is started on this machine, or belongs to a scheduler at a given address.
"""

import os
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from copy import copy
from dataclasses import replace
from logging import CRITICAL, getLogger
from pathlib import Path

from ....core import Missing
from ..sweep import WorkerData, compute_chunk
from .pool import FutureExecutor

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
        try:
            self.client = distributed.Client(
                self.local_cluster or address, timeout=CONNECT_TIMEOUT, set_as_default=False
            )
        except (OSError, TimeoutError, ValueError, TypeError) as error:
            raise Missing(f"{self.name}: no scheduler answers at this address ({error})") from None
        versions = self.client.get_versions(packages=["patchfem"])
        self.workers = max(len(versions["workers"]), 1)
        try:
            for worker in versions["workers"].values():
                self._require_same_versions(versions["client"], worker)
        except Missing:
            self.end()
            raise

    def _require_same_versions(self, here: dict[str, dict], worker: dict[str, dict]) -> None:
        """Raise Missing if a worker has other versions than this machine, `here`.

        Both are answers of Dask.
        """
        # Software whose versions must be the same on all machines.
        for name in ("patchfem", "numpy", "python"):
            own, other = ({**node["host"], **node["packages"]}[name] for node in (here, worker))
            if own != other:
                raise Missing(
                    f"{self.name}: a worker has {name} {other}, but this machine has {name} {own}; install the same version "
                    "on all machines"
                )

    def begin(self, work: WorkerData, *, is_silent: bool) -> None:
        """Store the data of the sweep, `work`, on the cluster.

        Raises Missing if the connection to the scheduler is lost. `is_silent` has no effect: workers of a cluster
        print nothing.
        """
        scene = work.sweep_scene
        self.common_data = scene.hash_common_data()
        scene = replace(scene, path=Path(os.path.abspath(scene.path)))
        # Dask repeats this task if the workers that store its result die.
        with self._report_lost_connection():
            self.shared = self.client.submit(copy, replace(work, sweep_scene=scene), pure=False)
            self.executor = self.client.get_executor(pure=False)

    def submit(self, chunk: list[int]) -> Future:
        """Submit a chunk.

        Missing is raised if the connection to the scheduler is lost.
        """
        with self._report_lost_connection():
            return self.executor.submit(_compute_on_worker, self.shared, chunk, self.common_data)

    @contextmanager
    def _report_lost_connection(self) -> Iterator[None]:
        """Raise Missing in place of the error of a client whose connection is closed."""
        from distributed.client import ClosedClientError

        try:
            yield
        except ClosedClientError:
            raise self.make_connection_error() from None

    def end(self) -> None:
        """Close the connection, and the cluster if it was started here."""
        self.client.close()
        if self.local_cluster is not None:
            self.local_cluster.close()


def _compute_on_worker(work: WorkerData, chunk: list[int], common_data: str) -> tuple[float, tuple]:
    """Compute a chunk of case numbers on a Dask worker; return the result of `compute_chunk`.

    Raises Missing if the files of the scene differ from those of the process that started the sweep, whose hash is
    `common_data`.
    """
    if work.sweep_scene.hash_common_data() != common_data:
        raise Missing(
            "--executor dask: the files named in the scene differ between a worker and this machine; put them where all "
            "machines can read them"
        )
    return compute_chunk(work, chunk)
