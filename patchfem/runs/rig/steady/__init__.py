"""The engine `harmonic`: motions that repeat with the drive, found directly, and their curves over frequency or level.

In: a Model, its Numerics and its solved patch. Out: a Solution whose `extra` has the curve, and the levels of a drive
in levels. Read `steady` first, then `maps` (Coulomb, elastic-plastic elements), `balance` (all else), and
`curves`, which makes points of a curve and levels of what these three find, and `top`, which closes in the largest.
"""
