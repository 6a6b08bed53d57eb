"""Engines that move modes under friction.

In: `core.ModalBasis`, a drive, a contact. Out: histories, events, energies. A module imports its own entry of this list
and the entries before it:

1. `modal_kernels`    the modes as arrays, their motion over a step of a march and the energy it moves
2. `dense_kernels`    small dense systems of the step solves
3. `tableau_kernels`  coefficients of the Runge-Kutta step of order 8
4. `doubling`         a step of stiff modes from a short one
5. `propagator`       exact modal steps under any drive
6. `checkpoint`           a long march goes on from its state on disk
7. `periodicity`          when a motion has become periodic and its rest is known
8. `integrated`       histories of a run from its modal coordinates
9. `cycles`          extremes and phasors of a cycle of samples
10. `curve_points`    places of a curve as close as its bends want
11. `periodic`        Newton's method on the map of an engine over a period
12. `interfaces`        what one interface is to the loop of a march: solve, given, commit, state
13. `events`          exact from event to event: rigid and elastic-plastic elements, or no friction
14. `lanes`             many cases of one mode under a sine side by side; answers of `events` and `smooth` to its bars
15. `march`           any law in time, under the path-mean forces of each step
16. `smooth`          smooth laws by a method of high order from reversal to reversal
17. `harmonic`        steady motions by harmonic balance, branches and stability
18. `limit_cycles` motions that a negative damping keeps up beside friction
19. `grooves`         a load that climbs the flanks of matched grooves

The friction force of a patch over a step comes from `contacts/`, called by the loop of `march/`: for rigid pieces
`element_kernels.solve` (one point stands for all in the law, `friction.laws.stretch_kernels.mean`), for elastic ones
`shear_solve_kernels.descend`, whether the load stays or changes, for lists of bonds `list_kernels.pulled`;
`runs/rig/interface` chooses among them. Read `events` first for motion from event to event, `propagator` for steps.
"""
