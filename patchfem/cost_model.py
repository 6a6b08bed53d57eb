"""CPU times per unit of work, from which engines are selected and runs that would take too long are refused.

The constants were measured on a reference machine with simple scenes and compiled code. The numbers of steps, pieces and
strips are counted in `runs.rig.costs`, `runs.rig.bond_lists` and `friction.bonds.engines`.
"""

# Steps of constant length.
CYCLE_SECONDS = 3e-4  # CPU time [s] per cycle of time stepping with elements
STEP_SECONDS = 4.3e-7  # CPU time [s] per time step with elements
STEP_ELEMENT_SECONDS = 9e-10  # additional CPU time [s] per time step and element

# Steps from event to event.
HYBRID_STEP_SECONDS = 4e-6  # CPU time [s] per step from event to event
HYBRID_MODES_SECONDS = 4e-8  # additional CPU time [s] per such step and pair of modes
HYBRID_INTERFACES_SECONDS = 1e-6  # additional CPU time [s] per such step and pair of interfaces

# Lists of bonds, which are evaluated in one or more passes per time step.
# CPU time [s] per strip and pass, by the form of the list (`friction.bonds.list_rows_kernels`)
STRIP_SECONDS = (3e-9, 2e-9, 3e-9)
# CPU time [s] per strip and pass for an order that requires a power function
ANY_ORDER_STRIP_SECONDS = 2.5e-8
PASS_SECONDS = 1.5e-7  # CPU time [s] per pass through a list, in addition to its strips
LIST_STEP_SECONDS = 5e-7  # CPU time [s] per time step with a list, in addition to its passes
RECURSION_STEP_SECONDS = 3e-8  # CPU time [s] per time step of the recursion
