"""Engine `harmonic`: periodic motions of a driven rig, computed without their transient.

In: a Model, its Numerics and its Patch. Out: a Solution whose `extra` has the response curve over
frequency. Read `steady` first. `shooting` finds the motions, `curves` assembles response curves, and `peak` refines a
curve around its largest amplitude.
"""
