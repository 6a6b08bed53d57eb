"""Steady and free motions by harmonic balance, with solution branches, stability and backbones.

One residual of the Fourier coefficients of the slides (`equations`) serves steady motions, curves through folds and free
motions; the forces and their derivatives are those of one period of the laws.

In: `core.ModalBasis`, a sine, laws on rows (`forces.LawGroup`). Out: `motion.SteadyMotion`, branches of them, backbones.
It refuses rigid friction, and bonds whose memory is more than one number per row.
Cost: 1 to 10 ms per motion with 15 harmonics and one row.

| to read | module |
|---|---|
| first: the equations | `equations` |
| Fourier series, slides at the nodes of a cycle | `series`, `slides` |
| laws along a cycle, their harmonics | `laws`, `forces` |
| one motion, its error, and those that coexist with it | `steady` |
| its amplitude, energies and histories | `motion` |
| curves through folds | `continuation`, `branch` |
| Floquet multipliers | `stability` |
| free motions | `backbone`, `quasi_static` |
"""
