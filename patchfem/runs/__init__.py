"""Where the pillars meet: plan and run of a scene.

In: a `Scene`. Out: `Result` with measures, errors, histories and fields. `plan` says what would run, `run` runs it. A
module imports its own entry of this list and the entries before it:

1. `results`   what every run hands back, with its notes
2. `patch`     a static patch: its grids, its pressure, its measures with errors
3. `bench`     a prescribed slide of a patch or a point
4. `joint`     a pressed patch taken off modes that were measured with it
5. `rig`       a driven structure that rubs
6. `wear`      a patch worn by a bench or a rig over many cycles
7. `remedies`  the measures that miss the tolerance, and what cures them
8. `memory`    what a run takes
9. `tolerance_forecast`  whether a tolerance will be missed, before anything runs
10. `plan`     what would run: engine, sizes, cost
11. `self_checks`  two routes to one number: what a run notices by itself
12. `run`      a plan becomes a result
13. `many`     many models at once
"""
