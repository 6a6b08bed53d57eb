"""Registry of the physical effects and methods that a scene can request.

An effect is a table of a scene, such as `contact.crown`, or the value of a key, such as `friction.law=iwan`. EFFECTS
gives the module and the equation of each effect. Only the modules of the effects in a scene are imported.

Friction laws, gap shapes and waveforms have further fields. Those of a law are its keys in addition to `static`, its
supported features and its traits, as words separated by blanks. Every law can be used in a bench, and in a rig with one
interface under a constant load. Optional features are:

- `shear`: elastic pieces ([contact.shear]);
- `exact`: steady motions of the whole interface as one rigid element;
- `pieces`: elements that stick or slip, for patches that slip part by part;
- `harmonic`: motions from event to event, and steady motions over one period, by a module of `hybrid.laws`;
- `march`: time steps (`time_steps.laws`).

Traits of laws:

- `set-valued`: the interface sticks rigidly below the friction limit;
- `bonds`: the law is the sum over bonds (2.17) with its readings and orders;
- `averaged`: the friction stress is an average over the pressure behind a point;
- `timeless`: the force does not depend on the sliding speed;
- `memoryless`: the force depends only on the current motion;
- `creeps`: the interface never sticks;
- `cells`: a continuous distribution of elements is discretised into cells.

`runs.rig.joints` and `time_steps.laws` have their own lists of supported laws.

A gap shape has a table in `scene.keys.contact` and a function in `contact.gaps`. A waveform has a function in the table
`DRIVE_BUILDERS` of its module; the class `Waveform` describes its traits.
"""

import re
from importlib import import_module
from typing import NamedTuple

from .exceptions import PatchfemError

# largest number of masses or modes of a rig, whose matrices are dense; defined here because parsing a scene must not
# import numpy
MAX_RIG_COORDINATES = 2000


class Effect(NamedTuple):
    """Physical effect or method that a scene can request.

    - module: module that computes the effect; "" if the effect requires no module.
    - equations: equations of the effect for the report page.
    - keys: required keys of a law or a waveform ("a|b" means one of two), and its optional keys.
    - supports: engines and features that support the law.
    - traits: traits of the law or the waveform.
    """

    module: str
    equations: str
    keys: tuple[str, str] = ("", "")
    supports: str = ""
    traits: str = ""


class Waveform(NamedTuple):
    """Waveform of the drive.

    Other modules use the properties of a waveform and never compare its name.

    - name: value of `drive.waveform`; "" for a release, which has no waveform.
    - keys: required and optional keys of the table [drive], each separated by blanks.
    - traits: words that set the properties below: "sine levels swept step random base-only endless".
    """

    name: str = ""
    keys: tuple[str, str] = ("", "")
    traits: str = ""

    def accepts_key(self, key: str) -> bool:
        """Return whether the waveform accepts a key of the table [drive]."""
        return key in re.findall(r"\w+", " ".join(self.keys))

    def _has_trait(self, trait: str) -> bool:
        """Return whether the waveform has a trait, one of the words of its row in WAVEFORMS."""
        return trait in self.traits.split()

    @property
    def is_sine(self) -> bool:
        """Whether the drive is a single sine of constant amplitude and frequency."""
        return self._has_trait("sine")

    @property
    def has_levels(self) -> bool:
        """Whether the drive is a sine whose amplitude takes the values of `drive.levels` in turn."""
        return self._has_trait("levels")

    @property
    def is_swept(self) -> bool:
        """Whether the drive is a sine whose frequency varies from `drive.from` to `drive.to`."""
        return self._has_trait("swept")

    @property
    def is_step(self) -> bool:
        """Whether the drive is a step at t = 0, after which the motion decays."""
        return self._has_trait("step")

    @property
    def is_random(self) -> bool:
        """Whether the drive is a random signal with a given spectral density."""
        return self._has_trait("random")

    @property
    def is_for_base_only(self) -> bool:
        """Whether the drive can only be a motion of the base, not a force."""
        return self._has_trait("base-only")

    @property
    def has_steady_motion(self) -> bool:
        """Whether method `harmonic` can compute the steady-state motion, or a curve of such motions."""
        return self.is_sine or self.is_swept


