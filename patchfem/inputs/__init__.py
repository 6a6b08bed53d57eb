"""Files of measurements that a scene or a fit names.

In: paths. Out: arrays in SI units; a fault names file, line and what was wanted.
`columns` reads any table of numbers; `paths` a slide over time, `signals` a drive, `measured` rows of a rig, `loops`
force against slide, `matlab` the arrays of a .mat file. Read `columns` first.
"""
