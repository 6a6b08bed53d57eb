"""CPU seconds of a part of a study, and its exit code."""

import sys
from time import process_time

import numpy as np

from patchfem.core import PatchfemError


def measure_seconds(work, repeats: int = 1) -> tuple:
    """Return the answer of work() and the median of its CPU seconds."""
    seconds = []
    for _ in range(repeats):
        start = process_time()
        answer = work()
        seconds.append(process_time() - start)
    return answer, float(np.median(seconds))


def run(main) -> int:
    """Return the exit code of a study; a named failure is printed as one line on stderr, without a traceback."""
    try:
        main()
    except PatchfemError as error:
        print(error, file=sys.stderr)
        return error.code
    return 0
