"""Steps of order 2 of contact points under every law with every effect.

A point has a law, a load and a memory. It acts on a port: a displacement of the rig (interface, band with yaw, heave, pitch,
climb of a groove), or a prescribed one. A law is one compiled function over the points `first` to `end - 1`:

    slide_law(numbers, memory, trial, values, first, end, step)

- numbers (k, m): numbers of the law of each point, read only; a law documents its rows
- memory (l, m): state of the points at the start of the step, read only
- trial (l, m): state at the end of the step, output
- values (v, m): rows of `step_rows.Value`; inputs SLIDE (increment ds [m]), START_VELOCITY and VELOCITY (at the ends of the
  step [m/s]), START_LOAD and END_LOAD [N], START (force at the start [N]); outputs END (force at the end [N]), MEAN (mean
  force over the path [N]), END_BY_SLIDE, MEAN_BY_SLIDE [N/m], END_BY_VELOCITY, MEAN_BY_VELOCITY [N s/m] (derivatives),
  ENERGY (stored at the end [J]) and STRETCH (elastic part of the displacement at the end [m])
- step: `step_rows.Step`, its duration [s], and the factors of the formula of order 2 for a velocity,
  v = rate * increment - lag * last increment

The function is called several times in a step, with other slides. It must give the same outputs for the same inputs, so that
it writes nothing but `trial` and the outputs. After an accepted step the march copies `trial` to `memory`. A slide of 0 in a
step of duration 0 is a change of load at rest, and with equal loads it reads a state. What a change of the load does is a
part of the law: half of it acts before the slide, half after it, and no law creates energy: MEAN * SLIDE is at least the
change of ENERGY.

A law with a state of another form (a list of bonds) takes its arrays as a last argument, `lists`, and has a second function,
`commit_list(numbers, values, lists, first, end, step)`, which advances this state over an accepted step.

Loops run over the points with whole C-ordered arrays and the bounds `first` and `end`, so that the compiler vectorises them.
"""
