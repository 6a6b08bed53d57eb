"""Computation of many models at once, with the same results as single runs at lower cost.

In: a sequence of `Model`, or of the error that occurred in place of a model. Out: `CaseResults`,
one column per measure. `lumped` computes many cases with one mode and one contact point together, `static` pressed
patches that differ in numbers alone, and `one_by_one` all others. Read `batches` first.
"""
