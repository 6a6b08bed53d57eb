"""Backbone of a jointed mode: frequency and damping against amplitude by three methods.

In: a rig, a mode, amplitudes at the output. Out: a `records.Backbone`, one curve per method.

- `balance`: the periodic motion that a negative damping keeps up (extended periodic motion: Krack,
  Comput. Struct. 154, 59, 2015), by harmonic balance, or exactly from reversal to reversal under rigid
  friction. A slow decay shows this curve.
- `decay`: a release from the largest amplitude, read from reversal to reversal. It also contains what a
  swing loses within a cycle.
- `quasi_static`: one static force with the shape of the mode whose contact sticks, and the loops of the
  friction laws. It leaves out how the force bends the motion.

Read `curves` first, then `joint`, which has the mode with its contact and the scales of its amplitudes.
"""
