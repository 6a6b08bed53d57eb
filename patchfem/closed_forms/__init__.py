"""Exact solutions of contact at the rounded edges of punches.

In: sizes in SI units, shapes as each docstring of `contact` says. Out: closed forms, or one scalar equation solved to
round-off. Nothing here uses the rest of the package, so tests may trust it.
"""

# Names that other folders use, by module
PUBLIC = {
    "contact": (
        "rounded_corner_contact",
        "rounded_punch_half_width",
    ),
}
