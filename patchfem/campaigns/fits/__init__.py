"""Fits of scene parameters to measurements.

In: a scene, ranges of its free parameters, and a measurement: a friction loop (`loop`), frequency and damping as functions
of amplitude (`curve`) or a worn depth (`wear`); `campaigns.rows` fits a rig to a table of responses. Out: fitted values with
95 % confidence intervals and warnings (`problem.FittedKeys`), and the measured and computed data. Fits to a loop, a curve or
a table minimise a sum of squares by `identify.least_squares`. Read `problem` first, then `loop`.
"""
