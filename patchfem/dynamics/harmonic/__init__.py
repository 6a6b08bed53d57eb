"""Free motions by harmonic balance, and backbones.

The unknowns are the Fourier coefficients of the slides (`equations`); the forces and their derivatives are those of one
period of the laws.

In: `core.ModalBasis`, laws on rows (`forces.LawGroup`). Out: free motions over their amplitude. It refuses rigid
friction, and bonds whose memory is more than one number per row.
Cost: 1 to 10 ms per motion with 15 harmonics and one row.

| to read | module |
|---|---|
| first: the equations | `equations` |
| Fourier series, slides at the nodes of a cycle | `series`, `slides` |
| laws along a cycle, their harmonics | `laws`, `forces` |
| free motions | `backbone`, `quasi_static` |
"""
