"""The coupled run: modes, drive and contact.

In: a Model with a rig, its pressed patch. Out: a Result. Read `rig` first: the engine's Solution, then the passes over
it. `engines` has a record per engine; what each takes stands in `scene.rules.methods.SUPPORT`, what its compiled
code takes in `runs.memory`. An engine's file here (`march`, `pieces`, `smooth`, the folder `steady`) sets
up the folder of `dynamics` that computes (`march`, `events`, `smooth`, `harmonic`) and says what it knows
of the last cycles; `reading` makes the Solution of that, `levels` goes from level to level. `interface` makes the
friction of a patch the contact that an engine moves, `numerics` says how, `costs` at what cost: what the choice of an
engine, a plan and a refusal read; `lists` the same of a list of bonds.
"""
