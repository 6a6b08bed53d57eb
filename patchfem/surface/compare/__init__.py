"""Comparison of two surfaces before and after wear: place, worn depth, tracks and change of the waves.

In: two `Profile`, or two `Areal`. Out: a `Comparison` with a verdict, quantities with their 95 % intervals, and the
evidence for them. Read `records` and `compare` first, then `alignment` and `traces` (place of the second trace on the
first), `fit` (robust fit to the unworn heights), `changes` (worn heights), `section` and `track` (worn tracks), `verdict`;
`scans` does the same for areal scans.
"""
