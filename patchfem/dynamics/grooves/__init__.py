"""Rigs whose load rides up the flanks of matched grooves during slip (`friction.grooves`).

Equation. On a flank of slope t(q) the lifted mass m rises with t q', so with the vertical force V
= N + m (t q')' the force against the relative displacement is

    F = V (t + phi)/(1 - phi t),    phi = +-mu_k in slip, between -mu_s and mu_s in stick,

and the energy is stored in the height of the load and in the lifted mass, or dissipated by friction along the flank.

Under Coulomb's law, or a velocity-dependent law, the motion between a stop and the next
release is smooth: the engine `hybrid` finds stops, releases and loss of contact as
events (`hybrid.laws.grooves`, `run`). Laws with memory act along the path on the flank, as a contact
of the march (`climbing`, `contact_kernels`, `points_kernels`).

In: `core.ModalBasis`, a drive, grooves under their load, a friction law. Out: a `MarchResult`. It
rejects a lifted mass whose friction exceeds the inertia of the sliding mass, where the motion is
not unique. Cost: that of the engine `hybrid`, or one Newton iteration more per step than that of
the march.

| to read | module |
|---|---|
| first: the force of the flank | `hybrid.laws.grooves` |
| a run under Coulomb's law | `run` |
| a step under a law with memory | `contact_kernels`, then `points_kernels` |
"""
