"""Fields of the pressed and sliding pieces: VTKHDF, VTU and PVD files, pictures, an interactive view.

Read `bodies` first.
"""
