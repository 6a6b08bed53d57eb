"""Executor with several processes on this machine, which replaces processes that die.

If a process dies, only its current chunk is lost. The standard pools of Python abandon all chunks in
this case, and they run the main script of the caller again in spawned processes. Therefore each worker
is a new interpreter that is connected by a pipe.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import NamedTuple

from ....core import Missing
from ..sweep import WorkerData, WorkerDeath

ONE_THREAD = {
    name: "1"
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
}
PACKAGE = Path(__file__).parents[3]
MODULE = __name__.rpartition(".")[0] + ".worker"
# The worker imports this package from its file, and nothing from the current folder. The parent folder
# of the package is appended to the path, because all dependencies may be installed there.
WORKER_SCRIPT = f"""\
import sys
from importlib.util import module_from_spec, spec_from_file_location
spec = spec_from_file_location({PACKAGE.name!r}, sys.argv[3])
sys.modules[spec.name] = package = module_from_spec(spec)
spec.loader.exec_module(package)
sys.path.append(sys.argv[4])
from {MODULE} import main
main()
"""


class ComputedChunk(NamedTuple):
    """Result of a chunk: its cases, its elapsed time [s], and its results or a WorkerDeath."""

    chunk: list
    seconds: float
    answer: tuple | WorkerDeath


class Worker:
    """Worker process that computes chunks sequentially."""

    def __init__(self, work: WorkerData, *, silent: bool = False):
        here, there = Pipe()
        words = [
            sys.executable,
            "-P",
            "-c",
            WORKER_SCRIPT,
            str(there.fileno()),
            "silent" * silent,
            str(PACKAGE / "__init__.py"),
            str(PACKAGE.parent),
        ]
        self.process = subprocess.Popen(
            words, pass_fds=[there.fileno()], stdin=subprocess.DEVNULL, env=os.environ | ONE_THREAD
        )
        there.close()  # The pipe is then closed by the death of the process.
        self.pipe: Connection = here
        self.chunk = None
        self.pipe.send(work)

    def send_chunk(self, chunk: list) -> None:
        """Send the case numbers of a chunk to the worker process."""
        self.chunk = chunk
        try:
            self.pipe.send(chunk)
        except OSError:
            pass  # The process is dead, which `receive_result` detects next.

    def receive_result(self) -> ComputedChunk:
        """Receive the results of the current chunk, or a WorkerDeath if the process died."""
        try:
            seconds, answer = self.pipe.recv()
        except (EOFError, OSError):
            seconds = 0.0
            answer = WorkerDeath(
                f"the process that ran this case died ({_describe_exit_status(self.process.wait())})"
            )
        chunk = self.chunk
        self.chunk = None
        return ComputedChunk(chunk, seconds, answer)

    def kill(self) -> None:
        """Kill the worker process."""
        self.pipe.close()
        self.process.kill()
        self.process.wait()


class Pool:
    """Executor that computes the chunks of a sweep in several processes on this machine."""

    def __init__(self, workers: int):
        self.workers = workers

    def run(
        self, work: WorkerData, next_chunk: Callable, say: Callable | None = None
    ) -> Iterator[tuple]:
        """Compute the chunks that the callback `next_chunk` returns, and yield their results.

        Parameters
        ----------
        work : WorkerData
        next_chunk : callable
            Returns the case numbers of the next chunk, or None if none is left.
        say : callable, optional
            Called with a line of text.

        Yields
        ------
        ComputedChunk
            In the order in which the chunks finish.
        """
        workers: list[Worker] = []
        try:
            while True:
                # Idle processes continue, and processes are started while chunks remain.
                idle = [worker for worker in workers if worker.chunk is None]
                while idle or len(workers) < self.workers:
                    chunk = next_chunk()
                    if chunk is None:
                        break
                    if not idle:
                        idle.append(_start_worker(work, silent=say is None))
                        workers.append(idle[0])
                    idle.pop().send_chunk(chunk)

                busy = {worker.pipe: worker for worker in workers if worker.chunk is not None}
                if not busy:
                    return
                for pipe in wait(list(busy)):
                    worker = busy[pipe]
                    computed = worker.receive_result()
                    if isinstance(computed.answer, WorkerDeath):
                        workers.remove(worker)
                        worker.kill()
                    elif (chunk := next_chunk()) is not None:
                        # The worker continues with its next chunk while the result is written.
                        worker.send_chunk(chunk)
                    yield computed
        finally:
            for worker in workers:
                worker.kill()


def _start_worker(work: WorkerData, *, silent: bool) -> Worker:
    """Start a worker process; raise Missing if the operating system cannot create it."""
    try:
        return Worker(work, silent=silent)
    except OSError as error:
        raise Missing(
            f"a process of the sweep cannot be started ({error.strerror}); lower -j"
        ) from None


def _describe_exit_status(status: int) -> str:
    """Describe the exit status of a worker process."""
    if status == -9:
        return "killed by a user, or for lack of memory"
    return f"signal {-status}" if status < 0 else f"exit code {status}"
