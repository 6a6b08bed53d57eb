"""Plan and run of a scene: the entry points that use all other folders.

In: a `Scene`. Out: `Result` with measures, errors, histories and fields. `plan` predicts what
would run, `run` runs it. A module imports only its own entry of this list and entries above it:

1.  `results`  what every run returns, with its notes
2.  `cost`  seconds, memory and sentences of a plan, as every step of a run returns them
3.  `patch`  a static patch: its grids, its pressure, its measures with errors
4.  `bench`  a prescribed slide of a patch or a point
5.  `joint`  a pressed patch removed from modes that were measured with it
6.  `rig`  a driven structure with friction
7.  `wear`  a patch worn by a bench or a rig over many cycles
8.  `accuracy_warnings`  measures whose errors exceed the tolerance, and the setting that helps
9.  `memory`  the memory that a run may use
10. `tolerance_forecast`  whether a tolerance will be missed, before anything runs
11. `plan`  what would run: engine, sizes, cost
12. `self_checks`  two computations of one number, by which a run detects faults
13. `run`  from a plan to its result
14. `batch`  many models at once
"""
