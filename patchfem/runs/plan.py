"""What a scene would run, before anything runs: engine, sizes, cost, stiffness chain and dimensionless groups."""

from dataclasses import dataclass
from math import inf, pi, sqrt

from ..core import Missing
from ..effects import EFFECTS, absent
from ..model.accuracy import CHOSEN_POINTS, chosen_mesh
from ..model.interfaces import acts
from ..model.law import acting, pad_width
from ..model.pieces import AUTOMATIC_CELLS, _bars, block_shear, nominal_load
from ..slip.shear_modes import SHEAR_MODES


@dataclass(frozen=True, eq=False, slots=True)
class Plan:
    """A scene and what will be done with it. effects: names in the scene; steps: of the time loop, all passes;
    seconds, bytes: estimates; chain: link -> stiffness [N/m] or "rigid"; groups: name -> value; verdict: sentences."""

    scene: object
    kind: str
    effects: tuple
    not_in_scene: tuple
    engine: str
    unknowns: dict
    steps: int
    seconds: float
    bytes: int
    chain: dict
    groups: dict
    verdict: tuple

    def as_json(self) -> dict:
        """The object `patchfem plan --json` prints."""
        return {"kind": self.kind, "effects": [{"effect": e, "equations": EFFECTS[e].equations} for e in self.effects],
                "not_in_scene": list(self.not_in_scene), "engine": self.engine, "unknowns": self.unknowns,
                "steps": self.steps, "seconds": self.seconds, "bytes": self.bytes, "stiffness_chain": self.chain,
                "groups": self.groups, "verdict": list(self.verdict)}


def plan(scene, per_point: bool = False) -> Plan:
    """Plan of a scene from its numbers alone: no mesh, no solve. PatchfemError where nothing can run it."""
    if scene.measured is not None:
        from ..inputs.measured import read_table

        read_table(scene.beside(scene.measured.file))  # a broken table is named before anything runs
    named = tuple(scene.named())
    acted = acting(scene)
    unknowns, chain = _sizes(acted)
    engine, steps, seconds = "static", 0, 0.25
    if scene.contact is not None:
        cells = unknowns["interface_points"]
        seconds = 0.6 + 2.5e-6 * cells**2 * 1.25
    if scene.kind in ("rig", "linear"):
        engine, steps, more = _rig_cost(scene, per_point, unknowns)
        seconds += more
    elif scene.kind == "bench":
        from ..model.load import refined, varies
        from ..model.slide import lateral_corners, path_of, steps_of
        from .bench.engine import engine_of

        if lateral_corners(scene) is not None:
            from .bench.two_directions import refuse

            refuse(scene)
        per_cycle = steps_of(scene)
        time, slide = path_of(scene, per_cycle)[:2]
        if varies(scene):
            time, slide = refined(scene, time, slide, per_cycle)
        runs = engine_of(scene, slide, unknowns.get("interface_points", 1))
        engine, steps = runs.name, 2 * time.size  # half and a quarter of the steps and what checks the sum beside them
        seconds += steps * runs.seconds
        if runs.choice is not None and runs.choice.strips:
            unknowns["bond_list_about"] = int(runs.choice.strips)
    seconds += 1.5  # files and report
    size = int(2.5e8 + 8 * 4 * unknowns.get("interface_points", 0)**2 * 2 + 200 * min(steps, 500_000))
    groups = _groups(acted, chain)
    if scene.friction is not None and scene.friction.spread is not None:
        from ..friction.bonds.spread import pad_factor

        groups["share_of_the_spread"] = pad_factor(pad_width(scene), scene.friction.spread)
    return Plan(scene, scene.kind, named, tuple(absent(named)), engine, unknowns, steps, round(seconds, 2), size, chain,
                groups, tuple(_verdict(scene, groups, size)))


