"""The law bench: a prescribed slide in, the loop out.

In: a scene with [slide], its solved patch or none, samples of time and slide. Out: `BenchRun`, histories of force and
energy, frames of the interface, measures. `engine` decides what runs and what it costs: `closed` (laws without memory),
`rigid` (one point by the compiled loops of the rigs), `shear` (elements or bond points behind the pieces' shear),
`stepped` (the NumPy laws, where the pressure of a point changes on the way, or in two directions). `errors` runs the
coarser passes. Read `bench` first, then `engine`.
"""
