"""Where the pillars meet: plan and run of a scene.

In: a `Scene`. Out: `Result` with measures, errors, histories and fields. `plan` says what would run, `run` runs it;
`patch/`, `bench/` and `rig/` solve the three kinds, `results/` holds what all of them hand back. Read `run` first.
"""
