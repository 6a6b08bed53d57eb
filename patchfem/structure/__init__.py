"""Modes of a rig, the drives that excite them, and their initial conditions.

In: frequencies, masses and springs, matrices, or the mode shapes of a modal test. Out: a `core.ModalBasis`, starts, and
drives with their signals. The modal coordinates follow
z_i'' + 2 zeta_i w_i z_i' + w_i^2 z_i = G_i + g_i (3.4). Read `matrices` first for modes, and `drives` for
signals.
"""

# Names that other folders use, by module
PUBLIC = {
    "drives": ("make_release",),
    "response": ("compute_receptance",),
}
