"""Friction laws: traction as a function of the relative displacement at a given pressure.

In: keys of a table [friction] and a load. Out: the law of a contact in the form that the engines take (`protocol`).
`laws/` has one law per file, `bonds/` the sum over bonds of eq. 2.17 and its engines. Files named *kernels are compiled
for `time_steps` and `points`; the engine `event_driven` has its own files of the laws. `grooves` has matched grooves, whose
flanks the load climbs. `path_work` computes the friction work of samples. Read `protocol` first, then
`laws/elastic_plastic`.
"""

# Names that other folders use, by module
PUBLIC = {
    "bonds.engines": (
        "RequestedEngine",
        "choose_engine",
    ),
    "bonds.parameters": (
        "BondGrowth",
        "Bonds",
        "growth_numbers",
    ),
    "bonds.spread": ("carried_fraction",),
    "grooves": ("Grooves",),
    "protocol": ("SteadyLoop",),
    "record": (
        "make_law",
        "steady_loop",
    ),
}
