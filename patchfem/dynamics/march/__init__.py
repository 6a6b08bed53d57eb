"""Time integration (march) with exact modal motion under friction forces held constant in a step.

Equation. The modal coordinates z follow z'' + 2 zeta omega z' + omega^2 z = (drive - sum_p row_p F_p)/mass, where F_p is
the friction force on port p and row_p gives the slide q_p = row_p z of the port.

Method. Over a step the force of an interface is its path mean: the mean of the law's force along the straight increment
dq of the slide. The modes then move exactly (`dynamics.propagator`), so the increments and the forces solve

    dq = free - beta F(dq),

where `free` are the increments in the absence of friction and beta is the compliance of the ports in a step. The
mean force times dq is exactly the work of the law, so the sum of all energies never grows by itself, for any step. The
method is of second order. The table lists the module that solves the equation.

========================================= ============================ ==============================================
interface                                 module                       method
========================================= ============================ ==============================================
one contact under a constant load         `interfaces`                 Newton's method, by the law
several elements, or elements and contact `faces_kernels`              block descent, then Newton on all forces
set-valued Coulomb elements               `stops_kernels`              stops and releases inside the step
a load that changes                       `pressing_kernels`           path mean of the contact, secant for the coupling
coupled bond points, many cycles          `passing_kernels`            the same, sums instead of samples
========================================= ============================ ==============================================

Events. Smooth laws have none. A set-valued element stops and is released inside a step: the force that would hold it
changes linearly over the step, so an event is the root of a line or a parabola. A list of bonds may overflow its array;
the cycles since the last copy are then repeated with twice the capacity (`capacity`). The remaining cycles of a motion that
is periodic to round-off are skipped (`dynamics.periodicity`).

Failures: an unknown set of stick and slip states, or a residual above 1e-11 of the friction limit, ends the run as
not_converged with a message; a list of bonds beyond two million entries is `Missing`. Cost: 0.1 to 0.3 us per step and a
few ns per point of a contact, so a cycle of 200 steps takes 20 to 60 us, and 150 ns per step for coupled bond points.

Modules. `march` marches a model over its cycles with a `run.Run`, which holds the state and calls the compiled loop;
`recording` keeps its samples, and `cycle_sums` (arrays in `cycle_sum_arrays`) stores sums instead. `models`, `joints` and
`varying_load` describe contacts, elements and loads; `faces` and `element_arrays` have the arrays of the elements.
`instances` compiles one loop per contact, set of laws and load from the source of `loop_kernels`, with the flags of
`parts_kernels`. Read `march` first, then `run`, then `loop_kernels`, then `faces_kernels` or `pressing_kernels` if a rig
needs them.
"""
