"""Recipe of 40 random patches on the shipped rig, and of 60 random benches, for the march of contact points.

A scene is written by its seed alone. Every law stands with every effect at least once, so that both together decide whether
one march computes all of them. The references of `march_references.json` are those of brute force, as in `recipe`.
"""

import numpy as np

from .recipe import Scene, Sizes, write_contact, write_law

FIRST_RIG_SEED = 20264301
FIRST_BENCH_SEED = 20264401
N_RIGS = 40
N_BENCHES = 60
LAWS = (
    "coulomb", "tanh", "elastic-plastic", "stiffness", "nonlocal", "iwan", "bouc-wen", "lugre",
)  # fmt: skip
RIG_EFFECTS = ("shear", "shear modes", "whole patch", "pitch", "shear and pitch", "load")
BENCH_EFFECTS = ("point", "shear", "load", "grooves", "shear and grooves", "lower")
MASS = 0.884  # moving mass of the shipped rig [kg]
AXIAL, YAW = 143.0, 129.0  # frequencies of its modes [Hz]
YAW_SLIDE = 0.095  # slide of the patch in its mode "yaw"


def make_scenes(shift: int = 0) -> list[Scene]:
    """Return all scenes of the recipe, or others like them whose seeds are higher by `shift`."""
    rigs = [make_rig(FIRST_RIG_SEED + shift + k, k) for k in range(N_RIGS)]
    return rigs + [make_bench(FIRST_BENCH_SEED + shift + k, k) for k in range(N_BENCHES)]


def make_rig(seed: int, number: int) -> Scene:
    """Return the shipped rig with another law, load, tilt, number of shear modes, or an oscillating load."""
    rng = np.random.default_rng(seed)
    law = LAWS[number % len(LAWS)]
    effect = RIG_EFFECTS[(number % len(LAWS) + number // len(LAWS)) % len(RIG_EFFECTS)]
    load = rng.uniform(60, 200)
    static = rng.uniform(0.2, 0.5)
    frequency = rng.uniform(120, 160)
    omega = 2 * np.pi * frequency
    limit = static * load
    sizes = Sizes(limit, load, static, omega, limit / (MASS * omega**2), 12.7e-3)

    tilt = f'[contact.tilt]\nangle = "{rng.uniform(0, 0.02):.5f} mrad"\n'
    text = write_contact(rng, sizes, effect)
    if effect != "load":
        text += tilt
    text += f"[friction]\n{write_law(rng, law, sizes, has_patch=effect != 'load')}"
    text += f'[structure]\nmoving_mass = "{MASS} kg"\n'
    damping = rng.uniform(0.003, 0.03)
    for name, own, slide in (("axial", AXIAL, 1.0), ("yaw", YAW, YAW_SLIDE)):
        motion = ""
        if "pitch" in effect:
            size = load / (0.01 * 1.1e11)  # approach [m]
            pitch = rng.uniform(-0.5, 0.5) * size / sizes.travel / sizes.patch_length
            heave = rng.uniform(-0.2, 0.2) * size / sizes.travel
            motion = f'pitch = "{pitch:.6g} rad/m"\nnormal = {heave:.6g}\n'
        text += f'[[structure.mode]]\nname = "{name}"\nfrequency = "{own} Hz"\ndamping = {damping:.5f}\n'
        text += f"slide = {slide}\n{motion}"
    acceleration = rng.uniform(1.0, 3.0) * limit / MASS
    text += f'[drive]\nkind = "base"\nacceleration = "{acceleration / 9.80665:.6g} g"\n'
    text += f'frequency = "{frequency:.6g} Hz"\ncycles = 8\n'
    if effect == "shear modes":
        text += f"[accuracy]\nshear_modes = {rng.integers(3, 11)}\n"
    return Scene(seed, "rig", effect, law, text, 1600 if effect != "load" else 8000)


def make_bench(seed: int, number: int) -> Scene:
    """Return a prescribed slide of a point or a patch under a law and an effect."""
    rng = np.random.default_rng(seed)
    law = LAWS[number % len(LAWS)]
    effect = BENCH_EFFECTS[(number % len(LAWS) + number // len(LAWS)) % len(BENCH_EFFECTS)]
    load = rng.uniform(60, 250)
    static = rng.uniform(0.2, 0.6)
    frequency = rng.uniform(50, 200)
    length = rng.uniform(2e-3, 4e-3) if effect == "lower" else rng.uniform(8e-3, 16e-3)
    sizes = Sizes(
        static * load, load, static, 2 * np.pi * frequency, rng.uniform(3e-6, 40e-6), length
    )
    text = write_contact(rng, sizes, effect)
    has_patch = effect not in ("point", "load", "grooves")
    text += f"[friction]\n{write_law(rng, law, sizes, has_patch=has_patch)}"
    text += f'[slide]\nkind = "sine"\namplitude = "{sizes.travel * 1e6:.6g} um"\n'
    text += f'frequency = "{frequency:.6g} Hz"\ncycles = {rng.integers(1, 4)}\n'
    return Scene(seed, "bench", effect, law, text, 1600 if has_patch else 4000)
