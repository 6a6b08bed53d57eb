"""Solvers that compute the motion of a modal structure with friction interfaces.

In: `core.ModalBasis`, a drive, a contact. Out: histories, events, energies. A module imports its own
entry of this list and the entries before it:

1. `curve_points`     adaptive points of a curve, denser where its curvature is larger
2. `harmonic`         free motions by harmonic balance, and quasi-static ones
3. `limit_cycles`     limit cycles of modes with negative damping and friction

Motion in time and steady motions under a drive are computed by `hybrid` and `points`.
"""

# Names that other folders use, by module.
PUBLIC = {
    "curve_points": ("sample_adaptively",),
    "harmonic.backbone": (
        "find_free_motions",
        "make_free_balance",
    ),
    "harmonic.forces": ("LawGroup",),
    "harmonic.laws": ("Spring",),
    "harmonic.quasi_static": (
        "StaticLoops",
        "find_static_motions",
        "find_static_motions_from_loops",
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
