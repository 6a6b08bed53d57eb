"""Engines that move modes under friction.

In: `core.ModalBasis`, a drive, a contact. Out: histories, events, energies. A module imports its own
entry of this list and the entries before it:

1. `ledger`           positions in the sums over the steps of a march
2. `modal_kernels`    modes as arrays: their motion over a step of a march, and its energy
3. `dense_kernels`    small dense systems of the steps
4. `tableau_kernels`  coefficients of the Runge-Kutta step of order 8
5. `doubling`         a step of stiff modes from a short one
6. `propagator`       exact modal steps under any drive
7. `checkpoint`       state of a long march on disk
8. `periodicity`      when a motion has become periodic
9. `integrated`       histories of a run from its modal coordinates
10. `cycles`           extremes and phasors of a cycle of samples
11. `curve_points`    points of a curve as dense as its curvature needs
12. `periodic`        Newton's method on the map of an engine over a period
13. `interfaces`      what one interface is to the loop of a march
14. `events`          exact motion from event to event: rigid and elastic-plastic elements, or no friction
15. `lanes`           many cases of one mode under a sine, side by side
16. `march`           any law in time, under the path-mean forces of each step
17. `smooth`          smooth laws by a method of high order from reversal to reversal
18. `harmonic`        steady motions by harmonic balance, branches and stability
19. `limit_cycles`    motions that a negative damping keeps up beside friction
20. `grooves`         a load that climbs the flanks of matched grooves

Read `events` first for motion from event to event, `propagator` and `interfaces` for steps of a march.
"""