# Module with a function of the coordinates x and the scene table for each gap shape.
GAP_MODULE = "patchfem.contact.gaps"
GROOVE_EQUATION = (
    "F = V (t + phi)/(1 - phi t), V = N + m (t q'' + t' q'^2), t = A k sin(k q - phase)"
)
# keys of the table [drive] for the amplitude of a drive
_DRIVE_AMPLITUDE_KEYS = "acceleration|displacement force"


def _make_law(
    module: str, equations: str, keys: tuple[str, str], supports: str, traits: str = ""
) -> Effect:
    """Return the effect of a friction law.

    Parameters
    ----------
    module : str
        Module inside patchfem.friction.
    equations : str
        Equations of the law as text, for the report page.
    keys : tuple of str
        Required and optional keys.
    supports, traits : str
        Words, separated by blanks, for engines and features that know the law, and for its properties.
    """
    return Effect(f"patchfem.friction.{module}", equations, keys, supports, traits)


def _make_waveform(
    equations: str,
    keys: tuple[str, str],
    traits: str = "",
    module: str = "patchfem.structure.drives",
) -> Effect:
    """Return the effect of a waveform, which also accepts the keys `cycles` and `duration`.

    `equations` are those of the waveform as text, for the report page, `traits` are words for its properties, and `module`
    computes it.
    """
    required, optional = keys
    if "endless" in traits:
        required = f"{required} cycles|duration".strip()
    else:
        optional = f"{optional} cycles|duration".strip()
    return Effect(module, equations, (required, optional), traits=traits)


