"""Computation of the measures of a run: values with names, units and errors.

In: histories of a run, and measures that its engine integrated over the last cycles. Out: measures by name with errors
from coarse runs, the outcome, and the stick-slip events. Read `rows` first: each row of its table evaluates a
`LastCycles`. A value that the engine integrated replaces the value from samples. `measures` has the
functions that evaluate samples.
"""

# Names that other folders use, by module.
PUBLIC = {
    "decay_curve": (
        "DecayCurve",
        "HalfCycles",
        "MIN_HALF_CYCLE_RATIO",
        "fit_decay_curve",
        "locate_reversals",
        "make_half_cycles",
        "measure_last_cycle_amplitude",
        "smooth_slopes",
    ),
    "errors": (
        "CoarserRuns",
        "ERROR_MEASURES",
        "absolute_change",
        "add_errors",
        "add_run_error_estimates",
        "convergence_errors",
        "estimate_errors",
        "estimate_sampling_errors",
        "edge_errors",
        "finer_errors",
        "friction_errors",
        "list_step_runs",
        "second_order_errors",
        "total_error",
    ),
    "events": (
        "EVENT_KIND_NAMES",
        "Events",
        "SEGMENT_BORDER",
        "classify_changes",
        "compute_stuck_vibration",
        "find_segment_borders",
        "is_all_stuck",
        "join_events",
        "select_strongest",
        "sort_events",
    ),
    "levels": (
        "Level",
        "bracket_onset",
        "make_no_onset_reason",
        "make_onset_test",
    ),
    "loops": (
        "CycleLoop",
        "find_reversals",
        "interface_loop",
        "mean_half_range",
        "reversal_force_rule",
        "sample_loop",
        "secant_stiffness",
    ),
    "measures": (
        "compute_ledger_measures",
        "compute_step_harmonic",
        "peak_sampling_errors",
        "relative_gap",
        "work_difference",
    ),
    "outcome": (
        "AMPLITUDE_ROUND_OFF",
        "OPEN_LOOP_MESSAGE",
        "describe_ringing",
        "find_ringing",
        "is_ringing_visible",
        "note_on_changing_drive",
        "is_drifting",
        "judge_outcome",
        "remove_errors",
    ),
    "reasons": (
        "CHANGE_NOT_RESOLVED_REASON",
        "MAX_OTHER_MODES_FRACTION",
        "STICKS_AT_REVERSAL_REASON",
        "find_invalid",
        "find_missing",
        "find_missing_unbounded",
    ),
    "rows": (
        "AMPLITUDE",
        "STEADY_AMPLITUDE",
        "INTERNAL_VALUES",
        "LastCycles",
        "MOTION_TABLE",
        "compute_measures",
        "error_floor",
        "find_definition",
        "larger_term",
        "select_names",
        "set_final_floors",
    ),
    "settling": (
        "MOTION_CLASSES",
        "MotionEnds",
        "judge_motions",
        "measure_windows",
        "remaining_ringing",
        "select_reported",
        "slip_period",
    ),
    "spectrum": (
        "read_instrument",
        "make_acceleration_measures",
    ),
    "stationary": (
        "compute_spectra",
        "warn_if_short",
    ),
    "welch": (
        "average_segments",
        "transform_segments",
    ),
}
