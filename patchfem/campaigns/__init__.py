"""Many runs of one scene: fits, error against cost.

Read `cost` first.
"""
