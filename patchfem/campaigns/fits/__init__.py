"""Fits of a scene: values of its keys that explain a measurement.

In: a scene, ranges of its free keys, and a measurement: a friction loop (`loop`), a curve of frequency
and damping against amplitude (`curve`), a worn depth (`wear`), or the loops of the scene's own patch
(`patch`). Rows of responses have a folder of their own, `campaigns.rows`. Out: values with 95 %
intervals and warnings (`problem.FittedKeys`), and what was measured and computed. A fit to a loop, a
curve or rows minimises the sum of squares of a `problem.Problem`, by `identify.least_squares`.
Read `problem` first, then `loop`.
"""
