"""Backbone of a jointed mode: frequency and damping against amplitude by three methods.

In: a rig, a mode, amplitudes at the output. Out: a `records.Backbone`, one `records.Curve` per method.

The equation of motion is q'' + D q' + Omega^2 q + B^T f[B q] = 0: modal coordinates q, damping matrix D,
interface rows B, friction and joint forces f of the history of the relative displacement B q.

============== ============================= ========================= ========================== ========
module         equation                      what it neglects          where it holds             cost
============== ============================= ========================= ========================== ========
`balance`      motion with period 2 pi/omega the change of the         steady loops in closed     0.01 to
               that a negative damping       amplitude within a cycle  form; one mode also under  1 s per
               -g q' keeps up; g/(2 omega)                             rigid friction, exactly    point
               is the damping ratio
`decay`        the equation itself, released nothing; it gives means   any law, from the largest   seconds
               from the largest amplitude,   over a cycle, and other   amplitude from which the   to
               read from reversal to         modes may move            motion falls               minutes
               reversal
`quasi_static` Omega^2 q + B^T f[B q] = P s  inertia of the bending by laws of any kind with a     0.1 ms to
               with the shape s of the       friction: the shape of    finite stiffness; closest  1 s per
               sticking mode; secant and     the force is fixed        in micro-slip              point
               loop area of the load P
============== ============================= ========================= ========================== ========

- `balance`: extended periodic motion (Krack, Comput. Struct. 154, 59, 2015). A slow decay shows this curve.
- `decay`: also contains what a swing loses within a cycle.
- `quasi_static`: quasi-static modal analysis (Festjens, Chevallier and Dion, Int. J. Mech. Sci. 75,
  170, 2013). Laws whose loops have no closed form are run on a bench (`bench_loops`).
- `linear`: a rig on which no friction acts has the same values at all amplitudes.

Read `curves` first, then `joint`, which has the mode with its contact and the scales of its amplitudes.
"""
