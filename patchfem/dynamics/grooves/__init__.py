"""A rig whose load climbs the flanks of matched grooves as it slides (`friction.grooves`).

In: `core.ModalBasis`, a drive, grooves under their load, a law of friction. Out: a `MarchResult`, as the march gives
it. Under Coulomb's law, or a force that follows the speed, the motion between a stop and the next release is smooth:
eq. 3.4 with the force of the flank, by the integrator of `dynamics.smooth`. Read `flank_kernels`, the force as a law
that holds; `run`, which samples the motion. Laws with memory are a contact of the march, `climbing` and
`contact_kernels`, of points (`points_kernels`).
"""
