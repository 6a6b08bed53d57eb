"""Values and modes identified from measurements, with 95 % intervals.

In: a residual as a function of parameters, or records over time. Out: best values with intervals, and what
the data do not determine; frequencies, damping ratios and shapes of modes. Read `least_squares` first for
fits of any model, and `measured_modes` for modes.
"""
