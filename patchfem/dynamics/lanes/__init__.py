"""Many cases of one mode, one interface and a sine, marched side by side in the lanes of the processor.

In: `run.Cases`, numbers of the equation. Out: what every cycle and the last ones of each case show, for the same steps
a cycle in all; a march by half the steps tells the error. `loop_kernels` is the text of the loop, of one case in a lane
as of many; its law is a part of it: `rigid_kernels` (Coulomb), `yielding_kernels` (elastic-plastic), of which a step
without a stop, a yield or a release in it is exact and one with it finds its place to the fourth order,
`flowing_kernels` (laws of one stretch, from their own kernels: tanh, Bouc-Wen, LuGre, bonds) and `masing_kernels`
(sliders of one first loading: Iwan's by `power_curve_kernels`, without cells, a patch's by `table_curve_kernels`), of
which every step is of that order, behind a table of the second at its yields. Read `loop_kernels` first, then `run`,
which loads the compiled loop; `reading` gives the numbers of a run from event to event (`events`), whose measures are
taken off them.
"""
