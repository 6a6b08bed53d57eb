"""CPU times per unit of work, from which engines are selected and runs that would take too long are refused.

The constants were measured on a reference machine with simple scenes and compiled code. The numbers of steps and elements
are counted in `runs.rig.costs`.
"""

# Steps of constant length.
CYCLE_SECONDS = 3e-4  # CPU time [s] per cycle of time stepping with elements
STEP_SECONDS = 4.3e-7  # CPU time [s] per time step with elements
STEP_ELEMENT_SECONDS = 9e-10  # additional CPU time [s] per time step and element

# Steps from event to event.
HYBRID_STEP_SECONDS = 4e-6  # CPU time [s] per step from event to event
HYBRID_MODES_SECONDS = 4e-8  # additional CPU time [s] per such step and pair of modes
HYBRID_INTERFACES_SECONDS = 1e-6  # additional CPU time [s] per such step and pair of interfaces
