"""Two areal scans before and after: where one lies on the other, what wore off, what grew.

In: two `Areal`. Out: a `Change`: shift, rotation, whether a scan is mirrored or turned over, the map of the worn depth,
volumes, share and depths with their 95 % intervals, and a verdict in words. Read `change` first, then `search`,
`registration`, `plane`, `volumes`.
"""
