"""Recipe of 150 random scenes of combinations of friction law and effect that release 2.1 refuses.

Every combination is drawn once, and further ones by chance. A scene is written by its seed alone, so that the recipe is
the record of the campaign: `python tests/support/brute` scores a version of the program on it.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

FIRST_SEED = 20261901
N_SCENES = 150
G = 9.80665  # standard gravity [m/s2]

PATH_LAWS = ("iwan", "bouc-wen", "lugre")
LISTS = ("order 2", "report")
# Combinations that release 2.1 refuses: (kind of run, effect) -> laws. "stiffness" is an elastic-plastic law of a given
# stiffness, "order 2" and "report" are forms of law nonlocal.
REFUSED = {
    ("rig", "shear"): ("tanh", "convolution", *PATH_LAWS),
    ("rig", "yaw"): (*LISTS, "convolution"),
    ("rig", "lower"): ("coulomb", "tanh", "elastic-plastic", "convolution", *PATH_LAWS),
    ("rig", "load"): ("stiffness", "order 2", "convolution", *PATH_LAWS),
    ("rig", "pitch"): ("order 2", "convolution", *PATH_LAWS),
    ("rig", "shear and pitch"): ("coulomb", "tanh", "order 2", "convolution", *PATH_LAWS),
    ("rig", "grooves"): ("stiffness", *LISTS, "convolution", *PATH_LAWS),
    ("rig", "shear and grooves"): ("tanh", *LISTS, "convolution", *PATH_LAWS),
    ("rig", "interfaces"): (*LISTS, "convolution"),
    ("rig", "patch of interfaces"): (*LISTS, "convolution"),
    ("rig", "shear of interfaces"): ("tanh", "nonlocal", *LISTS, "convolution", *PATH_LAWS),
    ("bench", "shear"): ("tanh", "convolution", *PATH_LAWS),
    ("bench", "lower"): ("elastic-plastic", *PATH_LAWS),
    ("bench", "load"): ("stiffness", "order 2", *PATH_LAWS),
    ("bench", "grooves"): ("stiffness", *LISTS, "convolution", *PATH_LAWS),
    ("bench", "shear and grooves"): ("tanh", *LISTS, "convolution", *PATH_LAWS),
}


class Scene(NamedTuple):
    """Scene of the recipe: seed, kind of run, effect, law, text and steps per cycle of its reference."""

    seed: int
    kind: str
    effect: str
    law: str
    text: str
    steps: int


class Sizes(NamedTuple):
    """Sizes from which the numbers of a scene are drawn.

    - limit: friction limit [N]; load: normal load [N]; static: coefficient of friction
    - omega: circular frequency of the drive [rad/s]
    - travel: scale of the slide [m]
    - patch_length: length of the patch [m]
    """

    limit: float
    load: float
    static: float
    omega: float
    travel: float
    patch_length: float


def list_combinations(shift: int = 0) -> list[tuple[str, str, str]]:
    """Return kind of run, effect and law of each scene."""
    combinations = [(*place, law) for place, laws in REFUSED.items() for law in laws]
    generator = np.random.default_rng(FIRST_SEED + shift)
    more = generator.integers(len(combinations), size=N_SCENES - len(combinations))
    return combinations + [combinations[k] for k in more]


def make_scenes(shift: int = 0) -> list[Scene]:
    """Return all scenes of the recipe, or others like them whose seeds are higher by `shift`."""
    parts = list_combinations(shift)
    return [make_scene(FIRST_SEED + shift + k, *part) for k, part in enumerate(parts)]


def make_scene(seed: int, kind: str, effect: str, law: str) -> Scene:
    """Return the scene of a seed for a kind of run, an effect and a law."""
    rng = np.random.default_rng(seed)
    load = rng.uniform(60, 250)
    static = rng.uniform(0.2, 0.6)
    mass = rng.uniform(0.4, 1.5)
    frequency = rng.uniform(80, 200)
    drive = frequency * rng.uniform(0.7, 1.3)
    omega = 2 * np.pi * drive
    limit = static * load
    travel = limit / (mass * omega**2)
    if kind == "bench":
        travel = rng.uniform(5e-6, 40e-6)
    length = rng.uniform(2e-3, 4e-3) if effect == "lower" else rng.uniform(8e-3, 16e-3)
    sizes = Sizes(limit, load, static, omega, travel, length)

    has_patch = effect not in ("load", "grooves", "interfaces")
    law_text = write_law(rng, law, sizes, has_patch=has_patch)
    is_list = law in LISTS
    n_cycles = 3 if is_list and kind == "rig" else (6 if kind == "rig" else 2)
    if "interfaces" in effect:
        text = _write_interfaces(rng, sizes, effect, law_text, mass)
    else:
        text = write_contact(rng, sizes, effect) + "[friction]\n" + law_text
        if kind == "rig":
            text += _write_modes(rng, sizes, effect, mass, frequency)
    if kind == "rig":
        acceleration = rng.uniform(1.0, 4.0) * limit / mass / G
        motion = f'[drive]\nkind = "base"\nacceleration = "{acceleration:.6g} g"\n'
    else:
        motion = f'[slide]\nkind = "sine"\namplitude = "{travel * 1e6:.6g} um"\n'
    text += f'{motion}frequency = "{drive:.6g} Hz"\ncycles = {n_cycles}\n'
    steps = 4000
    if has_patch:
        steps = 1600
    if is_list:
        steps = 800 if has_patch else 1600
    # A load that oscillates needs short steps, and most of all on a rigid point, which is badly conditioned and whose steps
    # are of order 1.
    if effect == "load" and not is_list:
        steps = 512_000 if (kind, law) == ("rig", "convolution") else 32_000
    return Scene(seed, kind, effect, law, text, steps)


def write_law(rng, law: str, sizes: Sizes, *, has_patch: bool) -> str:
    """Return the keys of a friction law with numbers drawn around the sizes of a scene."""
    stretch = sizes.travel * 10 ** rng.uniform(-1.5, -0.3)
    stiffness = f'stiffness = "{sizes.limit / stretch:.6g} N/m"\n'
    length = f'bond_length = "{stretch * 1e6:.6g} um"\n'
    speed = sizes.omega * sizes.travel
    keys: dict[str, Callable[[], str]] = {
        "coulomb": lambda: "",
        "tanh": lambda: f'reference_speed = "{speed * 10 ** rng.uniform(-1.5, -0.3):.6g} m/s"\n',
        "elastic-plastic": lambda: length,
        "stiffness": lambda: stiffness,
        "nonlocal": lambda: length,
        "order 2": lambda: length + "order = 2\n",
        "report": lambda: length + 'reading = "report"\n',
        "convolution": lambda: (
            f'bond_length = "{sizes.patch_length * rng.uniform(0.01, 0.06) * 1e6:.6g} um"\n'
            if has_patch
            else length
        ),
        "iwan": lambda: (
            f"{stiffness}chi = {rng.uniform(-0.9, -0.1):.4f}\nbeta = {rng.uniform(0.1, 3):.4f}\n"
        ),
        "bouc-wen": lambda: (
            f"{stiffness}exponent = {rng.uniform(1, 3):.4f}\nshape = {rng.uniform(0.5, 1):.4f}\n"
        ),
        "lugre": lambda: (
            f'{stiffness}stribeck_speed = "{speed * rng.uniform(0.2, 1):.6g} m/s"\n'
            f"kinetic = {sizes.static * rng.uniform(0.7, 1):.5f}\n"
            f'micro_damping = "{sizes.limit / speed * rng.uniform(0, 0.3):.6g} N s/m"\n'
            f'viscous = "{sizes.limit / speed * rng.uniform(0, 0.05):.6g} N s/m"\n'
        ),
    }
    names = {"stiffness": "elastic-plastic", "order 2": "nonlocal", "report": "nonlocal"}
    return f'law = "{names.get(law, law)}"\nstatic = {sizes.static:.5f}\n{keys[law]()}'


def _write_patch(rng, sizes: Sizes, name: str, shapes: str = "") -> str:
    """Return a table of a patch with a crown, so that its ends are free of pressure."""
    length = sizes.patch_length
    n_elements = rng.integers(10, 15)
    width, height = rng.uniform(8, 14), length * rng.uniform(0.4, 0.7) * 1e3
    # The sagitta of the crown is of the size of the approach, about load/(width modulus).
    approach = sizes.load / (width * 1e-3 * 1.1e11)
    radius = length**2 / 8 / (approach * rng.uniform(0.5, 2.5))
    return (
        f'[{name}]\nlength = "{length * 1e3:.6g} mm"\nwidth = "{width:.4f} mm"\nheight = "{height:.4f} mm"\n'
        f'load = "{sizes.load:.5f} N"\nelement_size = "{length * 1e6 / n_elements:.6f} um"\nsubstrate = "steel"\n'
        f'[{name}.crown]\nradius = "{radius:.5f} m"\n{shapes}'
    )


def write_contact(rng, sizes: Sizes, effect: str) -> str:
    """Return the tables of a point or a patch that carries the load."""
    slope = rng.uniform(0.02, 0.2)
    wavelength = rng.uniform(1.0, 8.0) * sizes.travel * 1e6
    carved = f'wavelength = "{wavelength:.5g} um"\namplitude = "{slope * wavelength / (2 * np.pi):.5g} um"\n'
    if effect in ("point", "load", "grooves"):
        text = f'[normal]\nload = "{sizes.load:.5f} N"\n'
        if effect == "point":
            return text
        if effect == "grooves":
            return f"{text}[normal.grooves]\n{carved}"
        amplitude = sizes.load * rng.uniform(0.1, 0.8)
        frequency = sizes.omega / (2 * np.pi) * rng.integers(1, 3)
        phase = rng.uniform(0, 2 * np.pi)
        return f'{text}amplitude = "{amplitude:.5f} N"\nfrequency = "{frequency:.6g} Hz"\nphase = "{phase:.4f} rad"\n'
    text = _write_patch(rng, sizes, "contact", 'on = "lower"\n' if effect == "lower" else "")
    if "shear" in effect:
        text += "[contact.shear]\n"
    if "grooves" in effect:
        text += f"[contact.grooves]\n{carved}"
    if effect == "yaw":
        text += f"[contact.strips]\ncount = {rng.integers(2, 5)}\n"
    return text


def _write_modes(rng, sizes: Sizes, effect: str, mass: float, frequency: float) -> str:
    """Return a structure of one or two modes."""
    motions = ["", ""]
    size = sizes.load / (0.01 * 1.1e11)  # approach [m]
    if "pitch" in effect:
        for k in range(2):
            pitch = rng.uniform(-0.5, 0.5) * size / sizes.travel / sizes.patch_length
            heave = rng.uniform(-0.2, 0.2) * size / sizes.travel
            motions[k] = f'pitch = "{pitch:.6g} rad/m"\nnormal = {heave:.6g}\n'
    if effect == "yaw":
        motions[0] = f'yaw = "{rng.uniform(5, 60):.5g} rad/m"\n'
    text = f'[structure]\nmoving_mass = "{mass:.6g} kg"\n'
    for k in range(rng.integers(1, 3) if effect != "yaw" else 1):
        slide = 1.0 if k == 0 else rng.uniform(-0.5, 0.5)
        value = frequency if k == 0 else frequency * rng.uniform(2, 4)
        text += (
            f'[[structure.mode]]\nname = "m{k}"\nfrequency = "{value:.6g} Hz"\ndamping = {rng.uniform(0.003, 0.03):.5f}\n'
            f"slide = {slide:.5f}\n{motions[k]}"
        )
    return text


def _write_interfaces(rng, sizes: Sizes, effect: str, law_text: str, mass: float) -> str:
    """Return two masses with an interface each, of the same law."""
    stiffness = mass * sizes.omega**2 * rng.uniform(0.6, 2, size=2)
    damping = 0.02 * mass * sizes.omega
    text = f'[structure]\nmasses = ["{mass:.6g} kg", "{mass * rng.uniform(0.5, 1.5):.6g} kg"]\n'
    for between, k in zip(("[1, 0]", "[2, 1]"), stiffness):
        text += f'[[structure.spring]]\nbetween = {between}\nstiffness = "{k:.6g} N/m"\n'
        text += f'[[structure.damper]]\nbetween = {between}\ncoefficient = "{damping:.6g} N s/m"\n'
    for k in (1, 2):
        name = "structure.interface"
        text += f"[[{name}]]\nbetween = [{k}, 0]\n{law_text}"
        if effect == "interfaces":
            text += f'load = "{sizes.load * rng.uniform(0.6, 1.4):.5f} N"\n'
            continue
        text += _write_patch(rng, sizes, f"{name}.contact")
        if "shear" in effect:
            text += f"[{name}.contact.shear]\n"
    return text
