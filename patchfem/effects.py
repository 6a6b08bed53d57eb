"""Every effect a scene can name: what computes it, its equations, what it needs and what it gives.

An effect is a table of a scene or the value of its selector key. `plan` imports only the modules of the effects that a
scene names. A law of friction is such an effect with the keys that it has besides `static` and with what can run it.
Two places serve some laws alone and name them: loads that change in the contact (`runs.rig.varying_load`) and the lanes
of a study (`runs.batch.lumped.lanes`).

A law is carried by the bench, by a rig of one interface under a constant load (it can run there), and by what its
record names: "shear" of pieces that give way, "joints" (several interfaces, springs that bend, strips that yaw),
"varying-load" in a rig, "harmonic" balance, "two-directions" of a bench, "exact" events,
"pieces" of it (elements that stick or slip, exact from yield to yield), "grooves" whose flanks the load
climbs, a "plane" in which an interface of a rig slides. Traits: "set-valued" (it holds without a stretch), "bonds" (the
sum 2.17 with its readings and orders), "averaged" (over the pressure behind a point), "timeless" (no rate of the slide
changes its force), "memoryless" (of the last motion alone), "creeps" (it never holds), "cells" (a density cut into
elements), "overshoots" (its force exceeds that of a steady slide, while the slide turns, for less than a step of a
march).

A shape of the gap is an effect, its table in `scene.keys.contact` and a function of `contact.gaps`. A waveform of the
drive is an effect with its keys and a row of `BUILDERS` in its module, `structure.drives` unless the effect names another.
Its traits are the words of the properties of `Waveform`, which is all that other files ask of it.
"""

from importlib import import_module
from typing import NamedTuple

# masses or modes of a rig, whose matrices are full; here, for a scene loads no numpy
MAX_COORDINATES = 2000


class Effect(NamedTuple):
    """module: "" where the scene's own values suffice; needs, gives: what earlier effects hand on; of a law of friction
    or a waveform the keys that it must have, "a|b" for one of two, and those that it may have besides; of a law what
    carries it; of both their traits; phrase: of a waveform, what the page says of it (see `Waveform`)."""

    module: str
    equations: str
    needs: tuple = ()
    gives: tuple = ()
    keys: tuple = ("", "")
    law_supports: str = ""
    traits: str = ""
    phrase: str = ""


class Waveform(NamedTuple):
    """Waveform of the drive as other files see it: they ask these properties and never compare its name.

    Attributes
    ----------
    name : str
        Value of `drive.waveform`; "" of a release, which has none.
    keys : tuple of str
        Keys of [drive] that it requires, and those that it takes besides, separated by blanks.
    traits : str
        Words that turn the properties below on: "sine levels swept step random base-only endless".
    phrase : str
        What the page says of the drive. `{what}` is the driven quantity ("base acceleration"), `{level}` its size,
        `{place}` the driven mass; a key such as `{frequency}` is its value in the scene. "" for general words.
    """

    name: str = ""
    keys: tuple = ("", "")
    traits: str = ""
    phrase: str = ""

    def takes(self, key: str) -> bool:
        """Return whether the waveform requires or takes a key of [drive]."""
        return key in " ".join(self.keys).split()

    def _has(self, trait: str) -> bool:
        return trait in self.traits.split()

    @property
    def required_keys(self) -> list:
        """Keys of [drive] that the waveform requires."""
        return self.keys[0].split()

    @property
    def is_sine(self) -> bool:
        """Whether the drive is a single sine of constant amplitude and frequency."""
        return self._has("sine")

    @property
    def has_levels(self) -> bool:
        """Whether the drive is a sine whose amplitude changes from level to level of `drive.levels`."""
        return self._has("levels")

    @property
    def is_swept(self) -> bool:
        """Whether the drive is a sine whose frequency runs from `drive.from` to `drive.to`."""
        return self._has("swept")

    @property
    def is_step(self) -> bool:
        """Whether the drive jumps at t = 0 and stays constant, so that the motion decays."""
        return self._has("step")

    @property
    def is_random(self) -> bool:
        """Whether the drive is a stationary random record; `drive.file` then holds its spectral density."""
        return self._has("random")

    @property
    def is_for_base_only(self) -> bool:
        """Whether the drive can only shake the base and is refused as a force."""
        return self._has("base-only")

    @property
    def needs_length(self) -> bool:
        """Whether the scene must say when the run ends, by `drive.cycles` or `drive.duration`."""
        return self._has("endless")

    @property
    def has_steady_motion(self) -> bool:
        """Whether a harmonic balance finds the steady motion, or the curve of steady motions."""
        return self.is_sine or self.has_levels or self.is_swept


