"""Many contacts of one pair of pieces at once, as a sweep over loads, tilts and crowns has them.

In: a compliance and gaps, loads and moments by the hundred. Out: forces, motions, edges and stiffnesses, the same as of
`unilateral` and `edges` one by one. Read `intervals`.
"""
