"""Solvers that compute the motion of a modal structure with friction interfaces.

In: `core.ModalBasis`, a drive, a contact. Out: histories, events, energies. A module imports its own
entry of this list and the entries before it:

1. `ledger`           positions in the energy sums and samples of a march
2. `modal_kernels`    motion of the modes over a step of a march, and its energies
3. `dense_kernels`    small dense linear systems
4. `doubling`         step of stiff modes by repeated doubling of a short step
5. `propagator`       exact modal steps under any drive
6. `checkpoint`       checkpoints of a long march on disk
7. `periodicity`      schedule and error bound of the check for a periodic motion
8. `integrated`       time histories of a run from its modal coordinates
9. `cycles`           extremes, phasors and selected samples of the cycles of a march
10. `curve_points`    adaptive points of a curve, denser where its curvature is larger
11. `periodic`        periodic motions by Newton's method on the map of a period (shooting)
12. `interfaces`      contacts of a march: solution of a step and update of their memory
13. `events`          exact motion from event to event: rigid and elastic-plastic elements, or no friction
14. `lanes`           many cases of one mode under sinusoidal drive, side by side
15. `march`           any law in time, under the path-mean forces of each step
16. `harmonic`        steady motions by harmonic balance, branches and stability
17. `limit_cycles`    limit cycles of modes with negative damping and friction
18. `grooves`         interfaces of matched grooves, whose load climbs the flanks

Read `events` first for motion from event to event, `propagator` and `interfaces` for steps of a march.
"""

# Names that other folders use, by module.
PUBLIC = {
    "checkpoint": (
        "CheckpointFiles",
        "MAX_EARLY_SAMPLES",
        "store_checkpoints",
    ),
    "curve_points": ("sample_adaptively",),
    "events.elements": (
        "CELL_MERGES",
        "Elements",
        "join_cells",
        "make_coulomb_elements",
        "make_elements",
        "merge_elements",
        "reset_work",
    ),
    "events.event_list": ("DRIVE_CHANGE",),
    "events.histories": (
        "announce_runs",
        "load_event_kernels",
        "simulate_batch",
    ),
    "events.modal_system": ("make_modal_system",),
    "events.orbits": ("PeriodicMotionFinder",),
    "events.positions_kernels": (
        "InterfaceMeasure",
        "RunMeasure",
    ),
    "events.reading": (
        "Reading",
        "join_readings",
    ),
    "events.steady": ("continue_to_steady_state",),
    "grooves.climbing": ("with_shear_modes",),
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
    "harmonic.orbits": (
        "MAX_CYCLES",
        "estimate_multipliers",
        "march_cycle",
        "march_to_periodic",
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
    "lanes.reading": (
        "measure_runs",
        "run_energies",
    ),
    "lanes.rows_kernels": ("Row",),
    "lanes.run": (
        "Cases",
        "LANES_PACKAGE",
        "MASING_LAWS",
        "LaneResults",
        "continue_march",
        "make_curve_tables",
        "has_one_stretch",
        "law_state",
        "law_number_scales",
        "output_accelerations",
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
    "march.capacity": (
        "copy_state",
        "enlarge_list",
        "is_full",
        "list_bytes",
    ),
    "march.faces": ("STEP_TOL",),
    "march.joints": (
        "JointsModel",
        "make_cubic_spring",
        "make_interlocking_spring",
    ),
    "march.lane_rows": (
        "LANES",
        "N_PIECE_MODES",
        "N_POINTS",
    ),
    "march.lanes": (
        "MarchedCases",
        "PointsCase",
        "can_march",
    ),
    "march.march": (
        "start_run",
        "warm_up",
    ),
    "march.models": (
        "ContactModel",
        "bond_list_model",
        "coulomb_model",
        "element_model",
        "frictionless_model",
        "jenkins_model",
        "load_instances",
        "lower_pressure_fields",
        "point_lists_model",
        "points_model",
    ),
    "march.varying_load": (
        "LawKind",
        "choose_shear_modes",
        "make_bond_lists_law",
        "make_bonds_law",
        "make_contact_sets",
        "make_coulomb_law",
        "make_elastic_plastic_law",
        "make_tanh_law",
    ),
    "periodic": ("is_stable",),
}
