"""Normal contact of two pieces through their condensed compliance.

In: the compliance C (m, m) of m interface nodes, the gap g (m,), and a load or an approach. Out: nodal
forces f or pressures, the gap under load, the approach delta and the rotation theta that satisfy

    w = g + theta x - delta + C f >= 0,    f >= 0,    f . w = 0.

`gaps` has the shapes of the surfaces. `unilateral.press` solves for one patch, by the methods of `active_set`
and, if they fail, of `conjugate_gradients`; `strip_compliance` holds C. `strips` presses patches side by side,
bare or with asperities (`asperity_laws`, `asperity_layer`). `edges` and `stiffness` derive quantities of a contact
set. Read `gaps`, `unilateral` and `active_set` first.

`contact_sets` and the kernels solve again and again while the holder moves (`press_kernels`, `polygon_kernels`,
`press_path_kernels`), `batch` solves many cases at once, and `half_space` serves rows of thousands of points.
"""
