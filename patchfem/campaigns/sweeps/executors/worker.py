"""A process of the pool: it answers chunks from a pipe until the pipe is closed."""

import signal
import sys
from multiprocessing.connection import Connection

from .. import sweep


def main() -> None:
    """Answer the chunks of a work that come through the pipe whose number is the first word of the command line; a
    second word keeps it silent."""
    for one in ("SIGINT", "SIGHUP"):  # an interrupt is the business of the process that asks
        if hasattr(signal, one):
            signal.signal(getattr(signal, one), signal.SIG_IGN)
    pipe = Connection(int(sys.argv[1]))
    try:
        work = pipe.recv()

        sweep.warmed(work)
        while True:
            asked = pipe.recv()
            if isinstance(asked, sweep.Work):  # the same with what was made of all cases
                work = asked
            else:
                pipe.send(sweep.timed(work, asked, None if sys.argv[2] else _say))
    except (EOFError, BrokenPipeError, ConnectionResetError):  # who asked is gone
        return


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
