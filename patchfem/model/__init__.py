"""Models: the problems that scenes describe, in SI units, before anything is solved.

In: a `Scene`. Out: a `Model` of frozen records for pieces, gap, load, friction laws, prescribed slide, rig and
wear. No later folder knows a scene. Read `model` first, then `patch` for pressed pieces and `rig` for modes
and drives; `files` checks the files that a scene names.
"""