GAP_MODULE = "patchfem.contact.gaps"  # a shape of the gap is a function there of the places x and the keys of its table


def _law(module: str, equations: str, keys: tuple, carries: str, traits: str = "") -> Effect:
    return Effect(
        f"patchfem.friction.{module}",
        equations,
        ("pressure",),
        ("traction",),
        keys,
        carries,
        traits,
    )


_SIZE = "acceleration displacement force"
GROOVE_EQUATION = (
    "F = V (t + phi)/(1 - phi t), V = N + m (t q'' + t' q'^2), t = A k sin(k q - phase)"
)


def _wave(
    equations: str,
    keys: tuple,
    traits: str = "",
    phrase: str = "",
    module: str = "patchfem.structure.drives",
) -> Effect:
    return Effect(
        module,
        equations,
        (),
        (),
        (keys[0], f"{keys[1]} cycles duration".strip()),
        "",
        traits,
        phrase,
    )


EFFECTS = {
    "contact": Effect(
        "patchfem.contact.unilateral",
        "w = g + theta x - delta + C f >= 0, f >= 0, f.w = 0, sum f = N",
        (),
        ("pressure",),
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
        "patchfem.contact.skin_laws", "f = A p_0 exp(-s/u_0), s = g + theta x - delta + C f"
    ),
    "contact.asperities.law=hertz": Effect(
        "patchfem.contact.skin_laws", "f = A 4/3 E* sqrt(R) eta int_s (z - s)^3/2 phi(z) dz"
    ),
    "contact.tilt": Effect(GAP_MODULE, "g += angle x"),
    "contact.load_line": Effect("", "sum f x = N offset, rotation free"),
    "contact.crown": Effect(GAP_MODULE, "g += x^2/(2 radius)"),
    "contact.profile": Effect(
        "patchfem.surface.nodes",
        "g += z(x); z is levelled and averaged over the elements at each node",
    ),
    "contact.strips": Effect(
        "patchfem.contact.strips",
        "C f_j >= R_j q - g - roll y_j for each strip j; q is the motion of the common holder",
    ),
    "contact.shear": Effect(
        "patchfem.slip.shear_modes", "slide_i = q - sum_j C_ij f_j", ("pressure", "traction"), ()
    ),
    "contact.grooves": Effect(
        "patchfem.friction.grooves", GROOVE_EQUATION, ("pressure",), ("traction",)
    ),
    "normal": Effect("", "sigma_n A = N at one point", (), ("pressure",)),
    "normal.grooves": Effect(
        "patchfem.friction.grooves", GROOVE_EQUATION, ("pressure",), ("traction",)
    ),
    "friction.law=coulomb": _law(
        "laws.coulomb",
        "|F| <= mu_s N stuck, F = mu_k N sgn(v) sliding (2.1)",
        ("", "kinetic"),
        "shear joints varying-load exact pieces grooves",
        "set-valued timeless memoryless",
    ),
    "friction.law=tanh": _law(
        "laws.tanh",
        "F = mu N tanh(v/v_0) (2.4)",
        ("reference_speed", ""),
        "joints varying-load harmonic grooves",
        "memoryless creeps",
    ),
    "friction.law=elastic-plastic": _law(
        "laws.elastic_plastic",
        "F' = k v, |F| <= mu N (3.12, corrected for reversals), k = stiffness or mu N/bond_length",
        ("bond_length|stiffness", ""),
        "shear joints varying-load harmonic pieces grooves plane",
        "timeless",
    ),
    "friction.law=nonlocal": _law(
        "bonds.quadrature",
        "tau = -mu_s int phi(R/eps) sigma_n u/|u| dL1/eps_0 (2.17)",
        (
            "bond_length",
            "kinetic reading order rest_growth slip_growth rest_speed "
            "initial_bonds breakaway spread temperature",
        ),
        "shear joints varying-load harmonic two-directions grooves",
        "bonds",
    ),
    "friction.law=convolution": _law(
        "laws.convolution",
        "tau = mu_s sgn(v) int phi(s/eps)/eps sigma_n(x - s sgn v) ds (Oden, Pires)",
        ("bond_length", "order spread"),
        "exact",
        "averaged set-valued timeless memoryless",
    ),
    "friction.law=iwan": _law(
        "laws.iwan",
        "F = int rho(phi) (u - x_phi) dphi, rho = R phi^chi + S delta(phi - phi_max) (Segalman)",
        ("stiffness chi beta", ""),
        "joints harmonic pieces",
        "timeless cells",
    ),
    "friction.law=bouc-wen": _law(
        "laws.bouc_wen",
        "F = mu N z, z' = v/eps (1 - |z|^n (s sgn(v z) + 1 - s)) (Wen)",
        ("stiffness", "exponent shape"),
        "joints harmonic",
        "timeless",
    ),
    "friction.law=lugre": _law(
        "laws.lugre",
        "F = k z + s_1 z' + s_2 v, z' = v - k |v| z/g(v), g = mu_k N + "
        "(mu_s - mu_k) N exp(-(v/v_s)^2) (Canudas de Wit; Dahl: mu_k = mu_s, no damping)",
        ("stiffness stribeck_speed", "kinetic micro_damping viscous"),
        "joints harmonic",
        "overshoots",
    ),
    "friction.reading=stretch": Effect(
        "patchfem.friction.bonds.recursion", "phi: (|u|/eps)^p exp(-int dR/eps)/Gamma(p+1)"
    ),
    "friction.reading=report": Effect(
        "patchfem.friction.bonds.quadrature", "phi: (R/eps)^p exp(-R/eps)/Gamma(p+1) (2.14)"
    ),
    "friction.temperature": Effect(
        "patchfem.friction.bonds.temperature",
        "a_s = a_ref exp(T_a (1/T_ref - 1/T_s)), l_k = l_ref exp(T_l (1/T_s - 1/T_ref)) (2.13)",
    ),
    "slide.kind=constant": Effect("", "q = speed t", (), ("motion",)),
    "slide.kind=sine": Effect("", "q = amplitude sin(2 pi f t)", (), ("motion",)),
    "slide.kind=triangle": Effect(
        "", "q moves between -amplitude and +amplitude at constant speed", (), ("motion",)
    ),
    "slide.kind=dwell": Effect(
        "",
        "q = speed t, then q is constant for the time `hold` (2.10 with v = 0), then "
        "the slide goes on at the same speed",
        (),
        ("motion",),
    ),
    "slide.kind=file": Effect(
        "patchfem.inputs.slides", "q is linear between the rows of a table", (), ("motion",)
    ),
    "structure": Effect(
        "patchfem.structure.modes",
        "z_i'' + 2 zeta_i w_i z_i' + w_i^2 z_i = G_i + g_i (3.4)",
        (),
        ("modes",),
    ),
    "structure.reduced": Effect(
        "patchfem.structure.reduced",
        "x = V y; V contains constraint modes and "
        "fixed-interface modes, or free modes and residual attachment modes",
        (),
        ("modes",),
    ),
    "structure.bonded": Effect(
        "patchfem.structure.bonded", "K += k s s^T, D += c s s^T / m", ("modes",)
    ),
    "structure.start": Effect("patchfem.structure.starts", "z(0) = Phi^-1 x(0) (3.2)", ("modes",)),
    "drive.kind=base": Effect(
        "patchfem.dynamics.propagator", "G_i = -base_i a(t)", ("modes",), ("motion",)
    ),
    "drive.kind=force": Effect(
        "patchfem.dynamics.propagator", "G_i = phi_i F(t)", ("modes",), ("motion",)
    ),
    "drive.kind=free": Effect(
        "patchfem.dynamics.propagator", "z(0), z'(0) given, G = 0", ("modes",), ("motion",)
    ),
    "drive.waveform=sine": _wave(
        "a(t) = a sin(2 pi f t)",
        ("frequency", _SIZE),
        "sine endless",
        "{what} of {level} at {frequency}{place}",
        "patchfem.structure.drive_sizes",
    ),
    "drive.waveform=step": _wave(
        "a(t) = a; or the base is displaced by X at t = 0: z(0) = -base X",
        ("", _SIZE),
        "step endless",
        "a step of {level} in {what}{place}",
    ),
    "drive.waveform=sweep": _wave(
        "a(t) = a sin(2 pi int f dt), f' or f'/f constant",
        ("from to", f"rate log_rate {_SIZE}"),
        "swept",
        "{what} of {level} swept from {from} to {to}{place}",
    ),
    "drive.waveform=levels": _wave(
        "a(t) = a_k sin(2 pi f t), level after level",
        ("frequency levels", "onset onset_length"),
        "levels endless",
        "{count} levels of {what} from {first} to {last} at {frequency}{place}",
    ),
    "drive.waveform=file": _wave(
        "a(t) is linear between the rows of a table",
        ("file", ""),
        "",
        "recorded {what} of {file}{place}",
    ),
    "drive.waveform=tones": _wave(
        "a(t) = sum_k a_k sin(2 pi f_k t + phi_k)",
        ("frequencies accelerations", "phases"),
        "base-only endless",
        "base acceleration of {accelerations} at {frequencies}",
        "patchfem.structure.tones",
    ),
    "drive.waveform=random": _wave(
        "a(t) = sum_k A_k cos 2 pi f_k t + B_k sin 2 pi f_k t, A_k, B_k normal of variance "
        "G(f_k)/T",
        ("", "spectrum file from to seed"),
        "random base-only endless",
        "random {what} {density}, record {seed}",
        "patchfem.structure.noise",
    ),
    "structure.stiffening": Effect("patchfem.dynamics.march.joints", "F = k_3 x^3 at the output"),
    "accuracy.method=exact": Effect(
        "patchfem.dynamics.events.histories", "closed form or series between events"
    ),
    "accuracy.method=march": Effect(
        "patchfem.dynamics.march.loop_kernels",
        "exact propagator of the modes; the force is averaged over the path of each step "
        "and found by Newton's method",
    ),
    "accuracy.method=harmonic": Effect(
        "patchfem.dynamics.harmonic.harmonic",
        "x = Re sum X_k exp(i k w t); with law `coulomb`: the "
        "exact motion from event to event, found so that it repeats after one period",
    ),
    "wear": Effect(
        "patchfem.wear.depth",
        "g += h, dh = coefficient p ds at each point; with form 'energy' dh = coefficient tau ds",
        ("pressure", "traction"),
    ),
    "wear.friction": Effect(
        "", "mu = mu_0 c(h), eps = eps_0 l(h), h = worn volume/area", ("traction",)
    ),
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

# an interface between two masses carries the keys of [friction] itself
EFFECTS |= {
    f"structure.interface.{name.removeprefix('friction.')}": effect._replace(needs=())
    for name, effect in EFFECTS.items()
    if name.startswith(("friction.law=", "friction.reading="))
}


def import_effect(name: str):
    """The module that computes an effect, imported now."""
    return import_module(EFFECTS[name].module)


def absent_effects(named) -> list:
    """Every effect that is not among `named`, in the order of the chain."""
    there = set(named)
    return [name for name in EFFECTS if name not in there]


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
        name.removeprefix("drive.waveform="), effect.keys, effect.traits, effect.phrase
    )
    for name, effect in EFFECTS.items()
    if name.startswith("drive.waveform=")
}
NO_WAVEFORM = Waveform()  # of a release, and of a name that is no waveform
SINE_WAVEFORM = WAVEFORMS["sine"]  # waveform of a scene that names none
BOND_LIST_SUPPORT = "two-directions"  # what carries the readings and orders of 2.17 that need the sum over all bonds


