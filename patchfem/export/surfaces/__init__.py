"""Answers on measured surfaces: wear between two surfaces or two runs, tables of pairs, roughness.

In: the records of `surface.compare`, `surface.roughness` and `wear`. Out: an `Answer`. sentences.toml has one
table for each kind of code: verdicts, findings and reasons; `quantities` has the meaning of each quantity.

Read `compare` first.
"""
