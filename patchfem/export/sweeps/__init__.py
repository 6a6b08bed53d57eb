"""A sweep on disk: results as columns in `chunks/`, tables, and optional case folders.

In: the cases of a sweep and an executor. Out: files, complete at every moment.

Read `chunks`, `folder`, then `run`.
"""
