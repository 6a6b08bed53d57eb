"""Fields of the pressed and sliding pieces as files: VTKHDF, VTU and PVD.

Read `bodies` first.
"""
