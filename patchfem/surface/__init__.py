"""Height profiles: read, measured, and as a share of the gap.

In: traces x [m], z [m] and areal scans, from `files`. Out: levelled heights averaged over the cells of the interface
nodes; roughness with intervals (`roughness`); two traces (`compare`) or two scans (`scans`) before and
after. Read `profile` first, then
`nodes`.
"""
