"""Worker process of the pool, which computes chunks from a pipe until the pipe is closed."""

import signal
import sys
from multiprocessing.connection import Connection

from .. import sweep


def main() -> None:
    """Compute the chunks of cases that arrive through a pipe.

    The first word of the command line is the file descriptor of the pipe; a second word that is not
    empty suppresses messages.
    """
    # An interrupt is handled by the process that started the sweep.
    for name in ("SIGINT", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    pipe = Connection(int(sys.argv[1]))
    try:
        work = pipe.recv()
        sweep.warm_up(work)
        say = None if sys.argv[2] else _print_line
        while True:
            message = pipe.recv()
            if isinstance(message, sweep.Work):
                # Here the data of all cases arrives again, now with the meshes that they share.
                work = message
            else:
                pipe.send(sweep.compute_timed(work, message, say))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        # The process that started the sweep has ended.
        return


def _print_line(text: str) -> None:
    """Print a line of text and flush the output."""
    print(text, file=sys.stderr, flush=True)
