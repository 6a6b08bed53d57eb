"""Steady motions by harmonic balance, with solution branches and stability.

Equation. With theta = omega t every coordinate is Re sum_k Z_k exp(i k theta), k = 0 to H. The
modes are condensed to the rows of the interfaces: for every harmonic

    Q_k = Q_k(drive) - G_k F_k,    G_k = rows (Omega^2 - k^2 omega^2 + i k omega D)^-1 rows^T/m,

with the slides Q and the forces F of the laws along a cycle (alternating frequency and time).
Newton's method solves for Q; harmonics above H follow from the force and show what H leaves out.

Turning points of the slides are those of the harmonics, not samples, so the memory of a law is
that of the continuous motion. Floquet multipliers come from the slopes of the laws, cell by cell.
Where a balance is not possible, a march is brought to its periodic motion by extrapolation
(`orbits`).

In: `core.ModalBasis`, a sine, laws on rows (`forces.LawGroup`). Out: `point.SteadyMotion`, branches of
them, backbones. It refuses rigid friction, and bonds whose memory is more than one number per row.
Cost: 1 to 10 ms per motion with 15 harmonics and one row.

| to read | module |
|---|---|
| first: the equations | `harmonic` |
| laws along a cycle | `laws`, `forces` |
| one motion, and its error | `point` |
| curves through folds | `continuation`, `branch` |
| multipliers | `stability`, `floquet` |
| free motions | `backbone`, `quasi_static` |
| a motion as histories and energies | `balance` |
"""
