"""Standard streams that work even if they are closed, full or of a limited encoding."""

import io
import os
import re
import shutil
import sys
import warnings

# Word of more than 400 characters, longer than any readable path; a key or a value
# can be megabytes long.
LONG_WORD_PATTERN = re.compile(r"\S{401,}")


# Narrowest terminal [characters] for which help is laid out; the layout does not end for 1 and 2
# characters, and no line is readable with fewer than this.
MIN_TERMINAL_WIDTH = 20


class _OutputPipe(io.FileIO):
    """Standard output, which discards what is written after the first error.

    A command that prints its answer before it has written all of its files (`patchfem run ... | head`) goes on after
    the reader of the pipe has gone. Any other error, such as a full disk, is raised once: Python repeats a failed write
    at the end of the process, with a traceback and an exit code of its own.
    """

    has_failed = False

    def write(self, data) -> int:
        """Write the bytes of `data` and return their number, also if they are discarded."""
        if self.has_failed:
            return len(data)
        try:
            return super().write(data)
        except OSError as error:
            self.has_failed = True
            if isinstance(error, BrokenPipeError):
                return len(data)
            error.filename = "standard output"
            raise


def prepare_streams() -> None:
    """Prepare the standard streams of the process.

    A closed stream is connected to the null device, because a file that is opened while 0, 1 or 2
    is closed would get its number and then everything that is printed. Output to
    a pipe that nobody reads any more is discarded. A character that the
    encoding of a stream does not have is written as a backslash with its code. A terminal narrower
    than `MIN_TERMINAL_WIDTH` counts as that wide. Warnings of
    libraries are suppressed, because a user cannot act on them: what matters shows in the numbers
    and is reported by the run. Python's option -W and PYTHONWARNINGS restore these warnings.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            # The null device gets the lowest free file descriptor,
            # which is that of the closed stream.
            os.open(os.devnull, os.O_RDWR)
    if sys.stdout is not None and not sys.stdout.isatty():
        sys.stdout = io.TextIOWrapper(
            io.BufferedWriter(_OutputPipe(1, "w", closefd=False)), encoding=sys.stdout.encoding
        )
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    if shutil.get_terminal_size().columns < MIN_TERMINAL_WIDTH:
        os.environ["COLUMNS"] = str(MIN_TERMINAL_WIDTH)
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
        # The processes that a sweep starts inherit this setting.
        os.environ["PYTHONWARNINGS"] = "ignore"


def make_printable(text: str) -> str:
    """Return a text as one line in which question marks replace characters that cannot be printed.

    A word of more than 400 characters is shortened to its beginning and its end.
    """
    shortened = LONG_WORD_PATTERN.sub(
        lambda match: f"{match[0][:60]}...{match[0][-20:]} ({len(match[0])} letters)", text
    )
    return "".join(character if character.isprintable() else "?" for character in shortened)
