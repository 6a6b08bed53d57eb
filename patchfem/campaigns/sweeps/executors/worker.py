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
        say = None if sys.argv[2] else _print_to_stderr
        while True:
            pipe.send(sweep.compute_chunk(work, pipe.recv(), say))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        # The pipe is closed because the process that started the sweep has ended.
        return


def _print_to_stderr(text: str) -> None:
    """Print a line of text to the standard error stream."""
    print(text, file=sys.stderr, flush=True)
