"""Studies with many runs of a scene: fits, error against cost, wear comparisons, sweeps.

Read `cost` first. Fits need `free_keys`, `held_out`, `rows` and `fits`, in this order.
"""

# Names that other folders use, by the module that defines them.
PUBLIC = {
    "cost": (
        "Cost",
        "compute_costs",
        "describe_best_setting",
    ),
    "sweeps.case_models": ("SweepScene",),
    "sweeps.cases": ("Cases",),
    "sweeps.parse_request": (
        "CaseRequest",
        "read_cases",
    ),
    "sweeps.sweep": (
        "WorkerData",
        "iterate_chunks",
    ),
}
