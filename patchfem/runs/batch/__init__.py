"""Computation of many models at once, with the results of single runs and shared work.

In: a sequence of `Model`, or of the error that refused one. Out: `CaseResults`, one column per
measure. A `Batch` of `batches.BATCHES` takes the models that it does not refuse, in groups;
`one_by_one` takes all others. Read `batches` first.
"""
