"""How do time, memory and bytes grow with cases, modes, interfaces, elements, cycles and steps?

At most linearly, but for the elements of a patch and the interfaces of a structure, whose dense matrices grow as the
power 1.6 between the last two sizes.

| what | sizes | CPU s | its exponent | MB | bytes on disk |
|---|---|---|---|---|---|
| Coulomb cases | 1e2, 1e3, 1e4 | 0.33, 0.81, 5.4 | 0.8 | 142, 147, 203 | 4.2e5, 1.5e6, 1.2e7 |
| modes | 1, 10, 30 | 0.08, 0.08, 0.11 | 0.3 | 135, 139, 142 | 1.8e5, 3.7e5, 7.3e5 |
| interfaces | 1, 5, 10, 20 | 0.07, 0.09, 0.17, 0.52 | 1.6 | 154, 159, 162, 171 | 2.2e5, 5.1e5, 9.7e5, 2.2e6 |
| elements | 100, 400, 1600 | 0.18, 0.39, 3.4 | 1.6 | 91, 123, 552 | 5.3e5, 3.0e6, 1.1e7 |
| cycles of Coulomb | 1e2, 1e4, 1e6 | 0.07, 0.08, 0.28 | 0.3 | 137, 138, 246 | 3.0e5, 3.6e5, 5.6e5 |
| cycles of tanh | 1e2, 1e3, 1e4 | 0.13, 0.22, 0.22 | 0.0 | 143, 142, 149 | 3.0e5, 3.5e5, 8.0e5 |
| steps a cycle | 100, 1600, 25 600 | 0.09, 0.16, 0.99 | 0.7 | 136, 142, 211 | 1.1e5, 5.4e5, 7.2e6 |

Measured on one core that did much else. Each row is a process of its own, which runs a small one of its kind before, so
that nothing is compiled or imported in the time that it tells: CPU seconds of a run with its error bars, its largest
resident memory, the bytes of its results folder without a page. The exponent is that of the last two sizes, the slope
of the logarithms.

Run: python studies/speed/growth.py            (the small sizes, a minute)
     python studies/speed/growth.py --full     (all; the longest are a million cases and 1e6 cycles of tanh)
"""

import json
import os
import resource
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from peer import ONE_THREAD, run

POINT = '[normal]\nload = "20 N"\n'
COULOMB = '[friction]\nlaw = "coulomb"\nstatic = 0.3\n'
TANH = '[friction]\nlaw = "tanh"\nstatic = 0.3\nreference_speed = "5 mm/s"\n'
MODE = '[[structure.mode]]\nname = "m{0}"\nfrequency = "{1} Hz"\ndamping = 0.01\nslide = {2}\n'
DRIVE = '[drive]\nkind = "base"\nfrequency = "130 Hz"\nacceleration = "5 g"\ncycles = {0}\n'
PATCH = (
    '[contact]\nlength = "12.8 mm"\nwidth = "12.7 mm"\nheight = "6.4 mm"\nload = "115 N"\nsubstrate = "steel"\n'
    'element_size = "{0} mm"\n[contact.tilt]\nangle = "20 urad"\n'
)
GRID = (
    "friction.static=0.1..0.6:{0}lin",
    "drive.frequency=90 Hz..200 Hz:{1}lin",
    "drive.acceleration=30 m/s^2..120 m/s^2:{2}lin",
)


def rig(modes: int = 1, cycles: int = 50, law: str = COULOMB) -> str:
    """A point on so many modes."""
    shape = "".join(MODE.format(k, 120 + 97 * k, round(0.9**k, 4)) for k in range(modes))
    return POINT + law + '[structure]\nmoving_mass = "1 kg"\n' + shape + DRIVE.format(cycles)


def chain(count: int) -> str:
    """A chain of masses, each rubbing on the frame."""
    springs = "".join(
        f'[[structure.spring]]\nbetween = [{k}, {k - 1}]\nstiffness = "1e6 N/m"\n'
        for k in range(1, count + 1)
    )
    rubs = "".join(
        f'[[structure.interface]]\nbetween = [{k}, 0]\nlaw = "coulomb"\nstatic = 0.3\nload = "10 N"\n'
        for k in range(1, count + 1)
    )
    dampers = '[[structure.damper]]\nbetween = [1, 0]\ncoefficient = "20 N s/m"\n'
    return (
        f"[structure]\nmasses = {json.dumps(['1 kg'] * count)}\n"
        + springs
        + dampers
        + rubs
        + DRIVE.format(50).replace("5 g", "2 g")
    )


def marched(steps: int) -> str:
    """A march of tanh by so many steps a cycle."""
    return rig(law=TANH) + f'[accuracy]\nmethod = "march"\nsteps_per_cycle = {steps}\n'


