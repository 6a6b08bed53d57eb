"""Engine `harmonic`: periodic motions of a driven rig, computed without their transient.

In: a Model, its Numerics and its Patch. Out: a Solution whose field `periodic` has the response curve over frequency. Read
`shooting` first, which finds the motions; `curves` joins them to a curve, `estimates` finds the maxima of one that is not
drawn, and `peaks` refines it around its largest amplitude.
"""
