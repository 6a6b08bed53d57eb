"""Errors for damaged files."""

from collections.abc import Iterator
from contextlib import contextmanager

from ..exceptions import PatchfemError

MAX_REASON_LENGTH = 160  # largest number of characters of a quoted reason; longer reasons are cut

# Exceptions that are mistakes in the program; a damaged file leads to any other one in a library.
MISTAKES = (NameError, AttributeError, TypeError, AssertionError)


@contextmanager
def refuse_damage(message: str, remedy: str = "") -> Iterator[None]:
    """Convert exceptions that are raised while a damaged file is read into a PatchfemError.

    Its message is `message`, the reason in brackets and `remedy`. `MISTAKES` of the program pass.
    """
    try:
        yield
    except (PatchfemError, *MISTAKES):
        raise
    except Exception as error:
        reason = " ".join(str(error).split())[:MAX_REASON_LENGTH]
        if not reason.isprintable():
            reason = type(error).__name__
        raise PatchfemError(f"{message} ({reason}){remedy}") from None
