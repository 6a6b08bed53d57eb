"""A sweep on disk: results as netCDF files in `chunks/`, tables, and optional case folders.

In: the cases of a sweep and an executor. Out: files that are complete at every moment, and the
`Answer` of the sweep.

Read `folder`, `run`, then `words` and `answer`. `charts.sweeps` draws it.
"""
