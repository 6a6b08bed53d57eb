"""Trial: random draws, and commands that are run in this process and checked when they end."""

import json
import math
import re
import signal
from contextlib import contextmanager
from pathlib import Path
from time import process_time

import numpy as np
from command_line import CommandResult, run_cli

CODES = (0, 2, 3, 4, 130)
PATIENCE = 60.0  # Time permitted beyond the plan [s], compilation included.
LONGEST = 2000  # Longest line that a person can still read [characters].
RAW = re.compile(
    r"Traceback \(most recent|internal fault|\b\w*Warning: |warnings\.warn\(|HDF5-DIAG|Segmentation fault"
)
CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f]")


class TrialFailure(BaseException):
    """Raised if the program does something that it must never do; the program itself must not catch it."""


class Trial:
    """Trial of a campaign: random numbers, and commands in an empty working folder.

    r: random generator of this trial; folder: the working folder, None if no command is run.
    """

    def __init__(self, r: np.random.Generator, folder: Path | None = None):
        self.r = r
        self.folder = folder

    def run(self, *words, seconds: float = 0.0) -> CommandResult:
        """Run a command, check how it ends, and stop it PATIENCE after the planned `seconds`."""
        with limit_time(seconds + PATIENCE):
            result = run_cli(*words)
        return check_result(result)

    def planned_seconds(self, file) -> float | None:
        """Return the rough CPU time [s] of a scene; None if `plan` refuses it."""
        from patchfem.api import load, plan

        from .effort import estimate_seconds

        if self.run("plan", file, "--json").code != 0:
            return None
        return estimate_seconds(plan(load(self.folder / file)))

    def draw(self, *choices):
        """Return one of the choices at random."""
        return choices[int(self.r.integers(len(choices)))]

    def chance(self, probability: float) -> bool:
        """Return True with the probability `probability`."""
        return bool(self.r.random() < probability)

    def log_uniform(self, low: float, high: float) -> float:
        """Return a log-uniform number between low and high > 0 with four digits."""
        return float(f"{math.exp(self.r.uniform(math.log(low), math.log(high))):.4g}")


@contextmanager
def limit_time(seconds: float):
    """Raise TrialFailure if the block takes longer than some seconds of CPU time, or waits as long without any."""
    begin = last = process_time()

    def stop(*_):
        nonlocal last
        now = process_time()
        if now - begin > 0.9 * seconds or now - last < 0.01 * seconds:
            raise TrialFailure(f"no end after {seconds:.0f} s")
        last = now

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def check_result(result: CommandResult) -> CommandResult:
    """Return the result; TrialFailure for a code, a stream or a missing message that no command may end with."""
    lines = [line for line in result.err.splitlines() if line.strip()]
    last = lines[-1][:300] if lines else "no word on stderr"
    if result.code not in CODES:
        raise TrialFailure(f"exit code {result.code}: {last}")
    for stream in (result.out, result.err):
        for pattern, name in ((RAW, "raw words"), (CONTROL, "a control character")):
            if found := pattern.search(stream):
                part = stream[max(0, found.start() - 60) : found.end() + 200]
                raise TrialFailure(f"exit code {result.code}, {name}: {part!r}")
    # stdout may contain a title or JSON of any length.
    longest = max(map(len, lines), default=0)
    if longest > LONGEST:
        raise TrialFailure(f"a line of {longest} characters: {last}")
    if result.code and not any(len(line) > 12 for line in lines):
        raise TrialFailure(f"exit code {result.code} without a helpful line: {last}")
    return result


def parse_strict_json(text: str) -> dict:
    """Return parsed JSON; TrialFailure if it is invalid or contains NaN or infinity."""

    def reject_constant(name):
        """Raise TrialFailure for NaN or infinity."""
        raise TrialFailure(f"{name} in JSON")

    try:
        return json.loads(text, parse_constant=reject_constant)
    except ValueError as error:
        raise TrialFailure(f"not JSON: {error}: {text[:80]!r}") from None