def law_has_trait(law: str | None, trait: str) -> bool:
    """Whether a law of friction, by its name in a scene, has a trait; none has that is not there."""
    return law in LAWS and trait in LAWS[law].traits.split()


def find_waveform(drive) -> Waveform:
    """Return the waveform of a [drive] table; NO_WAVEFORM without a drive, of a release and of an unknown name."""
    if drive is None or drive.kind == "free":
        return NO_WAVEFORM
    return WAVEFORMS.get(drive.waveform, NO_WAVEFORM)


def is_bond_list(friction) -> bool:
    """Whether the law of a [friction] table is a sum over all bonds: any but the stretch reading with order = 1."""
    return law_has_trait(friction.law, "bonds") and (
        friction.reading == "report" or friction.order not in (1, None)
    )


def law_supports(friction, word: str) -> bool:
    """Whether the law of a [friction] table runs with what `word` stands for."""
    words = BOND_LIST_SUPPORT if is_bond_list(friction) else LAWS[friction.law].carries
    return word in words.split()


def describe_law(friction) -> str:
    """The law of a [friction] table as words, with the reading or the order that makes it a sum over all bonds."""
    if not is_bond_list(friction):
        return f"law '{friction.law}'"
    return f"law '{friction.law}' of " + (
        "reading 'report'" if friction.reading == "report" else f"order {friction.order:g}"
    )


