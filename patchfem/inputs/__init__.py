"""Files of measurements that a scene, a fit or a laboratory names, whatever their channels are called.

In: paths. Out: arrays in SI units; a fault names file, line and what was wanted.
`columns` reads any table of numbers, cell by cell (`cells`); `paths` a slide over time, `signals` a drive, `measured`
rows of a rig, `loops` force against slide, `matlab` the arrays of a .mat file, `universal` datasets 55, 58 and 164.
`records` chooses channels over one time, of any file by `laboratory`. Read `columns` first.
"""
