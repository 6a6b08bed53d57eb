"""Law bench: friction loop of an interface under a prescribed relative displacement.

In: a scene with [slide], its solved patch or none, samples of time and slide. Out: `BenchRun`
with histories of force and energy, frames of the interface, and measures. `engine` chooses how
a bench is computed and predicts its cost: `closed` (laws without memory), `rigid` (one point,
by the compiled loops of the rigs), `shear` (elements or bond points of pieces that deform in
shear), `stepped` (NumPy laws, if the pressure of a point changes during the slide, or for a
slide in two directions). `errors` runs the coarse passes. Read `bench` first, then `engine`.
"""
