"""Studies with many runs of a scene: fits, error against cost, wear comparisons, sweeps.

Read `cost` first. Fits need `free_keys`, `held_out`, `rows` and `fits`, in this order.
"""

# Names that other folders use, by the module that defines them.
PUBLIC = {
    "backbone.records": (
        "Backbone",
        "Curve",
    ),
    "backbone.request": ("BackboneRequest",),
    "compare": (
        "SurfaceRuns",
        "run_both_surfaces",
        "write_common_traces",
    ),
    "cost": (
        "Cost",
        "Judgement",
        "TOLERANCE_SETTING",
        "compute_costs",
        "describe_best_setting",
    ),
    "fits.curve": ("CurveComparison",),
    "fits.loop": ("LoopComparison",),
    "fits.problem": ("FittedKeys",),
    "fits.request": (
        "FitOptions",
        "Listener",
        "choose_kind",
        "fit_measurement",
    ),
    "fits.rows": ("RowsComparison",),
    "fits.wear": ("DepthComparison",),
    "numerical_settings": ("NUMERICAL_SETTINGS",),
    "surface_pairs": ("read_pairs",),
    "sweeps.case_models": ("SweepScene",),
    "sweeps.cases": ("Cases",),
    "sweeps.parse_request": (
        "CaseRequest",
        "read_cases",
        "read_sweep",
    ),
    "sweeps.sweep": (
        "WorkerData",
        "iterate_chunks",
    ),
}
