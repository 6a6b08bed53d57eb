"""Many models at once: each case answered as a single run would answer it, cases that share work together.

In: a sequence of `Model`, or of what refused one. Out: `CaseResults`, one column per measure. A
`Batch` of `many.BATCHES`
takes the models that it does not refuse, in groups; `one_by_one` takes all that are left. Read `batches` first.
"""
