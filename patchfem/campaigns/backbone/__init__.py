"""Backbone of a jointed mode: frequency and damping against amplitude by two methods.

In: a rig, a mode, amplitudes at the output. Out: a `records.Backbone`, one `records.Curve` per method.

The equation of motion is q'' + D q' + Omega^2 q + B^T f[B q] = 0: modal coordinates q, damping matrix D,
interface rows B, friction and joint forces f of the history of the relative displacement B q.

============== ============================= ======================== ========================= ==========
module         equation                      what it neglects         where it holds            CPU s
============== ============================= ======================== ========================= ==========
`balance`      period 2 pi/omega with a      change of the amplitude  laws with steady loops;   0.02..0.1
               negative damping -g q' that   within a cycle           rigid friction, for
               keeps the motion up; the                               motion that never sticks
               damping ratio is g/(2 omega)
`quasi_static` Omega^2 q + B^T f[B q] = P s, the bending of the force laws of finite stiffness; 0.0001..
               s the shape of the sticking   by friction, harmonics   closest in micro-slip     0.003
               mode; secant and loop area
============== ============================= ======================== ========================= ==========

The last column is the time of a point for one mode with law "elastic-plastic" or "iwan" and for two modes.
A static curve of a law without a closed loop is run on a bench and takes longer.

- `balance`: extended periodic motion (Krack, Comput. Struct. 154, 59, 2015). A slow decay shows this curve.
- `quasi_static`: quasi-static modal analysis (Festjens, Chevallier and Dion, Int. J. Mech. Sci. 75,
  170, 2013). Laws whose loops have no closed form are run on a bench (`bench_loops`).
- `linear`: a rig on which no friction acts has the same values at all amplitudes.

A release (`drive.kind = "free"`) neglects nothing; it is a run, whose result has frequency and damping over the amplitude.

Read `curves` first, then `joint`, which has the mode with its contact and the scales of its amplitudes.
"""
