"""Many runs of one scene: fits, error against cost, a scene before and after wear, sweeps.

Read `cost` first.
"""
