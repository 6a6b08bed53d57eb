"""Where the pillars meet: plan and run of a scene.

In: a `Scene`. Out: `Result` with measures, errors, histories and fields. `plan` says what would run, `run` runs it. A
module imports its own entry of this list and the entries before it:

1.  `results`  what every run hands back, with its notes
2.  `cost`  seconds, memory and sentences of a plan, as every step of a run returns them
3.  `patch`  a static patch: its grids, its pressure, its measures with errors
4.  `bench`  a prescribed slide of a patch or a point
5.  `joint`  a pressed patch taken off modes that were measured with it
6.  `rig`  a driven structure that rubs
7.  `wear`  a patch worn by a bench or a rig over many cycles
8.  `accuracy_warnings`  the measures whose errors exceed the tolerance, and the setting that helps
9.  `memory`  the memory that a run may take
10. `tolerance_forecast`  whether a tolerance will be missed, before anything runs
11. `plan`  what would run: engine, sizes, cost
12. `self_checks`  two routes to one number: what a run notices by itself
13. `run`  a plan becomes a result
14. `batch`  many models at once
"""
