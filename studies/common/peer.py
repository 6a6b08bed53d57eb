"""Another program as a child process, and the time at equal error.

A peer is another program. It runs under its own interpreter, which an environment variable names, and answers JSON
lines. The study and the peer take turns, so that a busy machine slows both alike. CPU seconds are those of one thread,
without imports.
"""

import json
import os
import subprocess
from pathlib import Path

import numpy as np

from patchfem.core import Missing, NotConverged

ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


class Peer:
    """Child process that answers one JSON line for each request.

    `script` is its file below studies/, `version` that of its library.
    """

    def __init__(self, name: str, script: str, variable: str, default: str, remedy: str):
        self.name = name
        python = os.environ.get(variable, default)
        self.remedy = f"{remedy}, then name its interpreter in {variable} (now {python})"
        try:
            self.child = subprocess.Popen(
                [python, str(Path(__file__).parents[1] / script)],
                text=True,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=os.environ | ONE_THREAD,
            )
        except OSError as error:
            raise Missing(f"{name} cannot be run ({error}): {self.remedy}") from None
        self.version = self._read()["version"]

    def _read(self) -> dict:
        line = self.child.stdout.readline()
        if not line:
            raise Missing(
                f"{self.name} ended without an answer (exit code {self.child.wait()}): {self.remedy}"
            )
        found = json.loads(line)
        if "missing" in found:
            self.child.wait()
            raise Missing(f"{self.name} is not installed ({found['missing']}): {self.remedy}")
        if "error" in found:
            raise NotConverged(f"{self.name}: {found['error']}")
        return found

    def ask(self, **request) -> dict:
        """Send a request of plain numbers, texts and lists, and return the answer."""
        try:
            self.child.stdin.write(json.dumps(request) + "\n")
            self.child.stdin.flush()
        except BrokenPipeError:
            pass  # the reader reports the error
        return self._read()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.child.stdin.close()
        self.child.stdout.close()
        self.child.wait()


def interpolate_seconds(error: float, errors, seconds) -> tuple:
    """Interpolate the seconds at which a curve of falling errors reaches `error`, log-log.

    Parameters
    ----------
    error : float
    errors, seconds : sequence of float
        Points of the curve.

    Returns
    -------
    tuple
        Seconds and a sign: "" inside the curve, "<" if its coarsest point is already better (fewer seconds suffice),
        ">" if its finest point is worse.
    """
    order = np.argsort(errors)
    e = np.asarray(errors, float)[order]
    t = np.asarray(seconds, float)[order]
    sign = "<" if error > e[-1] else ">" if error < e[0] else ""
    return float(np.exp(np.interp(np.log(error), np.log(e), np.log(t)))), sign


def ratio_text(theirs: float, ours: float, sign: str) -> str:
    """Format the ratio of two times, or a bound of it if one of them is a bound.

    Parameters
    ----------
    theirs, ours : float
        [s]
    sign : {"", "<", ">"}
        From `interpolate_seconds`.
    """
    return {"<": "> ", ">": "< ", "": ""}[sign] + f"{theirs / ours:.2g}"
