"""Fits of scene parameters to measurements.

In: a scene, ranges of its free parameters, and a measurement: a friction loop (`loop`), frequency and damping as functions
of amplitude (`curve`), a table of responses (`rows`) or a worn depth (`wear`). Out: fitted values with 95 %
confidence intervals and warnings, and the measured and computed values (`problem.FittedKeys`). Each kind of measurement is a
`problem.Comparison`, and `problem.fit_keys` fits them all. Read `problem` first, then `loop`.
"""
