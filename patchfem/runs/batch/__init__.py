"""Computation of many models at once, with the same results as single runs at lower cost.

In: a sequence of `Model`, or of the error that occurred in place of a model. Out: `CaseResults`,
one column per measure. Each `Batch` of `batches.BATCHES` computes groups of models that it
supports; `one_by_one` computes all others. Read `batches` first.
"""
