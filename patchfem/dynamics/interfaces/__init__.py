"""Contacts of a march: solution of a time step and update of contact memory in the compiled loop.

Equation of a step. Over a step of dt the friction force enters as its mean over the path, so its
work is exact:

    dq = free - beta F(dq),

with the increment dq of the relative displacement, its value `free` without friction, and the
compliance beta of the modes. Every contact has the functions solve_step (this equation),
apply_increment (F over a prescribed dq), commit_step (update the memory) and read_state (force,
energy, slip).

| contact | module | arrays |
|---|---|---|
| one law on one relative displacement; read it first | `element_kernels`, `element_solve_kernels` | `Element` |
| points coupled by shear modes | `shear_kernels`, `shear_points_kernels`, `shear_solve_kernels` | `ShearedPoints` |
| points under a load that changes | `pressed_points_kernels` | `PressedPoints` |
| one list of bonds | `list_kernels` | `BondList` |
| bond lists coupled by shear modes | `shear_list_kernels`, `shear_lists_kernels` | `ShearedLists` |
| nonlinear springs, as a law | `spring_kernels` | |

In: numbers and memory of a law (`friction`). Out: increment and mean force of a step, and the
updated memory. A step that does not converge returns a number of iterations below 0. Cost: 20 to 100
ns per step of one law; of m points coupled by r shear modes one Newton step takes m r^2/2 products.
"""
