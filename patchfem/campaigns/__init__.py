"""Studies of many runs of one scene: fits, error against cost, wear comparisons, sweeps.

Read `cost` first.
"""
