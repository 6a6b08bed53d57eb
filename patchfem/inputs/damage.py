"""Errors for damaged files."""

import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager

from ..exceptions import PatchfemError

MAX_REASON_LENGTH = 160  # largest number of characters of a quoted reason; longer reasons are cut

# Exceptions that the readers and the libraries that they call raise for damaged files; a NameError,
# an AttributeError or a TypeError is a mistake in the program and is not caught.
DAMAGE_ERRORS = (
    ValueError,  # includes UnicodeDecodeError
    LookupError,  # KeyError and IndexError
    OverflowError,
    RuntimeError,  # raised by HDF5 and for encrypted archives; includes NotImplementedError of zipfile
    OSError,
    EOFError,
    struct.error,
    SyntaxError,  # raised by NumPy for a damaged header, as the next one
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)


@contextmanager
def refuse_damage(message: str, remedy: str = "") -> Iterator[None]:
    """Convert exceptions that are raised while a damaged file is read into a PatchfemError.

    Its message is `message`, the reason in brackets and `remedy`. Damaged bytes raise `DAMAGE_ERRORS`,
    or in pyuff a plain Exception.
    """
    try:
        yield
    except PatchfemError:
        raise
    except Exception as error:
        if not isinstance(error, DAMAGE_ERRORS) and type(error) is not Exception:
            raise
        reason = " ".join(str(error).split())[:MAX_REASON_LENGTH]
        if not reason.isprintable():
            reason = type(error).__name__
        raise PatchfemError(f"{message} ({reason}){remedy}") from None
