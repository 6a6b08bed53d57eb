"""Solvers that compute the motion of a modal structure with friction interfaces.

In: `core.ModalBasis`, a drive, a contact. Out: histories, events, energies. A module imports its own
entry of this list and the entries before it:

1. `curve_points`     adaptive points of a curve, denser where its curvature is larger
2. `harmonic`         steady motions by harmonic balance, and their branches
3. `limit_cycles`     limit cycles of modes with negative damping and friction

Motion in time, and the stability of steady motions, are computed by `hybrid` and `points`.
"""

# Names that other folders use, by module.
PUBLIC = {
    "curve_points": ("sample_adaptively",),
    "harmonic.backbone": (
        "find_free_motions",
        "make_free_balance",
    ),
    "harmonic.branch": (
        "find_point_between",
        "measure_distance",
        "trace_over_frequency",
    ),
    "harmonic.forces": ("LawGroup",),
    "harmonic.laws": ("Spring",),
    "harmonic.motion": (
        "find_cycle_energies",
        "find_regime",
        "make_cycle_response",
    ),
    "harmonic.quasi_static": (
        "StaticLoops",
        "find_static_motions",
        "find_static_motions_from_loops",
    ),
    "harmonic.steady": (
        "find_steady_motion",
        "list_coexisting_slides",
        "refine_steady_motion",
    ),
    "limit_cycles": (
        "MAX_CYCLE_RATIO",
        "MIN_CYCLE_RATIO",
        "MIN_SLIDING_RATIO",
        "find_balance_cycles",
        "find_relay_cycles",
        "find_unstable_modes",
        "trace_relay_backbone",
    ),
}
