"""Engine `harmonic`: periodic motions of a driven rig, computed without their transient.

In: a Model, its Numerics and its Patch. Out: a Solution whose `extra` has the response curve over
frequency. Read `steady` first. The methods are `shooting` (Coulomb friction,
elastic-plastic elements, grooves) and `balance` (all other laws). `curves` assembles response curves,
and `peak` refines a curve around its largest amplitude.
"""
