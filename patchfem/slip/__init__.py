"""Partial slip of pressed pieces.

In: tangential compliance (m, m) and the limit of friction at every node. Out: parallel elements that give the same
force against slide (`sets`, `partial_slip`), modes of shear for laws with memory (`shear_modes`), histories under a
changing load (`unlike`), and what that means at every node (`fields`). Read `partial_slip` first.
"""
