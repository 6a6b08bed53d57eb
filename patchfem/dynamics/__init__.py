"""Engines that move modes under friction.

In: `core.ModalBasis`, a drive, a contact. Out: histories, events, energies. `events/` is exact for Coulomb and linear
rigs, `march/` steps any law, `harmonic/` finds steady motions, `comparison/` has the report's own methods (Duhamel,
Newmark, Euler). `periodic` finds a motion that repeats on the map that an engine gives over a period. Read `propagator`
first: exact modal steps that all of them share.

The friction force of a patch over a step comes from `contacts/`, called by the loop of `march/`: for rigid pieces
`element_kernels.solve` (one point stands for all in the law, `friction.laws.stretch_kernels.mean`), for elastic ones
`shear_solve_kernels.descend`, whether the load stays or changes, for lists of bonds `list_kernels.pulled`;
`runs/rig/interface` chooses among them.
"""
