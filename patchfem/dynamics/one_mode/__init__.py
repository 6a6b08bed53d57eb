"""One mode with one Coulomb interface in closed form: histories, the map of a period, resonance curves.

The fast way of `piecewise` where a rig is that small. Read `sdof` first, then `steady`.
"""
