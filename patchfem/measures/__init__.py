"""Computation of the measures of a run: values with names, units and errors.

In: histories of a run, and measures that its engine integrated over the last cycles. Out: measures by name with errors
from coarse runs, the outcome, and the stick-slip events. Read `rows` first: each row of its table evaluates a
`LastCycles`. A value that the engine integrated replaces the value from samples. `measures` has the
functions that evaluate samples.
"""

# Names that tests and scripts import from the folder, by module.
PUBLIC = {
    "decay_curve": ("DecayCurve", "fit_decay_curve", "locate_reversals", "make_half_cycles"),
    "errors": ("ERROR_MEASURES", "estimate_convergence_errors"),
    "events": ("EVENT_KIND_NAMES", "DriveLevel", "bracket_onset", "make_onset_test"),
    "measures": ("compute_step_harmonic",),
    "reasons": ("STICKS_AT_REVERSAL_REASON", "find_invalid"),
    "rows": (
        "AMPLITUDE",
        "INTERNAL_VALUES",
        "MOTION_TABLE",
        "find_error_floor",
        "set_final_floors",
    ),
    "spectrum": ("read_instrument",),
}
