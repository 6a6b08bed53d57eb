"""The torture driver detects planted faults, so that a passing campaign means something."""

import faulthandler
import os
import signal
import sys
import time

import numpy as np
import pytest
from torture.trial import Trial, capture, run_in_fork

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="a trial is a forked process")


def run_trial(tmp_path, command, work=lambda trial: trial.run("run", "x.toml"), patience=0.02):
    """Return the message of the driver about a command under one trial, or an empty string if there
    is no fault."""
    return run_in_fork(
        work,
        lambda report: Trial(np.random.default_rng(0), tmp_path, command, report, patience),
        20.0,
    )


def make_printing_command(text, code=2):
    """Return a command that prints a text on stderr and returns an exit code."""

    def command(arguments):
        print(text, file=sys.stderr)
        return code

    return command


def crash(arguments):
    """Stop the process by a segmentation fault."""
    faulthandler.disable()
    os.kill(os.getpid(), signal.SIGSEGV)


def loop_for_a_minute(arguments):
    """Use 60 CPU seconds, which is longer than a trial may take."""
    end = time.process_time() + 60
    while time.process_time() < end:
        pass


def raise_error(arguments):
    """Raise an exception that the command does not handle."""
    raise ValueError("no word of this was meant for a person")


PLANTED = {
    "a traceback": (raise_error, "exit code 1: Traceback"),
    "an internal fault": (
        make_printing_command("patchfem: internal fault, please report it", 1),
        "exit code 1",
    ),
    "a code of no meaning": (make_printing_command("something went wrong here", 7), "exit code 7"),
    "a crash": (crash, "crash by signal 11"),
    "no end": (loop_for_a_minute, "hang"),
    "a raw warning": (
        make_printing_command("x.py:3: RuntimeWarning: overflow encountered", 0),
        "RuntimeWarning",
    ),
    "no word": (make_printing_command("no", 2), "without a helpful line"),
    "a line of 3000": (make_printing_command("x" * 3000), "a line of 3000 characters"),
    "an escape": (make_printing_command("title \x1b[31m of a file"), "control character"),
}


@pytest.mark.parametrize("fault", PLANTED)
def test_always_planted_faults_are_detected(tmp_path, fault):
    """The driver reports each planted fault together with the command line that caused it."""
    command, expected = PLANTED[fault]
    message = run_trial(tmp_path, command)
    assert expected in message and message.endswith("[patchfem run x.toml]")


def test_exact_clear_refusal_is_no_fault(tmp_path):
    """A refusal with a clear message is not reported as a fault."""
    assert (
        run_trial(tmp_path, make_printing_command("scene.toml:3: drive.wavform: unknown key")) == ""
    )


def test_always_error_inside_trial_is_reported(tmp_path):
    """An exception in the code of a trial is reported as a failure of the trial."""
    assert run_trial(tmp_path, make_printing_command("", 0), lambda trial: 1 / 0).startswith(
        "the trial itself failed: ZeroDivisionError"
    )


def test_always_stdout_and_stderr_are_captured(tmp_path):
    """The driver captures output of Python and of C code, on both streams, and the exit code."""

    def command(arguments):
        os.write(2, b"from C\n")
        print("from Python")
        return 3

    assert capture(command, []) == (3, "from Python\n", "from C\n")
