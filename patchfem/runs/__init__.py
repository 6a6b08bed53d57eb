"""Plan and run of a scene: the entry points that use all other folders.

In: a `Scene`. Out: `Result` with measures, histories, fields and error estimates. `plan` says
what would run, `run` runs it. A module imports only its own entry of this list and entries above
it:

1.  `results`  what every run returns, with its notes
2.  `refine`  the loop that repeats a run with a finer resolution until it meets the tolerance
3.  `patch`  a static patch: its grids, its pressure, its measures with error estimates
4.  `bench`  a patch or a point under a prescribed displacement
5.  `joint`  removal of a joint from modes that were measured with it
6.  `rig`  a driven structure with friction
7.  `wear`  wear of a patch in a bench or a rig over many cycles
8.  `findings`  measures that miss the tolerance, the advice that reduces their errors, and balances
9.  `plan`  what would run: engine, unknowns, stiffnesses, memory
10. `run`  from a plan to its result
11. `probe`  one run without error estimates, with its measured time
12. `pieces`  displacement and stress inside both pieces, and where they yield
13. `batch`  many models in one batch
"""

# names that other folders use, by module
PUBLIC = {
    "findings": ("compute_accuracy_curve",),
    "batch.batches": (
        "MIN_CHUNK_CASES",
        "find_group",
        "solve_models",
    ),
    "batch.case_results": (
        "CaseResults",
        "FAILED_OUTCOME",
    ),
    "batch.meshes": (
        "NO_SHARED_MESHES",
        "SharedMeshes",
        "with_shared_meshes",
    ),
    "batch.motion_observer": ("MotionObserver",),
    "bench.engine": (
        "choose_smooth_bond_summation",
        "steps_per_cycle",
    ),
    "joint": ("find_stuck_patch_stiffness",),
    "patch.faces": ("has_error_meshes",),
    "patch.jenkins_elements": ("elements",),
    "patch.mesh_levels": ("solve_with_coarser",),
    "probe": ("run_probe",),
    "patch.result": ("make_piece_meshes_of_run",),
    "patch.values": ("find_contact_intervals",),
    "pieces": (
        "PieceFields",
        "Pieces",
        "add_yielding_notes",
        "compute_pieces",
    ),
    "plan": (
        "DIMENSIONLESS_GROUPS",
        "Plan",
    ),
    "results.patch_rows": (
        "PATCH_TABLE",
        "find_unknown_measures",
    ),
    "results.result": (
        "Result",
        "collect_used_settings",
        "describe_measure",
        "engine_by_measure",
        "patch_surface",
        "shorten_file_names",
    ),
    "rig.decays": (
        "make_laws_on_coarse_meshes",
        "tabulate_static_motions",
        "make_laws_on_mesh",
        "estimate_mesh_error",
        "compute_static_curve",
        "with_automatic_method",
    ),
    "rig.engines": (
        "ENGINES",
        "choose_numerics",
        "find_obstacle_of_map",
    ),
    "rig.plan": (
        "find_drive_and_knee",
        "stuck_stiffnesses",
    ),
    "rig.rig": ("estimate_slide_errors",),
    "run": (
        "StateFile",
        "is_march",
    ),
    "wear.evolve": ("compute_wear",),
}
