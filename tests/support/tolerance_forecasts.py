"""Score of what a plan foresees of a tolerance, on random scenes whose keys may prevent it.

Run it as `python tests/support/tolerance_forecasts.py FIRST COUNT`. It prints for each seed what the plan foresees,
whether the run misses the tolerance, and whether the run with the cure meets it; then the counts.

Measured on seeds below 200 while the rules were written.
"""

import random
import sys

import patchfem as pf

LAWS = {
    "coulomb": 'law = "coulomb"\nstatic = {s:.3g}\n',
    "nonlocal": 'law = "nonlocal"\nreading = "stretch"\nstatic = {s:.3g}\nbond_length = "{b:.3g} um"\n',
    "tanh": 'law = "tanh"\nstatic = {s:.3g}\nreference_speed = "{v:.3g} mm/s"\n',
    "lugre": 'law = "lugre"\nstatic = {s:.3g}\nkinetic = {k:.3g}\nstribeck_speed = "{v:.3g} mm/s"\n'
             'stiffness = "{t:.3g} N/um"\n',
    "elastic-plastic": 'law = "elastic-plastic"\nstatic = {s:.3g}\nstiffness = "{t:.3g} N/um"\n',
    "iwan": 'law = "iwan"\nstatic = {s:.3g}\nstiffness = "{t:.3g} N/um"\nchi = -0.4\nbeta = 1.0\n',
    "bouc-wen": 'law = "bouc-wen"\nstatic = {s:.3g}\nstiffness = "{t:.3g} N/um"\n'}
KINDS = ("rig", "rig", "bench", "patch", "soft rig", "soft bench")
TOLERANCES = (1e-2, 1e-3, 1e-3, 1e-4, 1e-4, 1e-5)
STEPS = (50, 100, 200, 400, 800, 1600)


def scene_of(seed: int) -> tuple:
    """Return (kind, law, text) of a random scene."""
    r = random.Random(seed)
    kind = r.choice(KINDS)
    law = "" if kind == "patch" else r.choice([*LAWS] if kind in ("rig", "bench") else ["coulomb", "nonlocal"])
    static, load = r.uniform(0.15, 0.6), 10**r.uniform(1.3, 2.7)
    frequency, mass = 10**r.uniform(1.5, 2.6), 10**r.uniform(-0.7, 0.6)
    if kind == "soft rig":  # its motion is to stay short beside its patch
        frequency, mass = 10**r.uniform(2.2, 2.9), 10**r.uniform(0, 0.6)
    text = f'[normal]\nload = "{load:.4g} N"\n'
    if kind in ("patch", "soft rig", "soft bench"):
        opened = r.choice([f'[contact.tilt]\nangle = "{10**r.uniform(-2, -0.5):.3g} mrad"\n',
                           f'[contact.crown]\nradius = "{10**r.uniform(0, 2):.3g} m"\n'])
        size = f'element_size = "{10**r.uniform(1, 2.5):.3g} um"\n' if r.random() < 0.4 else ""
        text = (f'[contact]\nlength = "12.7 mm"\nwidth = "12.7 mm"\nheight = "6.35 mm"\nload = "{load:.4g} N"\n'
                f'substrate = "steel"\n{size}{opened}' + "[contact.shear]\n" * kind.startswith("soft"))
    if law:
        text += "[friction]\n" + LAWS[law].format(s=static, k=static * r.uniform(0.6, 0.95), b=10**r.uniform(-0.5, 1),
                                                  v=10**r.uniform(0, 1.5), t=10**r.uniform(0.5, 1.7))
    if kind.endswith("bench"):
        text += (f'[slide]\nkind = "sine"\namplitude = "{10**r.uniform(0, 1.7):.3g} um"\n'
                 f'frequency = "{frequency:.4g} Hz"\ncycles = 3\n')
    if kind.endswith("rig"):
        ratio = r.uniform(0.6, 0.8) if kind == "soft rig" else r.choice([1.0, r.uniform(0.6, 1.6)])
        text += (f'[structure]\nmoving_mass = "{mass:.4g} kg"\n[[structure.mode]]\nname = "axial"\n'
                 f'frequency = "{frequency:.5g} Hz"\ndamping = {r.uniform(0.002, 0.03):.3g}\nslide = 1.0\n')
        if r.random() < 0.4:
            text += (f'[[structure.mode]]\nname = "two"\nfrequency = "{frequency * r.uniform(1.3, 4):.5g} Hz"\n'
                     f'damping = 0.01\nslide = {r.uniform(0.1, 0.6):.3g}\n')
        text += (f'[drive]\nkind = "base"\nwaveform = "sine"\nfrequency = "{frequency * ratio:.5g} Hz"\n'
                 f'acceleration = "{static * load / mass / r.uniform(0.1, 0.95):.5g} m/s^2"\ncycles = 100\n')
    steps = f"steps_per_cycle = {r.choice(STEPS)}\n" if kind != "patch" and r.random() < 0.6 else ""
    return kind, law, f"{text}[accuracy]\ntolerance = {r.choice(TOLERANCES):g}\n{steps}"


def cured(text: str, cure: dict) -> str:
    """Return a scene with the cure of a forecast: keys set, or left out where the value is None."""
    lines = text.splitlines()
    for key, value in cure.items():
        table, _, name = key.rpartition(".")
        at = next(k for k, line in enumerate(lines) if line == f"[{table}]")
        lines = [line for k, line in enumerate(lines) if k < at or not line.startswith(f"{name} = ")]
        if value is not None:
            lines.insert(at + 1, f"{name} = {value:.15g}")
    return "\n".join(lines) + "\n"


def misses(text: str) -> bool:
    """Whether a run of a scene warns that a measure misses its tolerance."""
    return any("; the tolerance is " in one for one in pf.run(text).warnings)


def main(first: int, count: int) -> None:
    """Print the forecasts of seeds and how many hold."""
    told = held = helped = silent = met = 0
    for seed in range(first, first + count):
        kind, law, text = scene_of(seed)
        try:
            foreseen, missed = pf.plan(pf.load(text)).as_json()["tolerance"], misses(text)
            cure = misses(cured(text, foreseen["cure"])) if foreseen["missed"] else None
        except pf.PatchfemError as error:
            print(seed, kind, law, "not run:", str(error)[:100], flush=True)
            continue
        told, silent = told + foreseen["missed"], silent + (not foreseen["missed"])
        held, met = held + (foreseen["missed"] and missed), met + (not foreseen["missed"] and not missed)
        helped += cure is False
        print(seed, kind, law, "missed" if missed else "met", "|", foreseen["sentence"] or "silent",
              "" if cure is None else f"| with the cure {'missed' if cure else 'met'}", flush=True)
    print(f"{told} foreseen as missed, {held} of them are; the cure is enough in {helped}; {silent} silent, {met} of "
          "them meet their tolerance")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
