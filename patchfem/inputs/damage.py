"""Errors for damaged files."""

from collections.abc import Iterator
from contextlib import contextmanager

from ..exceptions import PatchfemError

MAX_REASON = 160  # characters of a reason


@contextmanager
def refuse_damage(message: str, remedy: str = "") -> Iterator[None]:
    """Turn any other exception into the PatchfemError ``message (reason)remedy``.

    It encloses code that reads a file: a damaged one can make it raise almost any exception.
    """
    try:
        yield
    except PatchfemError:
        raise
    except Exception as error:
        reason = " ".join(str(error).split())[:MAX_REASON]
        if not reason.isprintable():
            reason = type(error).__name__
        raise PatchfemError(f"{message} ({reason}){remedy}") from None
