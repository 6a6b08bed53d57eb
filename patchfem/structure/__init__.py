"""Modes of a rig, the drives that excite them, and their initial conditions.

In: frequencies, masses and springs, matrices, or the mode shapes of a modal test. Out: a `core.ModalBasis`, starts, and
drives with their signals. The modal coordinates follow
z_i'' + 2 zeta_i w_i z_i' + w_i^2 z_i = G_i + g_i (3.4). Read `matrices` first for modes, and `drives` for
signals.
"""

# Names that other folders use, by module
PUBLIC = {
    "arrays": ("read_arrays",),
    "drive_sizes": (
        "DriveKeys",
        "choose_samples_per_cycle",
        "count_cycles",
        "count_cycles_per_level",
        "count_repeat_cycles",
        "estimate_peak_speed",
        "find_decay_rate",
        "find_drive_omega",
        "find_first_period",
        "find_max_acceleration",
        "find_max_frequency_ratio",
        "find_min_decay_rate",
        "has_full_cycle",
        "is_periodic",
        "is_sinusoidal",
    ),
    "drives": ("make_release",),
    "exponentials": ("exponential",),
    "histories": (
        "INTERFACE_HISTORIES",
        "find_accelerations",
        "make_response",
    ),
    "places": (
        "DIRECTION_NAMES",
        "note_missing_mass",
    ),
    "reduced": (
        "CRAIG_BAMPTON",
        "reduce_matrices",
    ),
    "response": ("compute_receptance",),
    "starts": (
        "start_at_rest",
        "start_from_base_step",
        "start_from_output_displacement",
        "start_from_values",
    ),
    "universal": ("read_universal",),
}
