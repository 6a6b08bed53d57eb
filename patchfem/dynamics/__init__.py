"""Engines that move modes under friction.

In: `core.ModalBasis`, a drive, a contact. Out: histories, events, energies. A module imports its own
entry of this list and the entries before it:

1. `ledger`           positions in the sums over the steps of a march
2. `modal_kernels`    modes as arrays: their motion over a step of a march, and its energy
3. `dense_kernels`    small dense systems of the steps
4. `tableau_kernels`  coefficients of the Runge-Kutta step of order 8
5. `doubling`         a step of stiff modes from a short one
6. `propagator`       exact modal steps under any drive
7. `checkpoint`       state of a long march on disk
8. `periodicity`      when a motion has become periodic
9. `integrated`       histories of a run from its modal coordinates
10. `cycles`           extremes and phasors of a cycle of samples
11. `curve_points`    points of a curve as dense as its curvature needs
12. `periodic`        Newton's method on the map of an engine over a period
13. `interfaces`      what one interface is to the loop of a march
14. `events`          exact motion from event to event: rigid and elastic-plastic elements, or no friction
15. `lanes`           many cases of one mode under a sine, side by side
16. `march`           any law in time, under the path-mean forces of each step
17. `smooth`          smooth laws by a method of high order from reversal to reversal
18. `harmonic`        steady motions by harmonic balance, branches and stability
19. `limit_cycles`    motions that a negative damping keeps up beside friction
20. `grooves`         a load that climbs the flanks of matched grooves

Read `events` first for motion from event to event, `propagator` and `interfaces` for steps of a march.
"""

# names that other folders use, by module
PUBLIC = {
    "checkpoint": (
        "CheckpointFiles",
        "MAX_EARLY_SAMPLES",
        "store_checkpoints",
    ),
    "curve_points": ("sample_adaptively",),
    "events.cost": ("estimate_cycle_time",),
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
        "is_loop_cached",
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
    "events.steady": ("find_steady_state_from",),
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
        "find_point",
        "make_balance",
        "refine_point",
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
        "reading_of_runs",
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
        "pair_plane_joints",
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
        "PLASTIC",
        "POINTS",
        "choose_shear_modes",
        "make_bond_lists_law",
        "make_bonds_law",
        "make_contact_sets",
        "make_coulomb_law",
        "make_elastic_plastic_law",
        "make_tanh_law",
    ),
    "periodic": ("is_stable",),
    "smooth.run": ("load_loop",),
}
