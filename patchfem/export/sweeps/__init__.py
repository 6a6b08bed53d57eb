"""A sweep on disk: a folder per case, sweep.csv and sweep.nc over all of them.

In: the cases of a sweep and how to answer them. Out: files, whole at every moment. Read `folder`, then `run`.
"""
