"""Worn depth of two pieces that slide on each other for many cycles.

In: contact forces of the worn pieces, slip path of every interface point in one cycle, wear coefficient. Out: the depth
that wear adds to the gap. Archard's law is dh = kappa p ds, its energy form dh = alpha tau ds, for both pieces
together. `depth` solves one jump over many cycles together with the contact; `jumps` chooses the lengths of the jumps;
`rough_layer` cuts the heights of a layer that wears. `between_runs` measures the wear between two states of a patch, and
`predicted` fits the depth of a run to a measured one. Read `depth` first.
"""

# Names that other folders use, by module
PUBLIC = {
    "depth": ("wear_rates",),
    "jumps": (
        "WearProblem",
        "make_initial_wear_state",
        "take_jump",
    ),
    "predicted": (
        "MeasuredDepth",
        "WearHistory",
        "fit_wear",
    ),
    "rough_layer": (
        "RoughLayer",
        "make_rough_layer",
        "make_rough_press",
    ),
}
