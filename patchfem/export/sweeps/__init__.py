"""A sweep on disk: its answers as columns in `chunks/`, sweep.csv and sweep.nc of them all, a folder per case if asked.

In: the cases of a sweep and how to answer them. Out: files, whole at every moment. Read `chunks`, `folder`, then `run`.
"""
