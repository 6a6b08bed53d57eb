"""Sweeps: many cases of one scene, each a scene with other values of a few keys, answered here or on many processes.

In: `Asked`, the scene as text, and `Cases`, the values of its keys. Out: `CaseResults` of
`runs.batch`, chunk by chunk, in any order. `executors/` hold the ways to work on chunks; what is
kept on disk is the business of `export.sweeps`. Read `cases`, then `sweep`.
"""
