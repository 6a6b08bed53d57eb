"""Engines that move modes under friction.

In: `core.ModalBasis`, a drive, a contact. Out: histories, events, energies. A module imports its own
entry of this list and the entries before it:

1. `modal_kernels`    modes as arrays: their motion over a step of a march, and its energy
2. `dense_kernels`    small dense systems of the steps
3. `tableau_kernels`  coefficients of the Runge-Kutta step of order 8
4. `doubling`         a step of stiff modes from a short one
5. `propagator`       exact modal steps under any drive
6. `checkpoint`       state of a long march on disk
7. `periodicity`      when a motion has become periodic
8. `integrated`       histories of a run from its modal coordinates
9. `cycles`           extremes and phasors of a cycle of samples
10. `curve_points`    points of a curve as dense as its curvature needs
11. `periodic`        Newton's method on the map of an engine over a period
12. `interfaces`      what one interface is to the loop of a march
13. `events`          exact motion from event to event: rigid and elastic-plastic elements, or no friction
14. `lanes`           many cases of one mode under a sine, side by side
15. `march`           any law in time, under the path-mean forces of each step
16. `smooth`          smooth laws by a method of high order from reversal to reversal
17. `harmonic`        steady motions by harmonic balance, branches and stability
18. `limit_cycles`    motions that a negative damping keeps up beside friction
19. `grooves`         a load that climbs the flanks of matched grooves

Read `events` first for motion from event to event, `propagator` and `interfaces` for steps of a march.
"""
