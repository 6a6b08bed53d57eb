"""Modes and a smooth law by a method of high order from reversal to reversal.

In: `core.ModalBasis`, a drive, an `Element` whose law offers its rates (`friction.protocol`). Out: a `MarchResult`, as
the march gives it. Between two reversals of the slide the motion is smooth: eq. 3.4 with the law in its rate form, or
with its exponentials of the slide where the bond length is constant. Every reversal, every kink of a law and of the
drive is the end of a step. Read `run`, then `loop_kernels`: Runge-Kutta steps of order 8, their length and where they
end; `step_kernels`: one step; `watch_kernels`: what is read off it; `reader`: the last cycles as polynomials in time,
with their peaks, harmonics, sticks. A motion that repeats is carried on by whole cycles (`run.Motion.onward`).
"""
