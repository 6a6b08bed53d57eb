"""Identification of parameters and modes from measurements, with 95 % confidence intervals.

In: a residual as a function of parameters, or time records. Out: fitted values with intervals, and the
parameters that the data do not determine; frequencies, damping ratios and shapes of modes. Read
`least_squares` first for fits of any model, and `measured_modes` for modes.
"""

# Names that other folders use, by module.
PUBLIC = {
    "least_squares": ("Problem",),
    "measured_modes": (
        "compute_decay_curve",
        "identify_decay_modes",
        "identify_driven_modes",
    ),
    "fit_sentences": ("advise_test", "describe_fit"),
}
