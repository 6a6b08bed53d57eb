"""Brute-force reference for friction on rigs and benches: small time steps, Gauss-Seidel over single contact points.

Nothing here uses the engines of the package. `laws_by_steps` has the friction laws, `gauss_seidel` moves points of any law
behind a compliance matrix on the ports of a linear structure or of a prescribed slide, and `systems` makes such a system
from the plain numbers of a scene (`scenes`). Only the pressed pieces come from the package: nodes, areas, pressures and
compliance matrices, which its static tests check against closed forms.

Steps are of order 1, so that a reference is extrapolated from two runs; its own error is estimated from their change.
"""