EFFECTS = {
    "contact": Effect(
        "patchfem.contact.unilateral",
        "w = g + theta x - delta + C f >= 0, f >= 0, f.w = 0, sum f = N",
    ),
    "contact.coating": Effect(
        "", "the elements of the coating have the Lame constants of the coating"
    ),
    "contact.upper": Effect(
        "", "C = C_upper + C_lower; each piece has its own size, ends, materials and coating"
    ),
    "contact.lower": Effect(
        "", "C = C_upper + C_lower; each piece has its own size, ends, materials and coating"
    ),
    "contact.approach": Effect("", "delta given, N = sum f"),
    "contact.holder": Effect("", "sum f x = N offset + K theta, slide_i = q - F/K_t"),
    "contact.step": Effect(GAP_MODULE, "g += height H(x - at)"),
    "contact.asperities.law=linear": Effect("", "C += diag(1/(k_n A)), C_tt += diag(1/(k_t A))"),
    "contact.asperities.law=exponential": Effect(
        "patchfem.contact.asperity_laws", "f = A p_0 exp(-s/u_0), s = g + theta x - delta + C f"
    ),
    "contact.asperities.law=hertz": Effect(
        "patchfem.contact.asperity_laws", "f = A 4/3 E* sqrt(R) eta int_s (z - s)^3/2 phi(z) dz"
    ),
    "contact.tilt": Effect(GAP_MODULE, "g += angle x + roll y"),
    "contact.load_line": Effect("", "sum f x = N offset, rotation free"),
    "contact.crown": Effect(GAP_MODULE, "g += x^2/(2 radius) + y^2/(2 across)"),
    "contact.profile": Effect(
        "patchfem.surface.nodes",
        "g += z(x); z is levelled and averaged over the elements at each node",
    ),
    "contact.area": Effect(
        "patchfem.contact.cells",
        "u = sum_k c(k) p_k cos(k_x x) cos(k_y y) + free sides; 0 <= p <= hardness",
    ),
    "contact.shear": Effect("patchfem.slip.shear_modes", "slide_i = q - sum_j C_ij f_j"),
    "contact.grooves": Effect("patchfem.friction.grooves", GROOVE_EQUATION),
    "normal": Effect("", "sigma_n A = N at one point"),
    "normal.grooves": Effect("patchfem.friction.grooves", GROOVE_EQUATION),
    "friction.law=coulomb": _make_law(
        "laws.coulomb",
        "|F| <= mu_s N stuck, F = mu_k N sgn(v) sliding (2.1)",
        ("", "kinetic"),
        "shear exact pieces march",
        "set-valued timeless memoryless",
    ),
    "friction.law=tanh": _make_law(
        "laws.tanh",
        "F = mu N tanh(v/v_0) (2.4)",
        ("reference_speed", ""),
        "harmonic march",
        "memoryless creeps",
    ),
    "friction.law=elastic-plastic": _make_law(
        "laws.elastic_plastic",
        "F' = k v, |F| <= mu N (3.12, corrected for reversals), k = stiffness or mu N/bond_length",
        ("bond_length|stiffness", ""),
        "shear harmonic pieces march",
        "timeless",
    ),
    "friction.law=nonlocal": _make_law(
        "bonds.parameters",
        "tau = mu_s int phi(R/eps) sigma_n u/|u| dL1/eps_0 (2.17)",
        (
            "bond_length",
            "kinetic reading order rest_growth slip_growth rest_speed "
            "initial_bonds spread temperature",
        ),
        "shear harmonic march",
        "bonds",
    ),
    "friction.law=convolution": _make_law(
        "laws.convolution",
        "tau = mu_s sgn(v) int phi(s/eps)/eps sigma_n(x - s sgn v) ds (Oden, Pires)",
        ("bond_length", "order spread"),
        "exact march",
        "averaged set-valued timeless memoryless",
    ),
    "friction.law=iwan": _make_law(
        "laws.iwan",
        "F = int rho(phi) (u - x_phi) dphi, rho = R phi^chi + S delta(phi - phi_max) (Segalman)",
        ("stiffness chi beta", ""),
        "harmonic pieces march",
        "timeless cells",
    ),
    "friction.law=bouc-wen": _make_law(
        "laws.bouc_wen",
        "F = mu N z, z' = v/eps (1 - |z|^n (s sgn(v z) + 1 - s)) (Wen)",
        ("stiffness", "exponent shape"),
        "harmonic march",
        "timeless",
    ),
    "friction.law=lugre": _make_law(
        "laws.lugre",
        "F = k z + s_1 z' + s_2 v, z' = v - k |v| z/g(v), g = mu_k N + "
        "(mu_s - mu_k) N exp(-(v/v_s)^2) (Canudas de Wit; Dahl: mu_k = mu_s, no damping)",
        ("stiffness stribeck_speed", "kinetic micro_damping viscous"),
        "harmonic march",
    ),
    "friction.reading=stretch": Effect(
        "patchfem.friction.bonds.point_kernels", "phi: (|u|/eps)^p exp(-int dR/eps)/Gamma(p+1)"
    ),
    "friction.reading=report": Effect(
        "patchfem.friction.bonds.strip_kernels", "phi: (R/eps)^p exp(-R/eps)/Gamma(p+1) (2.14)"
    ),
    "friction.temperature": Effect(
        "patchfem.friction.bonds.temperature",
        "a_s = a_ref exp(T_a (1/T_ref - 1/T_s)), l_k = l_ref exp(T_l (1/T_s - 1/T_ref)) (2.13)",
    ),
    "slide.kind=constant": Effect("", "q = speed t"),
    "slide.kind=sine": Effect("", "q = amplitude sin(2 pi f t)"),
    "slide.kind=triangle": Effect(
        "", "q moves between -amplitude and +amplitude at constant speed"
    ),
    "slide.kind=dwell": Effect(
        "",
        "q = speed t, then q is constant for the time `hold` (2.10 with v = 0), then "
        "the slide goes on at the same speed",
    ),
    "slide.kind=file": Effect("patchfem.inputs.slides", "q is linear between the rows of a table"),
    "structure": Effect(
        "patchfem.structure.modes", "z_i'' + 2 zeta_i w_i z_i' + w_i^2 z_i = G_i + g_i (3.4)"
    ),
    "structure.reduced": Effect(
        "patchfem.structure.reduced",
        "x = V y; V contains constraint modes and "
        "fixed-interface modes, or free modes and residual attachment modes",
    ),
    "structure.bonded": Effect("patchfem.structure.bonded", "K += k s s^T, D += c s s^T / m"),
    "structure.start": Effect("patchfem.structure.starts", "z(0) = Phi^-1 x(0) (3.2)"),
    "drive.kind=base": Effect("patchfem.structure.drives", "G_i = -base_i a(t)"),
    "drive.kind=force": Effect("patchfem.structure.drives", "G_i = phi_i F(t)"),
    "drive.kind=free": Effect("patchfem.structure.starts", "z(0), z'(0) given, G = 0"),
    "drive.waveform=sine": _make_waveform(
        "a(t) = a sin(2 pi f t)",
        (f"frequency {_DRIVE_AMPLITUDE_KEYS}", ""),
        "sine endless",
        "patchfem.structure.drive_sizes",
    ),
    "drive.waveform=step": _make_waveform(
        "a(t) = a; or the base is displaced by X at t = 0: z(0) = -base X",
        (_DRIVE_AMPLITUDE_KEYS, ""),
        "step endless",
    ),
    "drive.waveform=sweep": _make_waveform(
        "a(t) = a sin(2 pi int f dt), f' or f'/f constant",
        (f"from to rate|log_rate {_DRIVE_AMPLITUDE_KEYS}", ""),
        "swept",
    ),
    "drive.waveform=levels": _make_waveform(
        "a(t) = a_k sin(2 pi f t), level after level",
        ("frequency levels", "onset onset_length"),
        "levels endless",
    ),
    "drive.waveform=file": _make_waveform(
        "a(t) is linear between the rows of a table",
        ("file", ""),
    ),
    "drive.waveform=tones": _make_waveform(
        "a(t) = sum_k a_k sin(2 pi f_k t + phi_k)",
        ("frequencies accelerations", "phases"),
        "base-only endless",
        "patchfem.structure.tones",
    ),
    "drive.waveform=random": _make_waveform(
        "a(t) = sum_k A_k cos 2 pi f_k t + B_k sin 2 pi f_k t, A_k, B_k normal of variance "
        "G(f_k)/T",
        ("spectrum|file", "from to seed"),
        "random base-only endless",
        "patchfem.structure.noise",
    ),
    "structure.stiffening": Effect(
        "patchfem.time_steps.springs_kernels", "F = k_3 x^3 at the output"
    ),
    "accuracy.method=exact": Effect(
        "patchfem.hybrid.runs",
        "Runge-Kutta steps of order 8 that end where a law changes its regime, with a step error of 1e-12",
    ),
    "accuracy.method=march": Effect(
        "patchfem.time_steps.march_kernels",
        "exact motion of the modes; the force is averaged over the path of each step "
        "and found by Newton's method",
    ),
    "accuracy.method=harmonic": Effect(
        "patchfem.hybrid.periodic",
        "the motion from event to event, found so that it repeats after one period of the drive",
    ),
    "wear": Effect(
        "patchfem.wear.depth",
        "g += h, dh = coefficient p ds at each point; with form 'energy' dh = coefficient tau ds",
    ),
    "wear.friction": Effect("", "mu = mu_0 c(h), eps = eps_0 l(h), h = worn volume/area"),
    "measured": Effect("", "measurements plotted over the results"),
    "measured.reading=fundamental": Effect(
        "patchfem.response.spectrum", "|a_1| of a(t) = Re sum a_n exp(i n w t)"
    ),
    "measured.reading=rms": Effect("patchfem.response.spectrum", "sqrt(1/T int a^2 dt)"),
    "measured.reading=lowpass": Effect(
        "patchfem.response.spectrum",
        "max |Re sum a_n H(n f) exp(i n w t)|, H = 1/(1 + sqrt2 s + s^2), s = i n f/cutoff",
    ),
    "sweep": Effect(
        "patchfem.campaigns.sweeps.cases",
        "one case for each combination of the values of the swept keys",
    ),
}

