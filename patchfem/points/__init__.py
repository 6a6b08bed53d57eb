"""Steps of order 2 from return maps: motion of many contact points, and sweeps over many cases.

For what has no smooth regimes between few events: patches whose pressure changes with the motion, lists of bonds, many
nodes in partial slip, laws that are much faster than the drive; and, with one point, for hundreds of cases.

1. `return_maps_kernels`  force, tangent and state of each law after a step of slide
2. `laws`                 numbers and first memory of the laws from their keys
3. `case_rows`, `case_observers_kernels`, `linear_cases_kernels`, `smooth_cases_kernels`, `case_march_kernels`, `cases`
   many cases of one mode and one point with their measures, for laws that are linear between events and for smooth ones
4. `contacts`             points of a rig or a bench: elements, bonds, patches, varying loads, grooves
5. `march_rows`, `lists_kernels`, `flanks_kernels`, `march_kernels`  steps of modes with many points
6. `checkpoint`, `time_march`  march over the cycles of a drive, with its record; its state on disk
7. `slides`  points along a prescribed slide

A law is a number in `law_rows.Law` with a branch in each of five functions. Read `return_maps_kernels` first.
"""

# Names that other folders use, by module.
PUBLIC = {
    "case_rows": (
        "MAX_STEPS",
        "MAX_STEP_PHASE",
        "SAME_CASE_CYCLE",
        "SAME_SMOOTH_CYCLE",
        "WINDOW_STEPS",
        "Cases",
        "Number",
    ),
    "cases": ("CaseMarch", "is_linear_between_events", "list_parameters", "march_cases"),
    "checkpoint": ("CheckpointFiles", "store_checkpoints"),
    "contacts": (
        "BondSum",
        "Contact",
        "make_bond_contact",
        "make_contact",
        "make_cubic_spring",
        "make_interlocking_spring",
        "make_pressed_contact",
    ),
    "laws": ("PointLaw", "make_elements", "make_point_law"),
    "time_march": ("March", "Motion", "Snapshot", "load_kernels", "march"),
    "slides": ("BLOCK", "follow"),
}
