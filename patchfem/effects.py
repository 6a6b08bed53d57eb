"""Every effect a scene can name: what computes it, its equations, what it needs and what it gives.

An effect is a table of a scene or the value of its selector key. `plan` imports only the modules of the effects that a
scene names.
"""

from typing import NamedTuple


class Effect(NamedTuple):
    """module: "" where the scene's own values suffice; needs, gives: what earlier effects hand on."""

    module: str
    equations: str
    needs: tuple = ()
    gives: tuple = ()


EFFECTS = {
    "contact": Effect("patchfem.contact.unilateral", "w = g + theta x - delta + C f >= 0, f >= 0, f.w = 0, sum f = N",
                      (), ("pressure",)),
    "contact.coating": Effect("", "Lame pair of the layer in the coating rows"),
    "contact.upper": Effect("", "C = C_upper + C_lower, each with its own height, materials and coating"),
    "contact.lower": Effect("", "C = C_upper + C_lower, each with its own height, materials and coating"),
    "contact.approach": Effect("", "delta given, N = sum f"),
    "contact.holder": Effect("", "sum f x = N offset + K theta, slide_i = q - F/K_t"),
    "contact.step": Effect("patchfem.contact.gaps", "g += height H(x - at)"),
    "contact.asperities.law=linear": Effect("", "C += diag(1/(k_n A)), C_tt += diag(1/(k_t A))"),
    "contact.asperities.law=exponential": Effect("patchfem.contact.skin", "f = A p_0 exp(-s/u_0), s = g + theta x - "
                                                 "delta + C f"),
    "contact.asperities.law=hertz": Effect("patchfem.contact.skin", "f = A 4/3 E* sqrt(R) eta int_s (z - s)^3/2 phi(z) "
                                           "dz"),
    "contact.tilt": Effect("patchfem.contact.gaps", "g += angle x"),
    "contact.load_line": Effect("", "sum f x = N offset, rotation free"),
    "contact.crown": Effect("patchfem.contact.gaps", "g += x^2/(2 radius)"),
    "contact.profile": Effect("patchfem.surface.nodes", "g += z(x), levelled, averaged over each node's cells"),
    "contact.strips": Effect("patchfem.contact.strips", "C f_j >= R q - g - roll y_j per strip, one holder q"),
    "contact.shear": Effect("patchfem.slip.shear_modes", "slide_i = q - sum_j C_ij f_j", ("pressure", "traction"), ()),
    "normal": Effect("", "sigma_n A = N at one point", (), ("pressure",)),
    "friction.law=coulomb": Effect("patchfem.dynamics.events.events",
                                   "|F| <= mu_s N stuck, F = mu_k N sgn(v) sliding (2.1)",
                                   ("pressure",), ("traction",)),
    "friction.law=tanh": Effect("patchfem.friction.laws.elastic_plastic", "F = mu N tanh(v/v_0) (2.4)", ("pressure",),
                                ("traction",)),
    "friction.law=elastic-plastic": Effect("patchfem.friction.laws.elastic_plastic",
                                           "F' = mu N v/eps, |F| <= mu N (3.12 with its "
                                           "reversal)", ("pressure",), ("traction",)),
    "friction.law=nonlocal": Effect("patchfem.friction.bonds.quadrature", "tau = -mu_s int phi(R/eps) sigma_n "
                                    "u/|u| dL1/eps_0 (2.17)", ("pressure",), ("traction",)),
    "friction.law=convolution": Effect("patchfem.friction.laws.convolution", "tau = mu_s sgn(v) int phi(s/eps)/eps "
                                       "sigma_n(x - s sgn v) ds (Oden, Pires)", ("pressure",), ("traction",)),
    "friction.reading=stretch": Effect("patchfem.friction.bonds.recursion",
                                       "phi: (|u|/eps)^p exp(-int dR/eps)/Gamma(p+1)"),
    "friction.reading=report": Effect("patchfem.friction.bonds.quadrature",
                                      "phi: (R/eps)^p exp(-R/eps)/Gamma(p+1) (2.14)"),
    "friction.temperature": Effect("patchfem.friction.bonds.temperature",
                                         "a_s = a_ref exp(T_a (1/T_ref - 1/T_s)), "
                                   "l_k = l_ref exp(T_l (1/T_s - 1/T_ref)) (2.13)"),
    "slide.kind=constant": Effect("", "q = speed t", (), ("motion",)),
    "slide.kind=sine": Effect("", "q = amplitude sin(2 pi f t)", (), ("motion",)),
    "slide.kind=triangle": Effect("", "q between +- amplitude at constant speed", (), ("motion",)),
    "slide.kind=dwell": Effect("", "q = speed t, then hold at rest (2.10 with v = 0), then on at the same speed", (),
                               ("motion",)),
    "slide.kind=file": Effect("patchfem.inputs.paths", "q straight between the rows of a table", (), ("motion",)),
    "structure": Effect("patchfem.structure.modes", "z_i'' + 2 zeta_i w_i z_i' + w_i^2 z_i = G_i + g_i (3.4)", (),
                        ("modes",)),
    "structure.bonded": Effect("patchfem.structure.bonded", "K += k s s^T, D += c s s^T / m", ("modes",)),
    "structure.start": Effect("patchfem.structure.starts", "z(0) = Phi^-1 x(0) (3.2)", ("modes",)),
    "drive.kind=base": Effect("patchfem.dynamics.propagator", "G_i = -base_i a(t)", ("modes",), ("motion",)),
    "drive.kind=force": Effect("patchfem.dynamics.propagator", "G_i = phi_i F(t)", ("modes",), ("motion",)),
    "drive.kind=free": Effect("patchfem.dynamics.propagator", "z(0), z'(0) given, G = 0", ("modes",), ("motion",)),
    "drive.waveform=sine": Effect("", "a(t) = a sin(2 pi f t)"),
    "drive.waveform=step": Effect("patchfem.structure.drives", "a(t) = a, or the base jumps by X: z(0) = -base X"),
    "drive.waveform=sweep": Effect("patchfem.structure.drives", "a(t) = a sin(2 pi int f dt), f' or f'/f constant"),
    "drive.waveform=levels": Effect("patchfem.structure.drives", "a(t) = a_k sin(2 pi f t), level after level"),
    "drive.waveform=file": Effect("patchfem.structure.drives", "a(t) straight between the rows of a table"),
    "structure.stiffening": Effect("patchfem.dynamics.march.joints", "F = k_3 x^3 at the output"),
    "accuracy.method=exact": Effect("patchfem.dynamics.events.events", "closed form between events"),
    "accuracy.method=march": Effect("patchfem.dynamics.march.loop_kernels",
                                    "exact propagator, path-mean force, Newton on the "
                                    "force residual"),
    "accuracy.method=duhamel": Effect("patchfem.dynamics.comparison.duhamel",
                                      "Duhamel's integral with forces linear in the step, "
                                      "fixed point (3.10)"),
    "accuracy.method=newmark": Effect("patchfem.dynamics.comparison.newmark",
                                      "average acceleration, stuck below a speed"),
    "accuracy.method=euler": Effect("patchfem.dynamics.comparison.euler", "explicit Euler"),
    "accuracy.method=harmonic": Effect("patchfem.dynamics.harmonic.harmonic",
                                       "x = Re sum X_k exp(i k w t); Coulomb: the map of "
                                       "events over a period"),
    "measured": Effect("", "overlay of measured rows"),
}

# an interface between two masses carries the keys of [friction] itself
EFFECTS |= {f"structure.interface.{name.removeprefix('friction.')}": effect._replace(needs=())
            for name, effect in EFFECTS.items() if name.startswith(("friction.law=", "friction.reading="))}

NOT_YET_BUILT = ("wear",)


def absent(named) -> list:
    """Every effect that is not among `named`, built or not, in the order of the chain."""
    return [name for name in (*EFFECTS, *NOT_YET_BUILT) if name not in set(named)]