# tables [[structure.interface]] have the same laws and readings as [friction]
EFFECTS |= {
    f"structure.interface.{name.removeprefix('friction.')}": effect
    for name, effect in EFFECTS.items()
    if name.startswith(("friction.law=", "friction.reading="))
}


def import_effect(name: str):
    """Import and return the module that computes the effect `name`, such as "contact.tilt"."""
    return import_module(EFFECTS[name].module)


def list_absent_effects(names) -> list[str]:
    """Return all effects except those in `names`, in the order of EFFECTS.

    Raises
    ------
    PatchfemError
        If a name has no entry in EFFECTS.
    """
    present = set(names)
    if unknown := sorted(present - set(EFFECTS)):
        raise PatchfemError(
            f"{unknown[0]}: a scene can ask for this effect, but it has no entry in EFFECTS of "
            "patchfem/effects.py; add an entry with its module and equation"
        )
    return [name for name in EFFECTS if name not in present]


def list_displayed_absent_effects(names, engine: str | None) -> list[str]:
    """Return the names of absent effects without the method that the program selected itself.

    `engine` is that method.
    """
    return [name for name in names if name != f"accuracy.method={engine}"]


LAWS = {
    name.removeprefix("friction.law="): effect
    for name, effect in EFFECTS.items()
    if name.startswith("friction.law=")
}
GAP_SHAPES = {
    name.removeprefix("contact."): effect
    for name, effect in EFFECTS.items()
    if effect.module == GAP_MODULE
}
WAVEFORMS = {
    name.removeprefix("drive.waveform="): Waveform(
        name.removeprefix("drive.waveform="), effect.keys, effect.traits
    )
    for name, effect in EFFECTS.items()
    if name.startswith("drive.waveform=")
}
NO_WAVEFORM = Waveform()  # waveform of a release and of an unknown name


