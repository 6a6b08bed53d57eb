"""A process of the pool: it answers chunks from a pipe until the pipe is closed."""

import signal
import sys
from multiprocessing.connection import Connection


def main() -> None:
    """Answer the chunks that come through the pipe whose number is the first word of the command line; a second word
    keeps it silent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interrupt is the business of the process that asks
    pipe = Connection(int(sys.argv[1]))
    try:
        work = pipe.recv()
        from ..sweep import answer

        while True:
            chunk = pipe.recv()
            pipe.send(answer(work, chunk, None if sys.argv[2] else _say))
    except (EOFError, BrokenPipeError, ConnectionResetError):  # who asked is gone
        return


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