# axis: (what makes a scene of a size, its unit, sizes always, further sizes with --full)
AXES = {
    "cases": (rig, "Coulomb cases, 50 cycles each", (100, 1000, 10_000), (100_000, 1_000_000)),
    "modes": (rig, "modes under Coulomb friction, 50 cycles", (1, 3, 10), (20, 30)),
    "interfaces": (chain, "Coulomb interfaces on as many masses, 50 cycles", (1, 2, 5), (10, 20)),
    "elements": (
        lambda n: PATCH.format(12.8 / n),
        "elements along a tilted patch",
        (10, 100, 400),
        (1600, 3200),
    ),
    "cycles": (lambda n: rig(1, n), "cycles of Coulomb", (100, 1000, 10_000), (100_000, 1_000_000)),
    "cycles of tanh": (
        lambda n: rig(1, n, TANH),
        "cycles of tanh",
        (100, 1000),
        (10_000, 100_000, 1_000_000),
    ),
    "steps": (
        marched,
        "steps a cycle in a march of tanh, 50 cycles",
        (100, 400, 1600),
        (6400, 25_600),
    ),
}


def once(axis: str, size: int) -> dict:
    """CPU seconds, peak memory [MB] and bytes on disk of one size, in this process."""
    import patchfem as pf

    make, _, small, _ = AXES[axis]
    with TemporaryDirectory() as room:
        work = swept if axis == "cases" else lambda text, place: pf.run(text).save(place)
        for place, one in ((Path(room, "small"), small[0]), (Path(room, "whole"), size)):
            begin = process_time()
            work(one if axis == "cases" else make(one), place)
            seconds = process_time() - begin
        files = [
            one
            for one in Path(room, "whole").rglob("*")
            if one.is_file() and one.name != "report.html"
        ]
        return {
            "seconds": seconds,
            "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
            "bytes": sum(one.stat().st_size for one in files),
            "files": len(files),
        }


def swept(count: int, place: Path) -> None:
    """A sweep of so many cases, a power of ten, into a folder."""
    from patchfem.campaigns.sweeps import parse_request
    from patchfem.campaigns.sweeps.executors import LocalExecutor
    from patchfem.export.sweeps.run import Place, sweep_into

    place.mkdir()
    (place / "rig.toml").write_text(rig())
    first, second = {100: (2, 5), 1000: (5, 10)}.get(count, (10, 10))
    over = [text.format(first, second, count // (first * second)) for text in GRID]
    sweep_into(
        *parse_request.asked_of(place / "rig.toml", (), parse_request.Request(over)),
        Place(place / "out", keep="none"),
        LocalExecutor(),
    )


def row(axis: str, size: int) -> dict:
    """The same in a process of its own."""
    done = subprocess.run(
        [sys.executable, __file__, "one", axis, str(size)],
        capture_output=True,
        text=True,
        env=os.environ | ONE_THREAD,
        check=False,
    )
    if done.returncode:
        return {"axis": axis, "size": size, "failed": done.stderr.strip().splitlines()[-1]}
    return {"axis": axis, "size": size, **json.loads(done.stdout.splitlines()[-1])}


def exponent(one: dict, other: dict, what: str) -> float:
    """Slope of the logarithm of a column over that of the size."""
    return float(np.log(other[what] / one[what]) / np.log(other["size"] / one["size"]))


def lines(rows: list[dict]) -> list[str]:
    """The table, as Markdown."""
    out = [
        "| what | size | CPU s | exponent | MB | exponent | bytes on disk | exponent |",
        f"|{'---|' * 8}",
    ]
    for axis in dict.fromkeys(one["axis"] for one in rows):
        mine = [one for one in rows if one["axis"] == axis]
        for before, one in zip([None, *mine], mine):
            cells = []
            for what, shown in (("seconds", "{:.3g}"), ("memory", "{:.0f}"), ("bytes", "{:.3g}")):
                known = what in one and before and what in before and one is mine[-1]
                cells += [
                    shown.format(one[what]) if what in one else one["failed"],
                    f"{exponent(before, one, what):.2f}" if known else "",
                ]
            out.append(f"| {AXES[axis][1]} | {one['size']} | {' | '.join(cells)} |")
    return out


def main(full: bool = False, axes=tuple(AXES)) -> list[dict]:
    """Measure and print the table; its rows."""
    rows = []
    for axis in axes:
        _, _, small, large = AXES[axis]
        for size in (*small, *(large if full else ())):
            rows.append(row(axis, size))
            print(lines(rows[-1:])[-1], flush=True)
    print("\n".join(lines(rows)))
    return rows


if __name__ == "__main__":
    if sys.argv[1:2] == ["one"]:
        print(json.dumps(once(sys.argv[2], int(sys.argv[3]))))
        raise SystemExit(0)
    raise SystemExit(run(lambda: main("--full" in sys.argv)))
