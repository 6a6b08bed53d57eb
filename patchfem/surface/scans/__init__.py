"""Two areal scans before and after wear: how one lies on the other, what wore off, and what grew.

In: two `Areal`. Out: a `Change`: shift and rotation, whether a scan is mirrored or inverted, the map of the worn
depth, volumes, worn fraction and depths with their 95 % intervals, the wear track, and a verdict in words. Read
`change` first, then `search` (coarse place), `model` (depth as a function of place and plane), `alignment` (robust
fit, as for traces), `wear` (which heights changed), `errors` (bootstrap), `volumes`, `track`.
"""
