"""Comparison of traces before and after wear: alignment, worn depth and change of the waves.

In: two `Profile`, or two `Areal` and a direction. Out: a `Comparison`: shift, tilt and scale, worn depth and area where
unworn valleys or flanks give a common reference, ratios of amplitude and slope, each with its 95 % interval, and what
they prove, as sentences. Read `compare` first, then `search` and `place` (whether both traces run over the same place),
`model` (how the second trace depends on the first), `robust` (the fit), `alignment` (which floor did not wear),
`errors` (the bootstrap), `section` (a track and its sizes), `ambiguity` (what cannot be known), `verdict`.
"""
