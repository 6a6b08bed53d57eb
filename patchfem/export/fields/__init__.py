"""Fields of the pressed and sliding pieces as files: VTKHDF, VTU and PVD, and as objects of PyVista.

In: a Result, or a results folder. Out: files for ParaView, grids of PyVista.

Read `bodies` first.
"""
