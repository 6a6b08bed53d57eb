"""What runs cost, as a table of two states of the package can compare: run it with the Python of each.

    python tests/times.py run FILE.json [--only cycle,elements,sweep,command,compile,long]
    python tests/times.py compare BEFORE.json AFTER.json

CPU seconds, of one process where the package is warm, of child processes for commands and compiling. Each row is kept
in FILE.json as soon as it is measured. Rows:

cycle     us a cycle of Coulomb rigs of some modes and interfaces and of a rig of each other law: the difference of two
          run lengths, the bars of both included; medians of three
elements  the same of elastic-plastic patches behind their shear, pinned to so many elements
sweep     ms a case of 300 levels of a rig of each law
command   s of whole commands on the scene of the README
compile   s that the first command of a machine takes more than its second: empty cache against full
long      s of a run of 1e4, 1e5 and 1e6 cycles of each law, stopped at 120 s; where ten times the last is more than
          that, the run is not begun
"""

import argparse
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import process_time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported: one core

import patchfem as pf

ROOT = Path(__file__).resolve().parent.parent
README = re.search(r"```toml\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.S)[1]
MASS, OWN, LEVEL = 0.884, 143.0, 49.0  # kg, Hz, m/s^2 of a rig that sticks and slips
LIMIT = 0.8 * MASS * LEVEL / 0.3  # N of normal load: the friction is 0.8 of the drive, the block sticks and slips
CAP = 120.0  # CPU seconds of a long run
SHORT = 0.2  # CPU seconds, of which the clock and the other runs of the machine leave too little
STIFFNESS = 'stiffness = "1e7 N/m"\n'
LAWS = {"coulomb": "", "kinetic": "kinetic = 0.28\n", "elastic-plastic": 'bond_length = "1 um"\n',
        "iwan": STIFFNESS + "chi = -0.5\nbeta = 0.5\n", "tanh": 'reference_speed = "1 mm/s"\n',
        "bouc-wen": STIFFNESS + "exponent = 1.0\n", "lugre": STIFFNESS + 'kinetic = 0.28\nstribeck_speed = "1 mm/s"\n',
        "nonlocal": 'bond_length = "1 um"\n'}


def friction(law: str) -> str:
    """Keys of a law, without a table's head."""
    return f'law = "{"coulomb" if law == "kinetic" else law}"\nstatic = 0.3\n{LAWS[law]}'


def driven(cycles: float) -> str:
    return f'[drive]\nkind = "base"\nfrequency = "{OWN} Hz"\nacceleration = "{LEVEL} m/s^2"\ncycles = {cycles}\n'


def moving(modes: int) -> str:
    """A block on modes of 1, 2, 3 .. times the first frequency, one interface."""
    rows = [f'[[structure.mode]]\nname = "m{k}"\nfrequency = "{OWN * (k + 1)} Hz"\ndamping = 0.003\n'
            f'slide = {1.0 if k == 0 else 0.3}\nbase = {0.9 if k == 0 else 0.05}\n' for k in range(modes)]
    return f'[structure]\nmoving_mass = "{MASS} kg"\n' + "".join(rows)


def point(law: str, modes: int, cycles: float) -> str:
    """A rig with one interface at a point."""
    return f'[normal]\nload = "{LIMIT} N"\n[friction]\n{friction(law)}{moving(modes)}{driven(cycles)}'


def masses(law: str, count: int, interfaces: int, cycles: float) -> str:
    """A chain of masses from the base on, its interfaces first to the base, then between neighbours; each carries a
    little less than the one before, those of one mass no more together than a single one."""
    stiffness, pairs = MASS * (2 * 3.141592653589793 * OWN)**2, [[k, k - 1] for k in range(1, count + 1)]
    faces = ([[k, 0] for k in range(1, count + 1)] + pairs[1:]) * interfaces
    rows = [f'[[structure.spring]]\nbetween = {pair}\nstiffness = "{stiffness} N/m"\n'
            f'[[structure.damper]]\nbetween = {pair}\ncoefficient = "{0.006 * (stiffness * MASS)**0.5} N s/m"\n'
            for pair in pairs]
    load = LIMIT / -(-interfaces // count)
    rows += [f'[[structure.interface]]\nbetween = {pair}\nload = "{load * (1 - 0.01 * k)} N"\n{friction(law)}'
             for k, pair in enumerate(faces[:interfaces])]
    each = ", ".join([f'"{MASS} kg"'] * count)
    return f"[structure]\nmasses = [{each}]\n" + "".join(rows) + driven(cycles)


def sheared(elements: int, modes: int, cycles: float) -> str:
    """An elastic-plastic patch behind the shear of its pieces, of so many elements along it."""
    return ('[contact]\nlength = "12.7 mm"\nwidth = "12.7 mm"\nheight = "6.35 mm"\nsubstrate = "Ti-8Al-1Mo-1V"\n'
            f'load = "{LIMIT} N"\nelement_size = "{12.7 / elements} mm"\n[contact.tilt]\nangle = "0.02 mrad"\n'
            f'[contact.shear]\n[friction]\n{friction("elastic-plastic")}{moving(modes)}{driven(cycles)}')


def spent(text: str) -> float:
    """CPU seconds of a run in this process."""
    begin = process_time()
    pf.run(text, say=lambda _: None)
    return process_time() - begin


def a_cycle(scene, few: int = 100) -> float:
    """Microseconds a cycle of scene(cycles), of runs that are 3 times as long, or 45 times where that is short; a
    long first run brings the compiled code, which a short one does without."""
    spent(scene(45 * few))
    low = median(spent(scene(few)) for _ in range(3))
    for many in (3 * few, 45 * few):
        high = median(spent(scene(many)) for _ in range(3))
        if high - low > SHORT:
            break
    return 1e6 * (high - low) / (many - few)


def cycle():
    for modes in (1, 2, 5, 20):
        for count in (1, 2, 5):
            name = f"cycle, coulomb, {modes} modes, {count} interfaces"
            yield name, "us", lambda modes=modes, count=count: a_cycle(
                lambda n: point("coulomb", modes, n) if count == 1 else masses("coulomb", modes, count, n))
    for law in LAWS:
        for modes in (1, 5):
            if law != "coulomb":
                yield f"cycle, {law}, {modes} modes", "us", lambda law=law, modes=modes: a_cycle(
                    lambda n: point(law, modes, n))


def elements():
    for count in (1, 20, 200):
        for modes in (1, 5):
            yield f"cycle, elastic-plastic, {count} elements, {modes} modes", "us", lambda count=count, modes=modes: \
                a_cycle(lambda n: sheared(count, modes, n) if count > 1 else point("elastic-plastic", modes, n))


def sweep():
    def a_case(law: str) -> float:
        text = point(law, 1, 200)
        pf.sweep(text, {"drive.acceleration": "3 g..6 g:300"})  # as long: a short one may do without compiled code
        begin = process_time()
        pf.sweep(text, {"drive.acceleration": "3 g..6 g:300"})
        return 1e3 * (process_time() - begin) / 300

    for law in LAWS:
        yield f"sweep, {law}", "ms", lambda law=law: a_case(law)


def called(words: list, cache: str = "", most: float = 600.0) -> float | None:
    """CPU seconds of a child process, None where it took more than `most`; cache: another folder of compiled code."""
    more = {"PATCHFEM_CACHE": cache, "XDG_CACHE_HOME": cache} if cache else {}
    before, limit = resource.getrusage(resource.RUSAGE_CHILDREN), int(most)
    done = subprocess.run([sys.executable, *map(str, words)], env=os.environ | more, capture_output=True, text=True,
                          preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit)))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode < 0:
        return None
    if done.returncode:
        raise pf.PatchfemError(done.stderr.strip().splitlines()[-1])
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def a_command(verb: str, text: str, *words: str, cache: str = "") -> float:
    """CPU seconds of a command on a scene."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "scene.toml")
        path.write_text(text, "utf-8")
        out = ["-o", Path(folder, "out"), "-q"] if verb in ("run", "sweep") else []
        return called(["-m", "patchfem", verb, path, *words, *out], cache)


def command():
    for verb in ("check", "plan", "run"):
        yield f"command, {verb} of the README", "s", lambda verb=verb: median(
            [a_command(verb, README) for _ in range(4)][1:])


def compiling():
    def first(verb: str, text: str, *words: str) -> float:
        with tempfile.TemporaryDirectory() as cache:
            return a_command(verb, text, *words, cache=cache) - a_command(verb, text, *words, cache=cache)

    slide = '[slide]\nkind = "triangle"\namplitude = "10 um"\nspeed = "5 mm/s"\ncycles = 5\n'
    bench, four = f'[normal]\nload = "{LIMIT} N"\n[friction]\n', ("--over", "drive.acceleration=3 g..6 g:4")
    yield "compile, first rig, README", "s", lambda: first("run", README)
    for law in LAWS:
        yield f"compile, first rig, {law}", "s", lambda law=law: first("run", point(law, 1, 50))
    yield "compile, first rig, coulomb, 2 interfaces", "s", lambda: first("run", masses("coulomb", 2, 2, 50))
    for law in ("coulomb", "nonlocal"):
        yield f"compile, first bench, {law}", "s", lambda law=law: first("run", bench + friction(law) + slide)
    for law in ("coulomb", "elastic-plastic", "iwan", "nonlocal"):
        yield f"compile, first sweep, {law}", "s", lambda law=law: first("sweep", point(law, 1, 50), *four)
    yield "compile, first patch", "s", lambda: first("run", README.partition("[contact.shear]")[0])


def long():
    last = {}

    def run(law: str, cycles: float) -> float | None:
        if last.get(law, 0.0) is None or 10 * last.get(law, 0.0) > CAP:
            return None
        code = f"import patchfem as pf; pf.run({point(law, 1, cycles)!r}, say=lambda _: None)"
        last[law] = called(["-c", code], most=CAP)
        return last[law]

    for law in LAWS:
        for cycles in (1e4, 1e5, 1e6):
            yield f"long, {law}, {cycles:.0e} cycles", "s", lambda law=law, cycles=cycles: run(law, cycles)


PARTS = {"cycle": cycle, "elements": elements, "sweep": sweep, "command": command, "compile": compiling, "long": long}


def run(path: Path, parts: list) -> None:
    """Measure the rows of some parts that the file has not, and keep each: {name: [value or None, unit, why not]}."""
    rows = json.loads(path.read_text("utf-8")) if path.exists() else {}
    for part in parts:
        for name, unit, measure in PARTS[part]():
            if name in rows:
                continue
            try:
                value, why = measure(), ""
                why = "" if value is not None else f"more than {CAP:g} s"
            except pf.PatchfemError as error:
                value, why = None, str(error)
            rows[name] = [value, unit, why]
            path.write_text(json.dumps(rows, indent=1), "utf-8")
            print(shown(name, value, unit, why), flush=True)


def shown(name: str, value, unit: str, why: str) -> str:
    return f"{name:48s} {why[:70] if value is None else f'{value:10.4g} {unit}'}"


def compare(before: Path, after: Path) -> None:
    """Print both and the ratio after/before."""
    old, new = (json.loads(path.read_text("utf-8")) for path in (before, after))
    for name in old | new:
        a, b = (rows.get(name, [None, "", "-"]) for rows in (old, new))
        ratio = f"{b[0] / a[0]:8.3f}" if a[0] and b[0] else ""
        print(shown(name, *a), "->", shown("", *b).strip(), ratio)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    runs, pair = verbs.add_parser("run"), verbs.add_parser("compare")
    runs.add_argument("file", type=Path)
    runs.add_argument("--only", default=",".join(PARTS))
    pair.add_argument("files", type=Path, nargs=2)
    asked = parser.parse_args()
    if asked.verb == "compare":
        compare(*asked.files)
    else:
        run(asked.file, asked.only.split(","))


if __name__ == "__main__":
    main()
