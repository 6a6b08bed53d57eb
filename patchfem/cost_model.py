"""CPU time of a run without that of compiling: the clock that decides whether a run is repeated."""

from time import process_time

COMPILE_CPU_SECONDS = [0.0]  # CPU time [s] in which this process compiled code


def measure_cpu_time() -> float:
    """Return the CPU time [s] of this process without that of compiling, which only the first run on a machine takes."""
    return process_time() - COMPILE_CPU_SECONDS[0]
