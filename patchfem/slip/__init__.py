"""Partial slip of pressed pieces.

In: tangential compliance (m, m) and the limit of friction at every node. Out: parallel elements that give the same
force against slide, modes of shear for laws with memory (both `shear_modes`), and what that means at every node
(`fields`). Read `shear_modes` first.
"""
