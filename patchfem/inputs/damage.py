"""Errors for damaged files, and short quotations of what files contain."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from ..exceptions import PatchfemError

MAX_LISTED_NAMES = 12  # largest number of names that a message lists


def shorten(text, length: int = 40) -> str:
    """Make a text from a file or a library printable and at most `length` characters long."""
    text = " ".join(str(text).split())
    if not text.isprintable():
        text = text.encode("unicode_escape").decode()
    return text if len(text) <= length else f"{text[: length - 3]}..."


def list_some(texts: Sequence[str]) -> str:
    """Join texts with commas; those beyond `MAX_LISTED_NAMES` are only counted."""
    n_more = len(texts) - MAX_LISTED_NAMES
    return ", ".join(texts[:MAX_LISTED_NAMES]) + (f" and {n_more} more" if n_more > 0 else "")


@contextmanager
def refuse_damage(message: str, remedy: str = "") -> Iterator[None]:
    """Convert exceptions that are raised while a damaged file is read into a PatchfemError.

    Its message is `message`, the reason in brackets and `remedy`. Mistakes in the program pass; a damaged file leads to any
    other exception in a library.
    """
    try:
        yield
    except (PatchfemError, NameError, AttributeError, TypeError, AssertionError):
        raise
    except Exception as error:
        # Largest number of characters of a quoted reason
        reason = shorten(error, 160)
        raise PatchfemError(f"{message} ({reason}){remedy}") from None
