"""Event-driven solver: exact motion of modes with rigid (Coulomb) and elastic-plastic elements.

Equation. Between two events the system is linear. With modal coordinates z, the drive a(t) and the
friction forces F of the interfaces,

    z'' + D z' + omega^2 z = -base a(t) - interfaces^T F/m,    F' = stiffness interfaces z',

the motion over a piece of at most MAX_RATE_TIME/(fastest rate) is a power series in time whose
terms follow from this recursion (`series_kernels`). Up to 28 powers are exact to round-off, so
nothing depends on a step size.

Events. A piece ends at the first root of a polynomial: an element yields, the relative
displacement reverses, a rigid element sticks or is released, the drive changes. Bernstein
coefficients prove that no earlier root exists (`search_kernels`). A rigid element that sticks is a
constraint on the modes (`stick_kernels`).

In: `core.ModalBasis`, a drive in closed form, `elements.Elements` of every interface. Out:
`histories.EventRunResult` with samples, extremes, energies and events, and the measures of the last
cycles (`reading`). It refuses friction laws that are not piecewise linear, because `runs` gives it
none.

Cost: 0.2 to 0.5 us per piece of one mode with one interface; a cycle takes about (period times
fastest rate)/2 pieces and one for each event.

| to read | module |
|---|---|
| first: the loop from event to event | `march_kernels` |
| the record of arrays that its kernels take | `modal_system.RunArrays` |
| which elements slip (Masing) | `memory_kernels` |
| which interfaces stick | `stick_kernels` |
| motion of a piece, roots of polynomials | `series_kernels`, `search_kernels` |
| a run with its histories | `histories` |
"""
