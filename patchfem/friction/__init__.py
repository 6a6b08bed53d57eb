"""Friction laws: traction as a function of the relative displacement at a given pressure.

In: keys of a table [friction] and a load. Out: the law of a contact in the form that the engines take (`protocol`).
`laws/` has one law per file, `bonds/` the sum over bonds of eq. 2.17 and its engines. Files named *kernels are compiled
for `time_steps` and `points`; the engine `hybrid` has its own files of the laws. `grooves` has matched grooves, whose flanks
the load climbs. `path_work` computes the friction work of samples. Read `protocol` first, then `laws/elastic_plastic`.
"""

# Names that other folders use, by module
PUBLIC = {
    "bonds.engines": (
        "RECURSION",
        "RequestedEngine",
        "choose_engine",
    ),
    "bonds.list_numbers": ("join_lists", "make_lists", "make_no_lists"),
    "bonds.parameters": (
        "Bonds",
        "growth_numbers",
        "growth_path_ratio",
    ),
    "bonds.point_kernels": (
        "bond_mean",
        "bond_step",
        "grow",
        "press_point",
    ),
    "bonds.spread": ("carried_fraction",),
    "bonds.strip_kernels": (
        "advance_list",
        "slide_list",
    ),
    "bonds.strip_rows_kernels": (
        "BondLists",
        "ListLaw",
        "ListState",
    ),
    "grooves": ("Grooves",),
    "laws.bouc_wen_kernels": ("follow_path",),
    "laws.coulomb": ("Coulomb",),
    "laws.elastic_plastic": ("masing_loop",),
    "laws.lugre": ("LuGre",),
    "laws.lugre_kernels": (
        "find_force",
        "relaxation_length",
    ),
    "path_work": ("sampled_work",),
    "protocol": ("SteadyLoop",),
    "record": (
        "make_law",
        "steady_loop",
        "stick_stiffness",
    ),
}
