"""Chunks answered by processes of this machine; one that dies takes only its own chunk with it, and is replaced.

The standard pools give every chunk up when one process dies, and run the caller's own script again where processes are
started afresh; so each worker is an interpreter of its own, at the other end of one pipe.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from pathlib import Path

from ....core import Missing
from ..sweep import Died, Work

ONE_THREAD = {
    name: "1"
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
}
PACKAGE, MODULE = Path(__file__).parents[3], __name__.rpartition(".")[0] + ".worker"
# this package and no other, and nothing of the current folder; what lies beside the package comes last, as it may be a
# folder in which all that it needs was installed
START = f"""\
import sys
from importlib.util import module_from_spec, spec_from_file_location
spec = spec_from_file_location({PACKAGE.name!r}, sys.argv[3])
sys.modules[spec.name] = package = module_from_spec(spec)
spec.loader.exec_module(package)
sys.path.append(sys.argv[4])
from {MODULE} import main
main()
"""


class Worker:
    """A process that answers one chunk after the other."""

    def __init__(self, work: Work, silent: bool = False):
        here, there = Pipe()
        words = [
            sys.executable,
            "-P",
            "-c",
            START,
            str(there.fileno()),
            "silent" * silent,
            str(PACKAGE / "__init__.py"),
            str(PACKAGE.parent),
        ]
        self.process = subprocess.Popen(
            words, pass_fds=[there.fileno()], stdin=subprocess.DEVNULL, env=os.environ | ONE_THREAD
        )
        there.close()  # so that the death of the process closes the pipe
        self.pipe: Connection = here
        self.chunk = None
        self.pipe.send(work)

    def tell(self, work: Work) -> None:
        """Send the work with the meshes that its cases share."""
        try:
            self.pipe.send(work)
        except OSError:
            pass  # it is dead, which `taken` finds when it has a chunk

    def give(self, chunk: list) -> None:
        """Send a chunk."""
        self.chunk = chunk
        try:
            self.pipe.send(chunk)
        except OSError:
            pass  # it is dead, which `taken` finds next

    def taken(self) -> tuple:
        """(chunk, seconds, its answer), or Died in place of the answer."""
        try:
            seconds, found = self.pipe.recv()
        except (EOFError, OSError):
            seconds, found = (
                0.0,
                Died(f"the process that ran this case died ({_how(self.process.wait())})"),
            )
        chunk, self.chunk = self.chunk, None
        return chunk, seconds, found

    def end(self) -> None:
        """Stop the process, whatever it does."""
        self.pipe.close()
        self.process.kill()
        self.process.wait()


class Pool:
    """The executor of some processes of this machine."""

    def __init__(self, workers: int):
        self.workers, self.ready = workers, []

    def begin(self, work: Work, count: int, say: Callable | None = None) -> None:
        """Start the processes, which bring up what a case needs while the meshes of all cases are chosen here.

        work: without these meshes; count: of cases.
        """
        self.end()
        for _ in range(min(self.workers, count)):
            self.ready.append(_started(work, say is None))

    def end(self) -> None:
        """Stop the processes that wait for the meshes."""
        while self.ready:
            self.ready.pop().end()

    def run(self, work: Work, take: Callable, say: Callable | None = None) -> Iterator[tuple]:
        """(chunk, seconds, answer or Died) of each chunk that `take` hands out, as they come in."""
        workers, self.ready = self.ready, []
        try:
            for one in workers:
                one.tell(work)
            while True:
                self._hand_out(workers, lambda: _started(work, say is None), take)
                busy = {one.pipe: one for one in workers if one.chunk is not None}
                if not busy:
                    return
                for pipe in wait(list(busy)):
                    one = busy[pipe]
                    taken = one.taken()
                    if isinstance(taken[2], Died):
                        workers.remove(one)
                        one.end()
                    elif (
                        chunk := take()
                    ) is not None:  # before its answer is written, which takes a while
                        one.give(chunk)
                    yield taken
        finally:
            for one in workers:
                one.end()

    def _hand_out(self, workers: list, start: Callable, take: Callable) -> None:
        """Give every idle process a chunk; start another while there are chunks and not yet enough processes."""
        for one in [one for one in workers if one.chunk is None] + [None] * (
            self.workers - len(workers)
        ):
            chunk = take()
            if chunk is None:
                return
            if one is None:
                workers.append(one := start())
            one.give(chunk)


def _started(work: Work, silent: bool) -> Worker:
    try:
        return Worker(work, silent)
    except OSError as error:
        raise Missing(
            f"a process of the sweep cannot be started ({error.strerror}); lower -j"
        ) from None


def _how(status: int) -> str:
    if status == -9:
        return "killed by a user, or for lack of memory"
    return f"signal {-status}" if status < 0 else f"exit code {status}"
