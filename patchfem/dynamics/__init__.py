"""Engines that move modes under friction.

In: `core.ModalBasis`, a drive, a contact. Out: histories, events, energies. `events/` is exact for Coulomb and linear
rigs, `march/` steps any law, `harmonic/` finds steady motions, `comparison/` has the report's own methods (Duhamel,
Newmark, Euler). Read `propagator` first: exact modal steps that all of them share.
"""
