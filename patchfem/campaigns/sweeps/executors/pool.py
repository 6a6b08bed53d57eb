"""Executors that compute chunks in other processes, as futures of the standard library."""

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.context import SpawnContext, SpawnProcess
from threading import Thread
from types import ModuleType

from ....core import Missing
from ..sweep import WorkerData, WorkerDeath, compute_chunk

# Environment of a worker: one thread, and no imports from the current folder.
WORKER_ENVIRONMENT = {
    "PYTHONSAFEPATH": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
}


class FutureExecutor:
    """Executor that computes the chunks of a sweep as futures.

    A subclass has the number of `workers` and the methods `begin`, `submit` and `end`. The number of chunks that are
    assigned to each worker is `chunks_per_worker`.
    """

    workers = 1
    chunks_per_worker = 1
    name = ""

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
            Returns the case numbers of the next chunk, or None if none is available; takes `is_idle`, whether no other
            chunk is being computed.
        say : callable, optional
            Called with a line of text.

        Yields
        ------
        tuple
            (chunk, seconds, answer or WorkerDeath), in the order in which the chunks finish.
        """
        pending: dict[Future, list] = {}
        finished: list[tuple[list, Future]] = []
        try:
            self.begin(work, is_silent=say is None)
            while True:
                while len(pending) < self.chunks_per_worker * self.workers:
                    chunk = next_chunk(is_idle=not pending)
                    if chunk is None:
                        break
                    pending[self.submit(chunk)] = chunk
                if not pending and not finished:
                    return

                # While the caller writes these results, the workers compute the chunks that were just submitted.
                for chunk, future in finished:
                    yield chunk, *self.receive(future)
                done = wait(pending, return_when=FIRST_COMPLETED).done if pending else ()
                finished = [(pending.pop(future), future) for future in done]
        finally:
            self.end()

    def receive(self, future: Future) -> tuple[float, tuple | WorkerDeath]:
        """Return seconds and answer of a finished future; 0 s and a WorkerDeath if its worker died or failed.

        Raises Missing if the connection to the workers is lost, or if a worker lacks something.
        """
        try:
            return future.result()
        except Missing:
            raise
        except CancelledError:
            raise self.make_connection_error() from None
        except Exception as error:
            kind = type(error).__name__
            # Names of the errors of a worker process that ended.
            if kind in ("BrokenProcessPool", "KilledWorker"):
                return 0.0, WorkerDeath(
                    "its worker process died (killed by a user, or for lack of memory)"
                )
            return 0.0, WorkerDeath(f"the worker of this case failed ({kind}: {error})")

    def make_connection_error(self) -> Missing:
        """Return the error for a lost connection to the workers."""
        return Missing(
            f"{self.name}: the connection to the scheduler is lost; start the scheduler again, and repeat the command with "
            "--resume, which keeps the finished cases"
        )


class _OwnProcesses(SpawnContext):
    """Context of new interpreters that keeps the processes which it starts."""

    def __init__(self):
        super().__init__()
        self.started: list[SpawnProcess] = []

    def Process(self, *arguments, **keywords) -> SpawnProcess:
        """Return a new process and keep it; an executor calls this method and starts the process."""
        process = SpawnProcess(*arguments, **keywords)
        self.started.append(process)
        return process


class Pool(FutureExecutor):
    """Executor that computes the chunks of a sweep in several processes on this machine.

    Each process has an executor of its own, because the death of a process ends all chunks of its executor. A new process
    takes its place.
    """

    def __init__(self, workers: int):
        self.workers = workers

    def begin(self, work: WorkerData, *, is_silent: bool) -> None:
        """Keep the data of the sweep, `work`, which each new process receives.

        A process prints progress to the standard error stream unless `is_silent`.
        """
        self.initial_data = (work, None if is_silent else _print_to_stderr)
        self.processes = _OwnProcesses()
        self.last_chunks: dict[ProcessPoolExecutor, Future] = {}

    def submit(self, chunk: list[int]) -> Future:
        """Submit a chunk to an idle process, or to a new one.

        Missing is raised if none can be started.
        """
        idle = [executor for executor, future in self.last_chunks.items() if future.done()]
        for executor in idle:
            try:
                future = executor.submit(_compute_in_process, chunk)
            except BrokenProcessPool:
                del self.last_chunks[executor]
                continue
            self.last_chunks[executor] = future
            return future
        try:
            executor = ProcessPoolExecutor(1, self.processes, _begin_process, self.initial_data)
            with _worker_environment():
                future = executor.submit(_compute_in_process, chunk)
        except OSError as error:
            raise Missing(
                f"a process of the sweep cannot be started ({error.strerror}); lower -j"
            ) from None
        self.last_chunks[executor] = future
        return future

    def end(self) -> None:
        """Kill the processes of this sweep."""
        for process in self.processes.started:
            if process.pid is not None:
                process.kill()
        for executor in self.last_chunks:
            executor.shutdown(cancel_futures=True)


@contextmanager
def _worker_environment() -> Iterator[None]:
    """Set the environment of processes that start, and hide the script of the caller, which they would run again."""
    before = {name: os.environ.get(name) for name in WORKER_ENVIRONMENT}
    script = sys.modules["__main__"]
    os.environ.update(WORKER_ENVIRONMENT)
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


# Data of the sweep in a worker process, and the function that prints a line of text.
_PROCESS_DATA: list[WorkerData | Callable | None] = []


def _begin_process(work: WorkerData, say: Callable | None) -> None:
    """Keep the data of the sweep, `work`, in a new process, which ends with the one that started it.

    `say` prints a line of text, or is None.
    """
    # The process that started the sweep handles interrupts.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "SIGHUP"):  # not on Windows
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
    _PROCESS_DATA[:] = work, say
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when the process that started it has ended."""
    multiprocessing.parent_process().join()
    os._exit(1)


def _compute_in_process(chunk: list[int]) -> tuple[float, tuple]:
    """Compute a chunk in a worker process; return the result of `compute_chunk`."""
    work, say = _PROCESS_DATA
    return compute_chunk(work, chunk, say)


def _print_to_stderr(text: str) -> None:
    """Print a line of text to the standard error stream."""
    print(text, file=sys.stderr, flush=True)
