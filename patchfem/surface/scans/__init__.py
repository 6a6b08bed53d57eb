"""Comparison of two areal scans, before and after wear.

In: two `Areal`. Out: a `Change` with rotation and shift, the map of the worn depth, volumes and
depths with 95 % intervals, the wear track, and a verdict in sentences. Read `change` first, then
`search` (coarse place), `model` (depth as a function of place and plane), `alignment` (robust fit),
`wear` (detection), `errors` (bootstrap), `volumes` and `track`.
"""
