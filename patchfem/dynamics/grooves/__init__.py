"""A rig whose load climbs the flanks of matched grooves as it slides (`friction.grooves`).

In: `core.ModalBasis`, a drive, grooves under their load, Coulomb's law or a force that follows the speed. Out: a
`MarchResult`, as the march gives it. Between a stop and the next release the motion is smooth: eq. 3.4 with the force
of the flank, by a Runge-Kutta method whose steps the error chooses. Every stop, every release and every sample is the
end of a step. Read `run`, then `loop_kernels`: where steps end; `step_kernels`: the force of the flank, one step.
"""
