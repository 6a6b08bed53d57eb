"""Trial: commands are run and checked in a separate process, so that no crash, hang or leak affects the next trial."""

import contextlib
import io
import json
import math
import os
import re
import shutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

CODES = (0, 2, 3, 4, 130)
PATIENCE = 10.0  # CPU time permitted beyond the plan [s].
LONGEST = 2000  # Longest line that a person can still read [characters].
RAW = re.compile(
    r"Traceback \(most recent|internal fault|\b\w*Warning: |warnings\.warn\(|HDF5-DIAG|Segmentation fault"
)
CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f]")


class TrialFailure(Exception):
    """Raised if the program does something that it must never do."""


class CommandResult(NamedTuple):
    """Result of a command: exit code (negative: the signal that ended it), stdout, stderr."""

    code: int
    out: str
    err: str


class Trial:
    """Trial of a campaign: random numbers, a working folder, and commands that are checked when they end.

    r: random generator of this trial; folder: the empty working folder; command: words -> exit
    code, in this process; tell: called with the current action, so that a crash can be named;
    patience: factor on every limit.
    """

    def __init__(
        self,
        r: np.random.Generator,
        folder: Path,
        command: Callable,
        tell: Callable,
        patience: float = 1.0,
    ):
        self.r = r
        self.folder = folder
        self.command = command
        self.tell = tell
        self.patience = patience

    def run(self, *words, seconds: float = 0.0) -> CommandResult:
        """Run a command in this process and check how it ends.

        It is stopped PATIENCE after the planned `seconds` of CPU time.
        """
        words = [str(word) for word in words]
        self.tell("patchfem " + " ".join(words))
        self.limit(seconds + PATIENCE)
        result = check_result(capture(self.command, words))
        self.limit(0.0)
        return result

    def limit(self, seconds: float) -> None:
        """End this process after some seconds of CPU time, or twenty times as many of elapsed time; 0: never."""
        signal.setitimer(signal.ITIMER_PROF, seconds * self.patience)
        signal.setitimer(signal.ITIMER_REAL, 20 * seconds * self.patience)

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


def capture(command: Callable, words: list) -> CommandResult:
    """Run a command and capture both streams, including output that bypasses Python."""
    saved = [os.dup(1), os.dup(2)]
    with open("/dev/null", "rb") as nothing, contextlib.ExitStack() as stack:
        files = [
            stack.enter_context(
                open(
                    os.memfd_create(name)
                    if hasattr(os, "memfd_create")
                    else os.open(name, os.O_RDWR | os.O_CREAT),
                    "w+b",
                )
            )
            for name in ("out", "err")
        ]
        os.dup2(nothing.fileno(), 0)
        for number, file in enumerate(files, 1):
            os.dup2(file.fileno(), number)
        streams = [
            io.TextIOWrapper(
                io.FileIO(number, "w", closefd=False),
                "utf-8",
                "surrogateescape",
                write_through=True,
            )
            for number in (1, 2)
        ]
        try:
            with contextlib.redirect_stdout(streams[0]), contextlib.redirect_stderr(streams[1]):
                code = _run_and_get_code(command, words)
        finally:
            for number, saved_descriptor in enumerate(saved, 1):
                os.dup2(saved_descriptor, number)
                os.close(saved_descriptor)
        texts = []
        for file in files:
            file.seek(0)
            texts.append(file.read().decode("utf-8", "replace"))
    return CommandResult(code, *texts)


def _run_and_get_code(command: Callable, words: list) -> int:
    """Run a command and return its exit code; 1 for an exception."""
    try:
        return command(words)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 1 if end.code else 0
    except BaseException as error:
        print(
            f"Traceback (most recent call last): {type(error).__name__}: {error}", file=sys.stderr
        )
        return 1


