"""Comparison of two surfaces before and after wear: place, worn depth, tracks and change of the waves.

In: two `Profile`, or two `Areal`. Out: a `Comparison` with a verdict, quantities with their 95 % intervals, and the
evidence for them. Traces and scans take one way. Read `records` and `compare` first, then `raster` (even heights), `place`
and `alignment` (place of the second surface on the first), `model` and `fit` (robust fit to the unworn heights), `changes`
(worn heights), `depths` and `depth_map` (depths and their errors), `track` (worn tracks of traces), `verdict`.
"""
