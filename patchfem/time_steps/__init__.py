"""Steps of order 2 of contact points under every law with every effect.

A point has a law, a load and a memory. It acts on a port: a displacement of the rig (interface, band with yaw, heave, pitch,
climb of a groove), or a prescribed one. Points stand in blocks of WIDTH points of one law and one port, of which the last
ones may be empty (their load is 0). A law is one compiled function of a block:

    slide_law(numbers, memory, trial, values, count, step)

All arrays are 1-D. The value of point j < WIDTH in a row is entry `row + j`, where the members of an enumeration of rows
are multiples of WIDTH, as in `values[Value.SLIDE + j]`. The distance between rows is known to the compiler, so that it
vectorises loops over j. A loop without branches runs over whole vectors, up to `count` rounded up to a multiple of VECTOR.

- numbers: numbers of the law, read only; a law documents its rows
- memory: state of the points at the start of the step, read only
- trial: state at the end of the step, output
- values: rows of `step_rows_kernels.Value`; inputs SLIDE (increment ds [m]), START_VELOCITY and VELOCITY (at the ends of the
  step [m/s]), START_LOAD and END_LOAD [N], START (force at the start [N]); outputs END (force at the end [N]), MEAN (mean
  force over the path [N]), END_BY_SLIDE, MEAN_BY_SLIDE [N/m], END_BY_VELOCITY, MEAN_BY_VELOCITY [N s/m] (derivatives),
  ENERGY (stored at the end [J]) and STRETCH (elastic part of the displacement at the end [m])
- count: number of points in the block; a loop with branches or functions runs over range(count)
- step: `step_rows_kernels.Step`, its duration [s], and the factors of the formula of order 2 for a velocity,
  v = rate * increment - lag * last increment

The function is called several times in a step, with other slides. It must give the same outputs for the same inputs, so that
it writes nothing but `trial` and the outputs. After an accepted step the march copies `trial` to `memory`. A slide of 0 in a
step of duration 0 is a change of load at rest, and with equal loads it reads a state. What a change of the load does is a
part of the law: half of it acts before the slide, half after it, and no law creates energy: MEAN * SLIDE is at least the
change of ENERGY.
"""

# Names that other folders use, by module
PUBLIC = {
    "slides": ("follow",),
    "systems": ("find_stiffness",),
    "time_march": ("March", "march"),
}