def law_takes_key(law: str | None, key: str) -> bool:
    """Whether a law has a key; any may have it where the law is not known."""
    return law not in LAWS or key in " ".join(LAWS[law].keys).replace("|", " ").split()


def takes_stiffness_or_length(law: str | None) -> bool:
    """Whether a law is given its stiffness or the bond length over which its limit makes one."""
    return law in LAWS and "bond_length|stiffness" in LAWS[law].keys[0].split()


def displayed_absent_effects(names, engine: str | None) -> list:
    """Effects that a scene does not name, as people read them: without the method that the program chose itself."""
    return [name for name in names if name != f"accuracy.method={engine}"]


def laws_with_key(key: str) -> str:
    """The laws that have a key, as words: "coulomb and nonlocal"."""
    return join_words((name for name in LAWS if law_takes_key(name, key)), "and")


def suggest_laws(word: str, least: str = "", odd=None) -> str:
    """Alternative to a law that is not carried: "use law 'coulomb' or 'tanh'".

    least: what the law must carry besides; odd: the table of the law, of which the reading or the order may be all that
    is not carried.
    """
    wanted = {word, *least.split()}
    laws = [name for name, law in LAWS.items() if wanted <= set(law.carries.split())]
    own = odd.law if odd is not None and is_bond_list(odd) and odd.law in laws else ""
    instead = 'reading = "stretch" with order = 1, or ' if own else ""
    others = join_words((f"'{name}'" for name in laws if name != own), "or")
    return f"use {instead}law {others}"


ALTERNATIVES = {  # what serves where two effects cannot stand together yet
    "order": "use order = 1",
    "recursion": 'use reading = "stretch" with order = 1 and without breakaway',
    "elastic range": "set breakaway = 0",
    "kinetic": "leave out the key kinetic",
    "shapes": "put the shapes on the upper piece",
    "either": "leave one of the two out",
    "out": "leave out this entry",
    "linear": "use 'linear'",
    "march": "use 'march'",
    "march or stiff": "use 'march', or law 'elastic-plastic' with a short bond_length",
    "stiff": "use law 'elastic-plastic' with a short bond_length, which approximates Coulomb friction",
}


def not_supported_message(what: str, meanwhile: str) -> str:
    """The sentence for what cannot stand together yet: `what`, and a word of MEANWHILE or what to do in words."""
    bare = what.startswith(("beside ", "with ", "in "))
    said = f"not supported yet {what}" if bare else f"{what} is not supported yet"
    return f"{said}; {ALTERNATIVES.get(meanwhile, meanwhile)}"


def join_words(names, last: str) -> str:
    """Names with commas and a word before the last."""
    *first, end = names
    return f"{', '.join(first)} {last} {end}" if first else end
