"""Recipe of random rigs with folds, with limit cycles and with backbones, for own programs and earlier releases.

Rig k has the seed FIRST_FOLD_SEED + k, FIRST_CYCLE_SEED + k or FIRST_BACKBONE_SEED + k, 1 to 3 masses or modes, and the
laws of `curve_campaign` in turn. A rig with folds has a cubic spring. In a self-excited rig one mode has negative damping,
and the release is short, because the limit cycles follow from the map of a period.
"""

import numpy as np
from brute.recipe import Sizes, write_law
from curve_campaign import LAWS, make_chain

FIRST_FOLD_SEED = 20303100
FIRST_CYCLE_SEED = 20303200
FIRST_BACKBONE_SEED = 20303400
N_AMPLITUDES = 9  # of a backbone
N_RIGS = 24


def make_fold_rig(seed: int) -> tuple[str, float, float]:
    """Return the structure of a rig as text, its lowest frequency without friction [rad/s], and a drive [m/s2]."""
    number = seed - FIRST_FOLD_SEED
    return make_chain(seed, number, n=1 + number % 3, cubic=(0.02, 0.1))


def make_fold_sweep(seed: int) -> str:
    """Return the scene of the response curve of a rig with folds."""
    text, omega, acceleration = make_fold_rig(seed)
    frequency = omega / (2 * np.pi)
    return (
        f'{text}[drive]\nkind = "base"\nwaveform = "sweep"\nacceleration = "{acceleration:.12g} m/s^2"\n'
        f'from = "{0.7 * frequency:.6g} Hz"\nto = "{1.9 * frequency:.6g} Hz"\nrate = "1 Hz/s"\n'
        '[accuracy]\nmethod = "harmonic"\ntolerance = 1e-2\n'
    )


def make_cycle_scene(seed: int, cycles: int = 3, ratio: float = 0.5) -> str:
    """Return the scene of a self-excited rig that is released at a ratio of the amplitude of Den Hartog's balance."""
    rng = np.random.default_rng(seed)
    number = seed - FIRST_CYCLE_SEED
    law = LAWS[number % len(LAWS)]
    n = 1 + number % 3
    mass = rng.uniform(0.4, 1.5)
    frequency = rng.uniform(60, 200)
    zeta = -(10 ** rng.uniform(-2.5, -1.3))
    load = rng.uniform(20, 200)
    static = rng.uniform(0.2, 0.6)
    omega = 2 * np.pi * frequency
    # Loss of a cycle 4 F A, and gain of the mode pi c omega A^2 with c = 2 |zeta| m omega
    amplitude = 2 * static * load / (np.pi * abs(zeta) * mass * omega**2)
    sizes = Sizes(static * load, load, static, omega, amplitude, 0.01)
    text = f'[normal]\nload = "{load:.6g} N"\n[friction]\n{write_law(rng, law, sizes, has_patch=False)}'
    if law == "coulomb" and number // len(LAWS) % 2:
        text += f"kinetic = {static * rng.uniform(0.7, 1):.5f}\n"
    text += f'[structure]\nmoving_mass = "{mass:.6g} kg"\n'
    for k in range(n):
        value = frequency * (1.0 if k == 0 else k + rng.uniform(1.3, 2.7))
        damping = zeta if k == 0 else rng.uniform(0.005, 0.03)
        slide, output = (1.0, 1.0) if k == 0 else rng.uniform(-0.6, 0.6, 2)
        text += (
            f'[[structure.mode]]\nname = "m{k}"\nfrequency = "{value:.6g} Hz"\ndamping = {damping:.6f}\n'
            f"slide = {slide:.5f}\noutput = {output:.5f}\n"
        )
    return f'{text}[drive]\nkind = "free"\ndisplacement = "{ratio * amplitude:.6g} m"\ncycles = {cycles}\n'


def make_backbone_scene(seed: int) -> tuple[str, str]:
    """Return the scene of a rig whose first mode has a backbone, and its amplitudes."""
    number = seed - FIRST_BACKBONE_SEED
    text, omega, acceleration = make_chain(seed, number, 1 + number % 3, None)
    size = acceleration / omega**2
    amplitudes = f"{0.01 * size:.6g} m..{3 * size:.6g} m:{N_AMPLITUDES}"
    return (
        f'{text}[drive]\nkind = "base"\nfrequency = "100 Hz"\nacceleration = "1 g"\ncycles = 3\n',
        amplitudes,
    )
