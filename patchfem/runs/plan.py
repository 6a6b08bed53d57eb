"""What a scene would run, before anything runs: engine, sizes, cost, stiffness chain and dimensionless groups."""

from dataclasses import dataclass
from math import inf, pi, sqrt

from ..core import Missing
from ..effects import EFFECTS
from ..model.accuracy import CHOSEN_POINTS, LONGEST, choose, list_cost, quadrature_of
from ..model.model import Model, build
from ..model.patch import bars, block_shear, nominal_load
from ..model.source import placed
from ..slip.shear_modes import SHEAR_MODES
from ..structure.drive_sizes import largest, omega_of


@dataclass(frozen=True, eq=False, slots=True)
class Plan:
    """A model and what will be done with it. effects: names in the scene; steps: of the time loop, all passes;
    seconds, bytes: estimates; chain: link -> stiffness [N/m] or "rigid"; groups: name -> value; verdict: sentences."""

    model: Model
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


def plan(asked, per_point: bool = False) -> Plan:
    """Plan of a Scene or a Model from its numbers alone: no mesh, no solve. PatchfemError where nothing can run it."""
    model = asked if isinstance(asked, Model) else build(asked)
    with placed(model.source):
        return _planned(model, per_point)


def _planned(model: Model, per_point: bool) -> Plan:
    if model.measured is not None:
        from ..inputs.measured import read_table

        read_table(model.measured[0])  # a broken table is named before anything runs
    unknowns, chain = _sizes(model)
    engine, steps, seconds = "static", 0, 0.25
    if model.patch is not None:
        seconds = 0.6 + 2.5e-6 * unknowns["interface_points"]**2 * 1.25
    if model.rig is not None:
        engine, steps, more = _rig_cost(model, per_point, unknowns)
        seconds += more
    elif model.kind == "bench":
        engine, steps, more = _bench_cost(model, unknowns)
        seconds += more
    seconds += 1.5  # files and report
    size = int(2.5e8 + 8 * 4 * unknowns.get("interface_points", 0)**2 * 2 + 200 * min(steps, 500_000))
    groups = _groups(model)
    if model.spread is not None:
        from ..friction.bonds.spread import pad_factor

        groups["share_of_the_spread"] = pad_factor(model.pad, model.spread)
    return Plan(model, model.kind, model.source.effects, model.absent, engine, unknowns, steps, round(seconds, 2), size,
                chain, groups, tuple(_verdict(model, groups, size)))


def _bench_cost(model: Model, unknowns: dict) -> tuple:
    """(engine, steps of all passes, seconds) of a bench."""
    from .bench.engine import engine_of

    if model.slide.across is not None:
        from .bench.two_directions import refuse

        refuse(model)
    accuracy = model.accuracy
    per_cycle = model.slide.steps(accuracy.tolerance, accuracy.steps_per_cycle, model.friction.bond_length)
    time, slide = model.slide.samples(per_cycle)[:2]
    if model.load_varies:
        time, slide = model.point.refined(model.slide, time, slide, per_cycle)
    runs = engine_of(model, slide, unknowns.get("interface_points", 1))
    if runs.choice is not None and runs.choice.strips:
        unknowns["bond_list_about"] = int(runs.choice.strips)
    steps = 2 * time.size  # half and a quarter of the steps and what checks the sum beside them
    return runs.name, steps, steps * runs.seconds


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
        raise Missing(f"about {what.bytes / 1e9:.3g} GB are needed, {free / 1e9:.3g} GB are free; make "
                      "contact.element_size larger or the run shorter", "")


def _sizes(model: Model) -> tuple:
    """(sizes by name, stiffness chain)."""
    unknowns, chain, patch, rig = {}, {}, model.patch, model.rig
    if patch is not None:
        points = CHOSEN_POINTS if patch.chosen else round(patch.length / patch.size) + 1
        unknowns |= {"interface_points": points, "elastic_unknowns_about": int(points * 2 * 33)}
    if rig is not None:
        unknowns["modes"] = len(rig.frequencies)
        chain["mode"] = rig.stiffness
        if rig.bonded is not None:
            chain["bonded"] = rig.bonded
    chain["holder"] = patch.slide_spring or "rigid" if patch is not None else "rigid"
    chain["pieces_shear"] = block_shear(patch) if patch is not None and patch.shear else "rigid"
    chain["asperities"] = "rigid"
    f, load = model.friction, _load(model)
    if patch is not None and patch.skin is not None and patch.skin.tangential_ratio is not None:
        from .patch.skin import mean_stiffness

        area = patch.length * patch.width * patch.pairs
        chain["asperities"] = patch.skin.tangential_ratio * mean_stiffness(patch, load / area) * area
    if f is not None and load > 0:
        rigid = "none: it creeps" if f.law == "tanh" else "rigid until it slips"
        chain["bonds"] = f.static * load / f.bond_length if f.bond_length and f.law != "convolution" else rigid
    return unknowns, chain


