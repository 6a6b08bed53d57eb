"""The streams of a process, made fit for whatever the command line is started with: closed, full, or of few signs."""

import os
import re
import sys
import warnings

# longer than any path that a person reads; a key or a value may have megabytes
LONG = re.compile(r"\S{401,}")


def ready() -> None:
    """Give a closed stream a place to write to, let no sign fail an encoding, and keep libraries' warnings off stderr.

    A file that is opened while 0, 1 or 2 is closed takes its number, and what is printed then goes into that file.
    A sign that the encoding of a stream has not is written as a backslash with its code. What a library warns of is
    nothing that a user can act on: what matters is found in the numbers and said by the run. Python's own option -W and
    PYTHONWARNINGS bring these warnings back.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            # it takes the lowest number that is free, which is this one
            os.open(os.devnull, os.O_RDWR)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
        os.environ["PYTHONWARNINGS"] = "ignore"  # of processes that a sweep starts


def plain(text: str) -> str:
    """One line of a text in which no sign moves the cursor: what cannot be printed is a question mark, and of a word
    beyond 400 letters the first and the last are shown."""
    shown = LONG.sub(
        lambda found: f"{found[0][:60]}...{found[0][-20:]} ({len(found[0])} letters)", text
    )
    return "".join(sign if sign.isprintable() else "?" for sign in shown)