def find_waveform(drive) -> Waveform:
    """Return the waveform of a [drive] table.

    Returns NO_WAVEFORM without a drive, for free motion, and for an unknown name.
    """
    if drive is None or drive.kind == "free":
        return NO_WAVEFORM
    return WAVEFORMS.get(drive.waveform, NO_WAVEFORM)


def law_has_trait(law: str | None, trait: str) -> bool:
    """Return whether a friction law has a trait, such as "bonds", or False for an unknown law."""
    return law in LAWS and trait in LAWS[law].traits.split()


def law_takes_key(law: str | None, key: str) -> bool:
    """Return whether a friction law accepts a key; True for an unknown law."""
    return law not in LAWS or key in " ".join(LAWS[law].keys).replace("|", " ").split()


def law_takes_stiffness_or_length(law: str | None) -> bool:
    """Return whether a law accepts either a stiffness or a bond length, which determines it."""
    return law in LAWS and "bond_length|stiffness" in LAWS[law].keys[0].split()


def needs_bond_list(friction) -> bool:
    """Return whether a [friction] table requires the sum over all bonds instead of a recursion."""
    return law_has_trait(friction.law, "bonds") and (
        friction.reading == "report" or friction.order not in (1, None)
    )


def has_return_map(friction) -> bool:
    """Return whether time steps can integrate the law of a [friction] table."""
    return "march" in LAWS[friction.law].supports.split()


def law_supports(friction, feature: str) -> bool:
    """Return whether the law of a [friction] table supports an engine or a feature; a sum over all bonds supports none."""
    return not needs_bond_list(friction) and feature in LAWS[friction.law].supports.split()


def describe_law(friction) -> str:
    """Return the name of the law of a [friction] table for use in a message.

    The name includes the reading or the order if it requires the sum over all bonds.
    """
    if not needs_bond_list(friction):
        return f"law '{friction.law}'"
    if friction.reading == "report":
        return f"law '{friction.law}' of reading 'report'"
    return f"law '{friction.law}' of order {friction.order:g}"


def name_laws_with_key(key: str) -> str:
    """Return the names of the laws that accept a key, such as "coulomb and nonlocal"."""
    return join_words((name for name in LAWS if law_takes_key(name, key)), "and")


def suggest_laws(feature: str, other_features: str = "", friction=None) -> str:
    """Return advice to use a law that supports a feature, such as "use law 'coulomb' or 'tanh'".

    Parameters
    ----------
    feature : str
        Feature that the current law does not support.
    other_features : str
        Further features that the suggested laws must support, separated by blanks.
    friction : table or None
        Current [friction] table. If only its reading or its order is unsupported, a change of these is suggested first.

    Returns
    -------
    str
    """
    required = {feature, *other_features.split()}
    laws = [name for name, law in LAWS.items() if required <= set(law.supports.split())]
    instead = ""
    if friction is not None and needs_bond_list(friction) and friction.law in laws:
        instead = 'reading = "stretch" with order = 1, or '
        laws.remove(friction.law)
    quoted = [f"'{name}'" for name in laws]
    return f"use {instead}law {join_words(quoted, 'or')}"


def describe_unsupported(combination: str, remedy: str) -> str:
    """Return the message for a combination of effects that is not supported, with its remedy."""
    if combination.startswith("with "):
        return f"not supported yet {combination}; {remedy}"
    return f"{combination} is not supported yet; {remedy}"


def join_words(words, conjunction: str) -> str:
    """Join words with commas, and the last one with a conjunction."""
    *first, last = words
    return f"{', '.join(first)} {conjunction} {last}" if first else last
