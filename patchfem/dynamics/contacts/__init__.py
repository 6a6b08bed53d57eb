"""What one interface of a march is to the compiled loops: a contact with solve, given, commit, state and hold.

In: the numbers and memory of a law. Out: the slide and the path-mean force of a step, the memory after it. A contact is
one law on one slide (`element_kernels`, of any law), set-valued Coulomb friction, points behind shear modes, or a list
of bonds; `arrays` has their tuples. `spring_kernels` is the law of springs that are not linear. `shear_solve_kernels`
solves points behind shear modes, for this march and that under a load that changes. Read `element_kernels` first.
"""
