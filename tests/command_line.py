"""The command line inside the test process."""

from __future__ import annotations

import contextlib
import io
from typing import NamedTuple

import pytest

from patchfem.__main__ import main


class Answer(NamedTuple):
    """Exit code, stdout and stderr."""

    code: int
    out: str
    err: str


def cli(*words) -> Answer:
    """What `patchfem WORDS` answers."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), pytest.raises(SystemExit) as end:
        main([str(word) for word in words])
    return Answer(end.value.code or 0, out.getvalue(), err.getvalue())
