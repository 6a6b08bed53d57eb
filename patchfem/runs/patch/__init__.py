"""The static patch: condense, press, estimate errors on coarser meshes.

Read `press` first, then `ladder` and `measures`; `high_order` has sharper measures for tight tolerances, `fine`
for traces.
"""
