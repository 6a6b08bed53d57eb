"""Solvers that compute the motion of a modal structure with friction interfaces.

In: `core.ModalBasis`, a drive, a contact. Out: histories, events, energies. A module imports its own
entry of this list and the entries before it:

1. `integrated`       accelerations and phases of slip of a run
2. `curve_points`     adaptive points of a curve, denser where its curvature is larger
3. `event_list`       log of the events of a run
4. `periodic`         linear systems and Floquet multipliers of periodic motions
5. `harmonic`         steady motions by harmonic balance, branches and stability
6. `limit_cycles`     limit cycles of modes with negative damping and friction

Motion in time is computed by `hybrid` and `points`.
"""

# Names that other folders use, by module.
PUBLIC = {
    "curve_points": ("sample_adaptively",),
    "event_list": (
        "DRIVE_CHANGE",
        "RELEASE",
        "REVERSAL",
        "STOP",
        "EventLog",
    ),
    "harmonic.backbone": ("FreeBalance",),
    "harmonic.balance": (
        "find_cycle_energies",
        "find_regime",
        "make_cycle_response",
    ),
    "harmonic.branch": (
        "find_branches",
        "find_point_between",
        "measure_distance",
        "trace_over_frequency",
    ),
    "harmonic.forces": ("LawGroup",),
    "harmonic.harmonic": (
        "make_linear_part",
        "pack_harmonics",
    ),
    "harmonic.laws": (
        "Interlock",
        "Spring",
        "evaluate_series",
    ),
    "harmonic.point": (
        "find_peak",
        "find_steady_motion",
        "make_balance",
        "refine_steady_motion",
    ),
    "harmonic.quasi_static": (
        "StaticLoops",
        "find_static_motions",
        "find_static_motions_from_loops",
    ),
    "harmonic.stability": ("add_stability",),
    "integrated": (
        "EngineResult",
        "mean_slip_phase",
    ),
    "limit_cycles": (
        "MAX_AMPLITUDE_RATIO",
        "MIN_AMPLITUDE_RATIO",
        "MIN_SLIDING_RATIO",
        "find_balance_cycles",
        "find_relay_cycles",
        "find_unstable_modes",
        "trace_relay_backbone",
    ),
}
