"""CPU times per unit of work, from which the engine of a rig is selected.

The constants were measured on a reference machine with simple scenes and compiled code. The numbers of steps and elements
are counted in `runs.rig.costs`. `measure_cpu_time` is the clock that decides whether a run is repeated.
"""

from time import process_time

# Steps of constant length.
MARCH_CYCLE_SECONDS = 3e-4  # CPU time [s] per cycle of time stepping with elements
MARCH_STEP_SECONDS = 4.3e-7  # CPU time [s] per time step with elements
MARCH_ELEMENT_STEP_SECONDS = 9e-10  # additional CPU time [s] per time step and element
LIST_STRIP_STEP_SECONDS = 2e-6  # CPU time [s] per time step and strip of a list of bonds

# Steps from event to event.
HYBRID_STEP_SECONDS = 4e-6  # CPU time [s] per step from event to event
HYBRID_MODE_PAIR_SECONDS = 4e-8  # additional CPU time [s] per such step and pair of modes
HYBRID_INTERFACE_PAIR_SECONDS = 1e-6  # additional CPU time [s] per such step and pair of interfaces

COMPILE_CPU_SECONDS = [0.0]  # CPU time [s] in which this process compiled code


def measure_cpu_time() -> float:
    """Return the CPU time [s] of this process without that of compiling, which only the first run on a machine takes."""
    return process_time() - COMPILE_CPU_SECONDS[0]
