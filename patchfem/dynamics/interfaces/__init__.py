"""What one interface of a march is to the compiled loop: a contact with solve, given, commit and state.

In: the numbers and memory of a law. Out: the slide and the path-mean force of a step, the memory after it. A contact is
one law on one slide (`element_kernels`, of any law), points behind shear modes (`shear_kernels`), points under a load
that changes (`pressed_points_kernels`), or a list of bonds (`list_kernels`); `arrays` has their tuples.
`spring_kernels` is the law of springs that are not linear. `shear_solve_kernels` solves points behind shear modes,
under a load that stays as well as one that changes. Read `element_kernels` first.
"""
