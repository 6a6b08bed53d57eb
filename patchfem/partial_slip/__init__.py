"""Partial slip of pressed pieces whose holders undergo a relative tangential displacement.

In: the tangential compliance C (m, m) and the friction limit (m,) [N] of every node. Out: a model of the
shear force against the displacement, and the traction and the slip of every node.

`shear_modes` reduces the interface to parallel Jenkins elements, exact for laws that yield at a fixed force, or to a few
modes of D^1/2 C D^1/2 for laws with memory. `fields` recovers traction and slip of the nodes from the states of the
former. `mesh_correction` estimates the error of elements that yield node by node. `edge_springs` gives a patch a
prescribed stiffness in full stick. `first_loading` does the same for the thousands of cells of a face. Read `shear_modes`
first.
"""

# Names that other folders use, by module
PUBLIC = {
    "edge_springs": ("add_edge_springs",),
    "mesh_correction": ("spread_elements",),
    "shear_modes": (
        "find_sufficient_modes",
        "make_jenkins_set",
    ),
}
