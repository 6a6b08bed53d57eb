"""The modes of a rig and the drives that push them.

In: frequencies, masses and springs, or files. Out: `core.ModalBasis`, starts, drives with their signals.
z_i'' + 2 zeta_i w_i z_i' + w_i^2 z_i = G_i + g_i (3.4). Read `modes` first.
"""
