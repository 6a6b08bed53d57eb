"""Height profiles as a share of the gap.

In: traces x [m], z [m] and areal scans, measured (`files`) or made (`synthetic`). Out: levelled heights averaged over
the cells of the interface nodes. Read `profile` first, then `nodes`.
"""
