"""Wear of a bench or a rig: patch, motion and worn depth advance together over many cycles.

In: a model with [wear] and its pressed patch. Out: the worn patch, on which the run continues
as on any other, and the history of the wear. `slip` computes the slip path of a cycle from a
run, `evolve` jumps over the cycles, `measures` has the measures of wear, and `plan` predicts
their cost. Read `evolve` first.
"""
