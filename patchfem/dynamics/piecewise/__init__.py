"""Piecewise-linear friction exactly: modes behind elastic-plastic (Jenkins) elements, from one yield to the next.

In: `core.ModalBasis`, a drive in closed form, `elements.Elements` of every interface. Out: a `histories.PieceRun` with
samples, extremes, energies and events, and what its last cycles show (`reading`). Between yields and turning points the
system is linear, so its motion is a series; which elements slip is a prefix of their list sorted by yield slide
(Masing). Read `memory_kernels` first: it is all of the physics.
"""
