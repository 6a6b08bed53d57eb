"""Studies with many runs of a scene: fits, error against cost, wear comparisons, sweeps.

Read `cost` first.
"""

# Names that other folders use, by the module that defines them.
PUBLIC = {
    "backbone.curves": ("compute_backbone",),
    "backbone.records": (
        "Backbone",
        "Curve",
    ),
    "compare": (
        "SurfaceRuns",
        "run_both_surfaces",
        "surface_runs_to_dict",
    ),
    "cost": (
        "Cost",
        "TOLERANCE",
        "find_affected_measures",
        "describe_fastest_setting",
        "find_fastest_settings",
        "find_measures_with_error",
        "compute_setting_costs",
        "find_worst_error",
        "find_worst_run_error",
    ),
    "fits.curve": (
        "DEFAULT_STARTS",
        "FittedCurve",
        "fit_curve",
    ),
    "fits.loop": (
        "FittedLoop",
        "fit_hysteresis_loop",
    ),
    "fits.loop_path": ("LoopOptions",),
    "fits.problem": (
        "FittedKeys",
        "parse_ranges",
    ),
    "fits.request": (
        "FitOptions",
        "Listener",
        "choose_kind",
        "fit_measurement",
    ),
    "fits.wear": (
        "FittedCoefficient",
        "COEFFICIENT_KEY",
        "fit_wear",
    ),
    "numerical_settings": (
        "NUMERICAL_SETTINGS",
        "find_applicable_settings",
    ),
    "rows.cells": ("compute_rms_scores",),
    "rows.condition_models": (
        "FitRequest",
        "GAIN_KEYS",
    ),
    "rows.fit": (
        "FittedRows",
        "RowsOptions",
        "SAME_SCORE",
        "fit_rows",
    ),
    "rows.search": (
        "SearchSettings",
        "UNSTABLE",
    ),
    "sweeps.case_models": ("SweepScene",),
    "sweeps.cases": ("Cases",),
    "sweeps.executors.cluster": ("environment_versions",),
    "sweeps.parse_request": (
        "Request",
        "warn_of_invalid_cases",
        "read_cases",
        "read_sweep",
    ),
    "sweeps.plan": ("plan_sweep",),
    "sweeps.sweep": (
        "WorkerData",
        "iterate_chunks",
    ),
}