def check_result(result: CommandResult, allowed=CODES) -> CommandResult:
    """Return the result; TrialFailure for a code, a stream or a missing message that no command may end with."""
    lines = [line for line in result.err.splitlines() if line.strip()]
    last = lines[-1][:300] if lines else "no word on stderr"
    if result.code not in allowed:
        raise TrialFailure(f"exit code {result.code}: {last}")
    for stream in (result.out, result.err):
        if found := RAW.search(stream):
            line_start = stream.rfind("\n", 0, found.start()) + 1
            raise TrialFailure(
                f"exit code {result.code}, raw words: {stream[line_start : line_start + 300].splitlines()[0]}"
            )
        if found := CONTROL.search(stream):
            raise TrialFailure(
                f"a control character {found[0]!r} on the screen: "
                f"{stream[max(0, found.start() - 60) : found.end()]!r}"
            )
    if (
        longest := max(map(len, lines), default=0)
        # The limit holds for stderr only; stdout may contain a title or JSON of any length.
    ) > LONGEST:
        raise TrialFailure(f"a line of {longest} characters: {last}")
    if result.code in (2, 3, 4, 130) and not any(len(line) > 12 for line in lines):
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


def run_in_fork(work: Callable, trial: Callable, clock: float) -> str:
    """Run `work(trial)` in a forked process and return the fault, empty if there is none.

    work: function of the campaign; trial: tell -> Trial, called in the child; clock: seconds after
    which the child is killed.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        _run_child(work, trial, writing)
    os.close(writing)
    messages = _read_messages(child, reading, clock)
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(child, signal.SIGKILL)  # The processes that the trial started are ended too.
    _, status = os.waitpid(child, 0)
    doing = next((line[1:] for line in reversed(messages) if line.startswith(">")), "")
    if messages and messages[-1].startswith("="):
        text = messages[-1][1:]
        return text and f"{text} [{doing}]"
    number = os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0
    kind = (
        "hang"
        if number in (signal.SIGPROF, signal.SIGALRM, signal.SIGKILL)
        else f"crash by signal {number}"
    )
    return f"{kind} [{doing}]"


def _run_child(work: Callable, trial: Callable, writing: int) -> None:
    """Run the trial in the forked process, which never returns."""

    def write_message(text: str, mark: str = ">") -> None:
        """Write a message to the parent process."""
        os.write(writing, (mark + " ".join(text.split())[:3000] + "\n").encode("utf-8", "replace"))

    try:
        os.setpgid(0, 0)
        for number in (signal.SIGPROF, signal.SIGALRM):
            signal.signal(number, signal.SIG_DFL)
        own_trial = trial(write_message)
        os.chdir(own_trial.folder)
        work(own_trial)
        own_trial.limit(0.0)
        write_message("", "=")
    except TrialFailure as wrong:
        write_message(str(wrong), "=")
    except BaseException as error:
        traceback = error.__traceback__
        while traceback.tb_next is not None:
            traceback = traceback.tb_next
        write_message(
            f"the trial itself failed: {type(error).__name__}: {error} at {traceback.tb_frame.f_code.co_filename}:"
            f"{traceback.tb_lineno}",
            "=",
        )
    finally:
        os._exit(0)


def _read_messages(child: int, reading: int, clock: float) -> list:
    """Return the lines of the child until it closes its end; the child is killed after `clock` seconds."""
    import select
    from time import monotonic

    end = monotonic() + clock
    text = b""
    while True:
        ready, _, _ = select.select([reading], [], [], max(0.0, end - monotonic()))
        part = os.read(reading, 65536) if ready else b""
        if not part:
            break
        text += part
        if text.rpartition(b"\n")[0].rpartition(b"\n")[2].startswith(b"=") and text.endswith(b"\n"):
            break  # A process that the trial started may keep the pipe open.
    if not ready:
        os.kill(child, signal.SIGKILL)
    os.close(reading)
    return text.decode("utf-8", "replace").splitlines()


def make_empty_folder(folder: Path) -> Path:
    """Make a folder empty, or create it."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder
