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
9.  `accuracy_curve`  accuracy of a motion against its computing time
10. `memory`  the memory that a run may use
11. `tolerance_forecast`  whether a tolerance will be missed, before anything runs
12. `plan`  what would run: engine, sizes, cost
13. `self_checks`  two computations of one number, by which a run detects faults
14. `run`  from a plan to its result
15. `batch`  many models at once
"""

# names that other folders use, by module
PUBLIC = {
    "accuracy_curve": ("compute_accuracy_curve",),
    "batch.batches": (
        "batch_compile_seconds",
        "choose_batch",
        "solve_models",
    ),
    "batch.case_results": (
        "CaseResults",
        "FAILED_OUTCOME",
    ),
    "batch.meshes": (
        "SharedMeshes",
        "with_shared_meshes",
    ),
    "batch.motion_observer": ("MotionObserver",),
    "bench.engine": (
        "choose_smooth_bond_summation",
        "steps_per_cycle",
    ),
    "bench.errors": ("estimate_bench_errors",),
    "bench.ledger": ("BenchOptions",),
    "joint": (
        "remove_joint",
        "stuck_patch_stiffness",
    ),
    "patch.faces": (
        "NO_ERROR_ESTIMATE",
        "has_error_meshes",
        "static_measures_without_errors",
    ),
    "patch.jenkins_elements": (
        "elements",
        "strip_elements",
    ),
    "patch.mesh_levels": (
        "solve_with_coarser",
        "solve_on_split_mesh",
    ),
    "patch.measures": ("estimate_static_measures",),
    "patch.sweep_meshes": ("geometry_key",),
    "patch.press": ("nodal_areas",),
    "patch.result": ("make_piece_meshes_of_run",),
    "patch.strength": (
        "Strength",
        "YIELDING_NEGLECTED",
        "yield_strength",
    ),
    "patch.values": (
        "contact_ends",
        "contact_intervals",
    ),
    "plan": (
        "GROUPS",
        "Plan",
        "describe_compile_time",
    ),
    "results.patch_rows": (
        "TABLE",
        "minimum_value",
        "find_unknown_measures",
    ),
    "results.result": (
        "Result",
        "collect_used_settings",
        "describe_measure",
        "measure_engines",
        "patch_surface",
        "shorten_file_names",
    ),
    "rig.costs": ("count_merges",),
    "rig.decays": (
        "make_laws_on_coarse_meshes",
        "tabulate_static_motions",
        "make_laws_on_mesh",
        "estimate_mesh_error",
        "estimate_decay_mesh_errors",
        "describe_unknown_mesh_errors",
        "compute_static_curve",
        "with_automatic_method",
    ),
    "rig.engines": (
        "ENGINES",
        "PIECES",
        "SMOOTH",
        "collect_motion_features",
    ),
    "rig.numerics": ("choose_numerics",),
    "rig.event_driven": ("YieldingElements",),
    "rig.plan": (
        "find_drive_and_knee",
        "stuck_stiffnesses",
    ),
    "rig.solve": ("solve_rig",),
    "run": (
        "StateFile",
        "is_march",
    ),
    "wear.evolve": ("compute_wear",),
}
