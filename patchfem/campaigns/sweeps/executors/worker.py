"""Main program of a worker process, which computes the chunks that arrive through a pipe."""

import signal
import sys
from multiprocessing.connection import Connection

from .. import sweep


def main() -> None:
    """Compute the chunks that arrive through a pipe, until the pipe is closed.

    The first argument of the command line is the file descriptor of the pipe. A nonempty second
    argument suppresses messages.
    """
    # The process that started the sweep handles interrupts.
    for name in ("SIGINT", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    pipe = Connection(int(sys.argv[1]))
    try:
        work = pipe.recv()
        sweep.compile_for_first_case(work)
        say = None if sys.argv[2] else _print_to_stderr
        while True:
            message = pipe.recv()
            if isinstance(message, sweep.WorkerData):
                # The data of the sweep arrive a second time, now with the shared meshes.
                work = message
            else:
                pipe.send(sweep.compute_chunk_with_time(work, message, say))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        # The pipe is closed because the process that started the sweep has ended.
        return


def _print_to_stderr(text: str) -> None:
    """Print a line of text to the standard error stream."""
    print(text, file=sys.stderr, flush=True)
