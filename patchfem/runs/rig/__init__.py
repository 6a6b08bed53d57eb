"""Coupled run of modes, drive and contact.

In: a Model with a rig, and its pressed patch. Out: a Result. Read `rig` first: the run at the first
numerical settings whose displacement is known to the tolerance, then the passes over it (`postprocessing`).
`runner` makes the run and its coarser ones, each once, and `solve` calls the engine. `engines` has a
record per engine with its coarser runs; `scene.rules.methods.ENGINE_SUPPORT` says what each one can
compute, and `runs.memory` what its compiled code needs. The module of an engine (`march`, `event_driven`,
`smooth`, the folder `steady`) prepares the folder of `dynamics` that integrates (`march`, `events`,
`smooth`, `harmonic`), and states which measures of the last cycles the engine knows itself. `evaluation`
turns this into a Solution, and `levels` goes from level to level. `interface` turns the friction of a
patch into the contact that an engine moves. `numerics` has the numerical settings and `costs` the
predicted cost, on which the choice of an engine, plans and refusals are based; `bond_lists` has the same
for a list of bonds.
"""
