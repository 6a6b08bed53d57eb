"""Steps of order 2 from return maps: motion of many contact points, and sweeps over many cases.

For what has no smooth regimes between few events: patches whose pressure changes with the motion, many nodes in partial
slip, laws that are much faster than the drive; and, with one point, for hundreds of cases.

1. `return_maps_kernels`  force, tangent and state of each law after a step of slide
2. `laws`                 numbers and first memory of the laws from their keys
3. `case_rows`, `case_kernels`, `cases`  many cases of one mode and one point with their measures
4. `contacts`             points of a rig from elements, bonds, patches and varying loads
5. `march_rows`, `march_kernels`, `march`  modes with many points: `march.march` returns a `march.Motion`

A law is a number in `return_maps_kernels.Law` with a branch in each of five functions. Read `return_maps_kernels` first.
"""

# Names that other folders use, by module.
PUBLIC = {
    "case_rows": ("SAME_CYCLE", "Cases", "Number"),
    "cases": ("CaseMarch", "list_parameters", "march_cases"),
    "contacts": ("Contact",),
    "laws": ("make_point_law",),
    "march": ("Motion",),
}
