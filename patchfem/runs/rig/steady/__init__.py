"""Engine `harmonic`: motions that repeat with the drive, found directly, and their curves.

In: a Model, its Numerics and its solved patch. Out: a Solution whose `extra` has the curve over
frequency or level, and the levels of a drive in levels. Read `steady` first, then `maps`
(Coulomb friction, elastic-plastic elements), `periodic_march` (grooves) and `balance` (all other
laws); `curves` assembles their points to a curve or to levels, and `peak` refines a curve around
its largest amplitude.
"""
