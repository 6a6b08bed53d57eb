"""Plan and run of a scene: the entry points that use all other folders.

In: a `Scene`. Out: `Result` with measures, histories, fields and error estimates. `plan` says
what would run, `run` runs it. A module imports only its own entry of this list and entries above
it:

1.  `results`  what every run returns, with its notes
2.  `refine`  the loop that repeats a run with a finer resolution until it meets the tolerance
3.  `patch`  a static patch: its grids, its pressure, its measures with error estimates
4.  `interfaces`  interfaces of a bench or a rig: laws, loads, contact points
5.  `bench`  a patch or a point under a prescribed displacement
6.  `joint`  removal of a joint from modes that were measured with it
7.  `rig`  a driven structure with friction
8.  `wear`  wear of a patch in a bench or a rig over many cycles
9.  `findings`  measures that miss the tolerance, the advice that reduces their errors, and balances
10. `plan`  what would run: engine, unknowns, stiffnesses, memory
11. `run`  from a plan to its result
12. `probe`  one run without error estimates, with its measured time
13. `pieces`  displacement and stress inside both pieces, and where they yield
14. `batch`  many models in one batch
"""

# names that tests and scripts import from the folder, by module
PUBLIC = {
    "findings": ("compute_accuracy_curve",),
    "batch.case_results": ("CaseResults", "FAILED_OUTCOME"),
    "patch.case_meshes": ("solve_with_coarser",),
    "pieces": ("PieceFields", "PieceFrames", "compute_pieces"),
    "results.patch_rows": ("PATCH_TABLE",),
    "results.result": ("describe_measure",),
    "rig.engines": ("choose_numerics",),
    "rig.plan": ("find_drive_and_knee",),
    "wear.evolve": ("compute_wear",),
}
