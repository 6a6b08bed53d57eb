"""Methods that the report and textbooks use, for comparison: Duhamel, Newmark, Euler.

Read `steps` first: the grid of steps, the start and the result. `duhamel`, `newmark` and `euler` have a
function `run` each, `point_laws` the friction laws, `loops_kernels` the compiled loops. `scene_run` runs
the rig of a scene.
"""
