"""The event engine: modes behind rigid (Coulomb) and elastic-plastic (Jenkins) elements, from one event to the next.

In: `core.ModalBasis`, a drive in closed form, `elements.Elements` of every interface; the first may be rigid. Out:
a `histories.PieceRun` with samples, extremes, energies and events, and what its last cycles show (`reading`). Between
stops, releases, yields and turning points the system is linear, so its motion is a series (`series_kernels`); a rigid
element that holds is a constraint in it. Read `march_kernels.march` first, the loop; then `memory_kernels`, which
elements slip (a prefix of their list sorted by yield slide, Masing), and `stick_kernels`, which interfaces hold.
"""