def _load(model: Model) -> float:
    """Nominal load [N] of the patch or the point; 0 without either."""
    if model.patch is not None:
        return nominal_load(model.patch)
    return model.point.load if model.point is not None else 0.0


def _rig_cost(model: Model, per_point: bool, unknowns: dict) -> tuple:
    """(engine, steps of all passes, seconds) of a coupled run."""
    numerics, rig, f, soft = choose(model, per_point), model.rig, model.friction, bool(model.soft)
    if numerics.engine == "exact":
        each = 1e-4 if unknowns["modes"] == 1 else 4e-4 + 1e-4 * unknowns["modes"]
        return "exact", int(4 * numerics.cycles), each * numerics.cycles
    if numerics.engine == "harmonic":
        points = 1 if rig.waveform == "sine" else 120
        return "harmonic", points, 0.3 + 0.05 * points
    steps = int(numerics.cycles * numerics.steps)
    each, points = 1e-6, unknowns.get("interface_points", 1)
    if f is not None and f.law == "nonlocal":
        if quadrature_of(model, numerics).engine != "recursion":
            entries, seconds = list_cost(model, numerics)
            each, unknowns["bond_list_about"] = seconds / steps, int(entries)
        elif soft:
            unknowns["shear_modes"] = numerics.shear_modes or SHEAR_MODES
            each = 4e-8 * points * (1 + unknowns["shear_modes"] / 4)
        elif numerics.per_point:
            each = 6e-8 * points
    elif soft and rig.load_varies:
        unknowns["shear_modes"] = numerics.shear_modes or SHEAR_MODES
        each = 4e-8 * points * (1 + unknowns["shear_modes"] / 4)
    elif soft:
        each = 3e-9 * points + 5e-7
    return numerics.engine, int(steps * 1.75), steps * 1.75 * each


def _groups(model: Model) -> dict:
    """Dimensionless groups by name, those without a meaning left out."""
    out, f, patch, load = {}, model.friction, model.patch, _load(model)
    if model.kind == "rig":
        rig = model.rig
        limit = sum(one.numbers.static * (load if one.load is None else one.load) for one in rig.interfaces)
        push = rig.force if rig.force else rig.mass * largest(rig.drive)
        out["D"] = limit / push if push > 0 else None
        ratio = rig.own_frequency * rig.drive.period if rig.frequency else inf
        out["knee"] = 4 / pi * limit / rig.mass if abs(ratio - 1) < 0.2 else None
        if f is not None and f.bond_length:
            out["drive_amplitude_over_bond_length"] = largest(rig.drive) / omega_of(rig.drive)**2 / f.bond_length
    if model.kind == "bench" and f.bond_length:
        out["amplitude_over_bond_length"] = model.slide.amplitude / f.bond_length
    if patch is not None:
        if f is not None:
            out["slip_length"] = f.static * load / block_shear(patch)
        tilts = [abs(part.angle) for name, part in patch.gap.shapes if name == "tilt"]
        if tilts and load > 0:
            approach = load * bars(patch, lambda m: (1 - m.poisson**2) / m.young)
            out["tilt_over_first_opening"] = tilts[0] * patch.length / (2 * approach)
    return {k: v for k, v in out.items() if v is not None}


def _verdict(model: Model, groups: dict, size: int) -> list:
    """Sentences on what the groups say."""
    out, d, rig = [], groups.get("D"), model.rig
    if d is not None and rig.modes.omega.size == 1 and rig.by_modes and rig.kind != "free":
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
    if model.kind == "rig" and model.friction is not None and model.friction.law == "nonlocal":
        numerics = choose(model)
        found = quadrature_of(model, numerics)
        out.append("sum over bonds by " + found.said())
        seconds = 0.0 if found.engine == "recursion" else list_cost(model, numerics)[1]
        if seconds > LONGEST:
            out.append(f"run will refuse: the bond list would take about {seconds:.0f} s, more than {LONGEST:.0f} s")
    slip = groups.get("slip_length")
    if slip is not None:
        out.append(f"the pieces' own shear gives way by about {slip:.2g} m before the patch slips")
    if model.kind == "rig" and model.soft and rig.load_varies:
        out.append(f"{model.soft} by tangential modes of all nodes, as the load changes with the motion; half as many "
                   "check them")
    return out
