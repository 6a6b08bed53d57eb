"""Wear of a bench or a rig: patch, motion and worn depth are computed over many cycles.

In: a model with [wear] and its solved patch. Out: the worn patch, on which the run continues as on
any other patch, and the history of the wear. `slip` computes the slip path of a cycle from a run,
`evolve` extrapolates the wear over many cycles at a time, `measures` has the measures of wear, and
`plan` predicts the cost. Read `evolve` first.
"""
