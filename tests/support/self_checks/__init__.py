"""Self-checks of a run: comparison of its results with a second computation from the scene.

A wrong factor anywhere between the mesh and the summary does not disturb the energy balance,
because both sides of the balance use the same wrong number. Each check therefore recomputes a
number from the values of the scene by a short formula, and compares it with the result of the run.
The threshold is the largest difference that is possible in a correct run.

Notation: z, v modal coordinates and their rates, m the moving mass, s the slide participations, F
the friction force (positive against positive slip), a(t) the drive, T the length of the window of
the last cycles. Equation of motion of coordinate i (report, eq. 3.4): z_i'' + 2 zeta_i omega_i v_i
+ omega_i^2 z_i = -base_i a - s_i F/m.

Read `checks` first: the table of all checks. `finding` has the two numbers and their threshold,
`evidence` the data of a result that the checks use; the checks themselves are in `patch`,
`structure` and `motion`.
"""
