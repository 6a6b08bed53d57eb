"""Fields of the pressed and sliding pieces as files: VTKHDF, VTU and PVD.

In: a Result, or a results folder. Out: files for ParaView.

Read `bodies` first.
"""
