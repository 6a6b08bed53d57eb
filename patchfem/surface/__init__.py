"""Measured surfaces: read, levelled and cleaned, their roughness, and their wear.

In: files of traces and areal scans (`files`). Out: levelled heights averaged over the cells of the
interface nodes (`nodes`), roughness with intervals (`roughness`), and what changed between two
traces (`compare`) or two scans (`scans`). Read `profile` first, then `nodes`.
"""
