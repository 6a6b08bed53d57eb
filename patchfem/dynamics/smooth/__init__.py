"""Solver for smooth friction laws: Runge-Kutta steps of order 8 between successive reversals.

Equation. With modal coordinates z, relative displacement q = slide . z and states s of the
friction law,

    z'' + 2 zeta omega z' + omega^2 z = -base a(t) - slide F(q, q', s)/m,    s' = g(q, q', s).

Between two reversals of q' all terms are smooth, so steps of Dormand and Prince's method DOP853
(Hairer, Norsett and Wanner 1993, II.5) are taken, with the error estimate of order 5 and 3 and the
dense output of order 7.

Events. Every reversal, every kink of the law or of the drive, and the travel of the output end a
step. Newton's method on the length of the step finds the event (`loop_kernels.locate_event`), so it
is as exact as a step.

In: `core.ModalBasis`, a drive, an `Element` whose law offers its rates (`friction.protocol`) or is
set-valued and holds (`dynamics.grooves`). Out: `run.SmoothResult`. It refuses several interfaces,
and laws without rates. Cost: 12 evaluations per step, about 16 ns each for one mode; 10 to 60
steps per cycle at a tolerance of 1e-6. A motion that repeats is continued by whole cycles
(`run.Motion.run_ahead_to`).

| to read | module |
|---|---|
| first: a run | `run` |
| the loop over steps, and events | `loop_kernels` |
| one step, its error and its dense output | `step_kernels` |
| samples, extremes and phasors | `watch_kernels` |
| measures of the last cycles | `reader` |
"""
