"""Fields of the pressed and sliding pieces as files: VTKHDF, VTU, PVD and CSV, and as grids of PyVista.

In: a Result, or a results folder. Out: files for ParaView, grids of PyVista, the stress around the
contact for a page.

Read `vtkhdf` first.
"""
