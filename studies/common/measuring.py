"""CPU seconds of a part of a study, and its exit code."""

import sys
from time import process_time

from patchfem.core import PatchfemError


def measure_seconds(work) -> tuple:
    """Return the answer of work() and its CPU seconds."""
    start = process_time()
    return work(), process_time() - start


def run(main) -> int:
    """Return the exit code of a study; a named failure is printed as one line on stderr, without a traceback."""
    try:
        main()
    except PatchfemError as error:
        print(error, file=sys.stderr)
        return error.code
    return 0