def free_bytes() -> float:
    """Memory [bytes] that a run may still take; infinite where the system does not tell."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            known = dict(line.split(":", 1) for line in file)
        return 1024.0 * int(known["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return float("inf")


def refuse_size(what: Plan) -> None:
    """Missing where a run would need more memory than there is."""
    free = free_bytes()
    if what.bytes > free:
        raise Missing(f"{what.scene.path}: about {what.bytes / 1e9:.3g} GB are needed, {free / 1e9:.3g} GB are free; "
                      "make contact.element_size larger or the run shorter")


def _sizes(scene) -> tuple:
    unknowns, chain = {}, {}
    contact = scene.contact
    if contact is not None:
        size = contact.element_size or contact.length / AUTOMATIC_CELLS
        points = round(contact.length / size) + 1
        if chosen_mesh(scene):
            points = CHOSEN_POINTS
        unknowns |= {"interface_points": points, "elastic_unknowns_about": int(points * 2 * 33)}
    if scene.structure is not None:
        from ..model.structure import frequencies, mode_stiffness

        unknowns["modes"] = len(frequencies(scene))
        chain["mode"] = mode_stiffness(scene)
        if scene.structure.bonded is not None:
            chain["bonded"] = scene.structure.bonded.stiffness
    holder = contact.holder if contact is not None else None
    chain["holder"] = holder.tangential_stiffness or "rigid" if holder is not None else "rigid"
    if contact is not None and contact.shear is not None:
        chain["pieces_shear"] = block_shear(contact)
    else:
        chain["pieces_shear"] = "rigid"
    f = scene.friction
    load = nominal_load(scene)
    skin = contact.asperities if contact is not None else None
    chain["asperities"] = "rigid"
    if skin is not None and skin.tangential_ratio is not None:
        from .patch.skin import mean_stiffness

        area = contact.length * contact.width * contact.pairs
        chain["asperities"] = skin.tangential_ratio * mean_stiffness(contact, load / area) * area
    if f is not None and load > 0:
        rigid = "none: it creeps" if f.law == "tanh" else "rigid until it slips"
        chain["bonds"] = f.static * load / f.bond_length if f.bond_length and f.law != "convolution" else rigid
    return unknowns, chain


def _rig_cost(scene, per_point, unknowns) -> tuple:
    from ..model.accuracy import choose, list_cost, quadrature_of
    from ..model.drive import drive_of
    from ..model.interfaces import viewed

    scene = viewed(scene)
    settings = choose(scene, per_point)
    drive = drive_of(scene)
    if settings.engine == "exact":
        each = 1e-4 if unknowns["modes"] == 1 else 4e-4 + 1e-4 * unknowns["modes"]
        return "exact", int(4 * settings.cycles), each * settings.cycles
    if settings.engine == "harmonic":
        points = 1 if scene.drive.waveform == "sine" else 120
        return "harmonic", points, 0.3 + 0.05 * points
    steps = int(settings.cycles * settings.steps)
    f, shear = scene.friction, scene.contact is not None and bool(scene.contact.gives_way)
    each = 1e-6
    if f is not None and f.law == "nonlocal":
        if quadrature_of(scene, settings, drive).engine != "recursion":
            each = list_cost(scene, settings, drive)[1] / steps
            unknowns["bond_list_about"] = int(list_cost(scene, settings, drive)[0])
        elif shear:
            unknowns["shear_modes"] = settings.shear_modes or SHEAR_MODES
            each = 4e-8 * unknowns.get("interface_points", 1) * (1 + unknowns["shear_modes"] / 4)
        elif settings.per_point:
            each = 6e-8 * unknowns.get("interface_points", 1)
    elif shear and acts(scene):
        unknowns["shear_modes"] = settings.shear_modes or SHEAR_MODES
        each = 4e-8 * unknowns.get("interface_points", 1) * (1 + unknowns["shear_modes"] / 4)
    elif shear:
        each = 3e-9 * unknowns.get("interface_points", 1) + 5e-7
    return settings.engine, int(steps * 1.75), steps * 1.75 * each


def _groups(scene, chain) -> dict:
    out = {}
    f, contact = scene.friction, scene.contact
    load = nominal_load(scene)
    if scene.kind == "rig":
        from ..model.drive import drive_of
        from ..model.structure import first_frequency, friction_limit, moving_mass
        from ..structure.drive_sizes import largest, omega_of

        drive, mass, limit = drive_of(scene), moving_mass(scene), friction_limit(scene, load)
        push = scene.drive.force if scene.drive.kind == "force" and scene.drive.force else mass * largest(drive)
        out["D"] = limit / push if push > 0 else None
        ratio = first_frequency(scene) * drive.period if scene.drive.frequency else inf
        out["knee"] = 4 / pi * limit / mass if abs(ratio - 1) < 0.2 else None
        if f is not None and f.bond_length:
            out["drive_amplitude_over_bond_length"] = largest(drive) / omega_of(drive)**2 / f.bond_length
    if scene.kind == "bench" and f.bond_length:
        from ..model.slide import amplitude

        out["amplitude_over_bond_length"] = amplitude(scene) / f.bond_length
    if contact is not None:
        stiff = block_shear(contact)
        if f is not None:
            out["slip_length"] = f.static * load / stiff
        if contact.tilt is not None and load > 0:
            approach = load * _bars(contact, lambda m: (1 - m.poisson**2) / m.young)
            out["tilt_over_first_opening"] = abs(contact.tilt.angle) * contact.length / (2 * approach)
    return {k: v for k, v in out.items() if v is not None}


def _verdict(scene, groups, size: int) -> list:
    out = []
    d = groups.get("D")
    if d is not None and scene.structure is not None and len(scene.structure.mode) == 1 and scene.drive.kind != "free":
        if d >= 1:
            out.append(f"D = {d:.3g} >= 1: the block should stick")
        elif d > pi / 4:
            out.append(f"D = {d:.3g} between pi/4 and 1: stick-slip at resonance")
        else:
            out.append(f"D = {d:.3g} below pi/4: at resonance friction alone does not bound the motion")
    if size > free_bytes():
        out.append(f"run will refuse: about {size / 1e9:.3g} GB are needed, {free_bytes() / 1e9:.3g} GB are free")
    tilt = groups.get("tilt_over_first_opening")
    if tilt is not None:
        part = min(1.0, 1 / sqrt(tilt)) if tilt > 1 else 1.0
        out.append(f"tilt is {tilt:.3g} of the first-opening tilt: " +
                   ("full contact" if tilt <= 1 else f"partial contact, roughly {100 * part:.0f} % or less"))
    if scene.kind == "rig" and scene.friction is not None and scene.friction.law == "nonlocal":
        from ..model.accuracy import LONGEST, choose, list_cost, quadrature_of
        from ..model.drive import drive_of

        settings, drive = choose(scene), drive_of(scene)
        found = quadrature_of(scene, settings, drive)
        out.append("sum over bonds by " + found.said())
        seconds = 0.0 if found.engine == "recursion" else list_cost(scene, settings, drive)[1]
        if seconds > LONGEST:
            out.append(f"run will refuse: the bond list would take about {seconds:.0f} s, more than {LONGEST:.0f} s")
    slip = groups.get("slip_length")
    if slip is not None:
        out.append(f"the pieces' own shear gives way by about {slip:.2g} m before the patch slips")
    if scene.kind == "rig" and scene.contact is not None and scene.contact.gives_way and acts(scene):
        out.append(f"{scene.contact.gives_way} by tangential modes of all nodes, as the load changes with the motion; "
                   "half as many check them")
    return out
