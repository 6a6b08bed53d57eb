"""Time integration of many cases with one mode, one interface and a sinusoidal drive, in batches.

Equation. With the angle of the drive as time, x the slide and f the friction force per unit mass,

    x'' + D x' + W x = P sin - f(x, x', memory).

Method. All cases take the same number of steps per cycle. A step is first computed for all lanes as if nothing happened in
it, without a branch, so that a compiler computes eight cases at once. The few lanes in which something happened are then
computed one by one with the event inside the step:

============================ ============================ ================================== =====
law                          step without an event        event                              order
============================ ============================ ================================== =====
Coulomb (`rigid`)            exact                        stop, release                      4
elastic-plastic (`yielding`) exact                        yield, stop, reversal              4
Iwan (`masing`)              Hermite's rule, order 4      reversal, closing of a loop        4
Jenkins elements (`table`)   Hermite's rule, order 4      reversal, closing of a loop, yield 2
tanh, Bouc-Wen, LuGre, bonds Runge-Kutta rule of order 4  reversal, kink, layer of speeds    4
============================ ============================ ================================== =====

The numerical error of a case follows from a second march with half the steps, which `runs.batch.lumped` makes. A
motion that settles is extrapolated to its steady state by the linear map of its cycle (`extrapolation_kernels`).

Refused: more than one mode or interface, a load that varies, bonds that grow or need a list, and drives that are not a
sine; `runs.batch.lumped.lanes` says so. Cost per step and case: 4 to 6 ns for Coulomb, elastic-plastic and tanh, 9
to 12 ns for bonds and LuGre, 25 to 40 ns for Iwan and Jenkins elements, 200 ns for Bouc-Wen. A cycle of 96 steps takes 0.4
to 4 us, and 20 us for Bouc-Wen.

In: `run.Cases`. Out: `run.LaneResults`, from which `reading` computes what the engine `events` reads of its runs. Read
`rigid_kernels` first, which is the pattern of a law, then `rows_kernels` (the workspace), `lane_kernels`, `loop_kernels`
and `run`.
"""
