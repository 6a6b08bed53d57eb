"""Executor with several processes of this machine, which replaces processes that die.

A death loses only the chunk of that process. The standard pools give up all chunks when one process
dies, and run the script of the caller again if processes are spawned; therefore each worker is a
new interpreter that is connected by a pipe.
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
from ..sweep import Died, Work

ONE_THREAD = {
    name: "1"
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
}
PACKAGE = Path(__file__).parents[3]
MODULE = __name__.rpartition(".")[0] + ".worker"
# The worker imports this package from its file, and nothing from the current folder. The folder
# that contains the package comes last in the path: it may be the folder in which all dependencies
# were installed.
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
    """Chunk of cases, the time [s] that it took, and its results, or Died."""

    chunk: list
    seconds: float
    answer: tuple | Died


class Worker:
    """Worker process that computes chunks one after the other."""

    def __init__(self, work: Work, *, silent: bool = False):
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
        there.close()  # The pipe then closes when the process dies.
        self.pipe: Connection = here
        self.chunk = None
        self.pipe.send(work)

    def send_work(self, work: Work) -> None:
        """Send the common data of all cases, with their shared meshes, to the worker process."""
        try:
            self.pipe.send(work)
        except OSError:
            pass  # The process is dead; `receive` notices this once it has a chunk.

    def send_chunk(self, chunk: list) -> None:
        """Send the numbers of a chunk of cases to the worker process."""
        self.chunk = chunk
        try:
            self.pipe.send(chunk)
        except OSError:
            pass  # The process is dead, which `receive` notices next.

    def receive(self) -> ComputedChunk:
        """Receive the results of a chunk, or Died if the worker process died."""
        try:
            seconds, answer = self.pipe.recv()
        except (EOFError, OSError):
            seconds = 0.0
            answer = Died(
                f"the process that ran this case died ({_describe_status(self.process.wait())})"
            )
        chunk = self.chunk
        self.chunk = None
        return ComputedChunk(chunk, seconds, answer)

    def end(self) -> None:
        """Kill the worker process."""
        self.pipe.close()
        self.process.kill()
        self.process.wait()


class Pool:
    """Executor that computes chunks in several processes of this machine."""

    def __init__(self, workers: int):
        self.workers = workers
        self.ready = []

    def begin(self, work: Work, count: int, say: Callable | None = None) -> None:
        """Start the processes, which import their code while the shared meshes are chosen.

        Parameters
        ----------
        work : Work
            Common data of all cases, without these meshes.
        count : int
            Number of cases.
        say : callable, optional
            Takes a line of text.
        """
        self.end()
        for _ in range(min(self.workers, count)):
            self.ready.append(_start_worker(work, silent=say is None))

    def end(self) -> None:
        """Kill the processes that wait for the shared meshes."""
        while self.ready:
            self.ready.pop().end()

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
        ComputedChunk
            As they come in.
        """
        workers = self.ready
        self.ready = []
        try:
            for worker in workers:
                worker.send_work(work)
            while True:
                self._hand_out(workers, lambda: _start_worker(work, silent=say is None), take)
                busy = {worker.pipe: worker for worker in workers if worker.chunk is not None}
                if not busy:
                    return
                for pipe in wait(list(busy)):
                    worker = busy[pipe]
                    computed = worker.receive()
                    if isinstance(computed.answer, Died):
                        workers.remove(worker)
                        worker.end()
                    elif (chunk := take()) is not None:
                        # The worker receives its next chunk before the result is written, which
                        # takes time.
                        worker.send_chunk(chunk)
                    yield computed
        finally:
            for worker in workers:
                worker.end()

    def _hand_out(self, workers: list, start: Callable, take: Callable) -> None:
        """Give every idle process a chunk, and start new processes while chunks remain."""
        idle = [worker for worker in workers if worker.chunk is None]
        while idle or len(workers) < self.workers:
            chunk = take()
            if chunk is None:
                return
            if idle:
                worker = idle.pop(0)
            else:
                worker = start()
                workers.append(worker)
            worker.send_chunk(chunk)


def _start_worker(work: Work, *, silent: bool) -> Worker:
    """Start a worker process; Missing if the system refuses."""
    try:
        return Worker(work, silent=silent)
    except OSError as error:
        raise Missing(
            f"a process of the sweep cannot be started ({error.strerror}); lower -j"
        ) from None


def _describe_status(status: int) -> str:
    """Describe the exit status of a worker process."""
    if status == -9:
        return "killed by a user, or for lack of memory"
    return f"signal {-status}" if status < 0 else f"exit code {status}"
