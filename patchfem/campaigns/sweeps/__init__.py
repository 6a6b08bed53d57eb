"""Sweeps: many cases of a scene that differ in the values of a few keys.

In: the text of a scene (`SweepScene`) and the values of its keys (`Cases`). Out: `CaseResults` of
`runs.batch`, chunk by chunk in any order. The modules of `executors/` compute chunks in this
process, in several processes, or on a cluster. `export.sweeps` stores the results on disk.

Read `cases` first, then `sweep`.
"""
