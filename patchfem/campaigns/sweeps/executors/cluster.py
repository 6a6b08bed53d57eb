"""Chunks answered by the workers of a Dask cluster: one of this machine, or any whose scheduler has an address."""

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
from ..sweep import Died, Work, handed, timed

_TLS = "DASK_DISTRIBUTED__COMM__TLS__"
CERTIFICATES = f"{_TLS}CA_FILE, {_TLS}CLIENT__CERT and {_TLS}CLIENT__KEY"
AHEAD = 2  # chunks on their way per worker, so that none waits for the next
PATIENCE = "10s"  # for a scheduler to answer


class Cluster:
    """The executor of a Dask cluster; address: of its scheduler, "" to start one of `workers` processes here."""

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

            # tries are counted by the sweep; a profile of the workers, which nobody sees, is a third of a chunk's way
            dask.config.set(
                {
                    "distributed.scheduler.allowed-failures": 0,
                    "distributed.worker.profile.enabled": False,
                    "distributed.scheduler.http.routes": [],
                    "distributed.worker.http.routes": [],
                    "distributed.nanny.pre-spawn-environ.PYTHONSAFEPATH": 1,
                }
            )
            # a port that tells nothing
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
            one.setLevel(CRITICAL)  # what they have to say is said here
        tls = distributed.Security().get_connection_args("client")["ssl_context"] is not None
        if address.startswith("tls:") and not tls:
            raise PatchfemError(
                f"{self.name}: TLS needs certificates; give the paths of their files in the "
                f"environment variables {CERTIFICATES}"
            )
        try:
            self.client = distributed.Client(
                self.own or address, timeout=PATIENCE, set_as_default=False
            )
        except (OSError, TimeoutError, ValueError) as error:
            raise Missing(f"{self.name}: no scheduler answers at this address ({error})") from None
        found = self.client.run(own_of, on_error="return")
        self.workers = max(len(found), 1)
        for own in found.values():
            if own != own_of():
                self.client.close()
                raise self._other(own, own_of())

    def run(self, work: Work, take: Callable, say: Callable | None = None) -> Iterator[tuple]:
        """(chunk, seconds, answer or Died) of each chunk that `take` hands out, as they come in."""
        from distributed import as_completed
        from distributed.client import ClosedClientError

        path, want = work.asked.path, own_of(work)
        there = replace(work, asked=replace(work.asked, path=Path(os.path.abspath(path))))
        try:
            # made again where all that hold it have died
            shared = self.client.submit(_as_it_is, there, pure=False)
            ready, on_the_way = (
                as_completed(loop=self.client.loop, with_results=True, raise_errors=False),
                {},
            )
            while True:
                while (
                    len(on_the_way) < AHEAD * self.workers
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
                    raise self._other(found, want)
                yield chunk, *(found if future.status == "finished" else self._died(future))
        except ClosedClientError:
            raise self._lost() from None
        finally:
            self.client.close()
            if self.own is not None:
                self.own.close()

    def _lost(self) -> Missing:
        return Missing(f"{self.name}: the connection to the scheduler is lost")

    def _other(self, found: dict | Exception, want: dict) -> Missing:
        """Why a worker cannot answer: what it said of itself, or how it failed to, beside what is wanted."""
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

    def _died(self, future) -> tuple:
        """(0 s, Died) of a chunk whose worker died or failed; Missing where the scheduler did."""
        if future.status == "cancelled":  # nobody here does that
            raise self._lost()
        error = future.exception()
        killed = type(error).__name__ == "KilledWorker"
        return 0.0, Died(
            "its worker died"
            if killed
            else f"the worker of this case failed ({type(error).__name__}: {error})"
        )


@cache
def _source() -> str:
    """Sign of the sources of this package."""
    root = Path(__file__).parents[3]
    texts = sorted(
        (path.relative_to(root).as_posix(), path.read_bytes()) for path in root.rglob("*.py")
    )
    return sha256(repr(texts).encode()).hexdigest()[:8]


def own_of(work: Work | None = None) -> dict:
    """What whoever answers a work must have as who asks has it: versions by name, and as `files` the sign of the scene
    with the files that it names."""
    own = {
        "patchfem": f"{__version__} (sources {_source()})",
        "numpy": np.__version__,
        "python": "{}.{}".format(*sys.version_info),
    }
    return own if work is None else own | {"files": work.asked.digest()}


def _as_it_is(work: Work) -> Work:
    return work


def _answer(work: Work, chunk: list, asked: tuple) -> tuple | dict:
    """(seconds, answer) of a chunk, in a worker, or `own_of` there where that is not the same.

    asked: (`own_of` where the sweep runs, the path of the scene as it is named there, which messages name too).
    """
    want, path = asked
    if (own := own_of(work)) != want:
        return own
    seconds, (found, told) = timed(replace(work, write=None), chunk)
    folder, named = f"{work.asked.path.parent}{os.sep}", str(path.parent / "_")[:-1]
    found.messages.update(
        {case: text.replace(folder, named) for case, text in found.messages.items()}
    )
    return seconds, handed(work, chunk, found, told)
