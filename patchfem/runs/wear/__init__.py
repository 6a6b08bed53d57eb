"""Wear of a bench or a rig: the patch, the motion and the worn depth advance together over many cycles.

In: a model with [wear] and its pressed patch. Out: the worn patch, on which the run is done as on any other, and the
history on the way. `slip` reads the slip path of a cycle off a run, `evolve` jumps over the cycles, `measures` says
what was worn. Read `evolve` first.
"""
