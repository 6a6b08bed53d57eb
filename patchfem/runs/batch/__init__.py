"""Computation of many models at once, with the results of single runs; models that share work share it.

In: a sequence of `Model`, or of what refused one. Out: `CaseResults`, one column per measure. A
`Batch` of `batches.BATCHES` takes the models that it does not refuse, in groups; `one_by_one` takes
all that are left. Read `batches` first.
"""
