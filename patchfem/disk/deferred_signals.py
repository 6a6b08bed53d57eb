"""Deferral of the signals that end the process, while an interruption would damage files."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

TERMINATION_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)


@contextmanager
def defer_signals() -> Iterator[None]:
    """Defer signals that end this process until the block is done."""
    # Signals reach only the main thread.
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received = []
    handlers = {}
    try:
        for number in TERMINATION_SIGNALS:
            handler = signal.getsignal(number)
            if handler not in (signal.SIG_IGN, None):
                # noted first: a signal that arrives between the two lines must not leave the handler replaced
                handlers[number] = handler
                signal.signal(number, lambda number, _: received.append(number))
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for number in received[:1]:
            signal.raise_signal(number)
