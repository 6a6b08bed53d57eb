"""The numerical choices of a run, by the names that summary.json gives them."""

COUNTS = ("steps_per_cycle", "harmonics", "shear_modes", "elements")


def chosen(result) -> dict:
    """Engine, steps per cycle or those that a tolerance chose, cycles and window of a run, shear modes or elements
    behind the pieces' shear, how bonds are summed, and interface nodes and strips of its patch,
    and the length [m] that its profile is averaged over.

    map: "events" or "yields" that a steady motion was found by. A choice that the run did not make is left out.
    """
    extra, patch, out = result.extra, result.patch, {}
    if (engine := extra.get("engine")) is not None:
        out["engine"] = engine
    if (found := extra.get("map")) is not None:
        out["map"] = found
    steps = extra.get("steps")
    if steps is not None:
        out["steps_per_cycle"] = int(steps)
    out |= {name: int(extra[name]) for name in COUNTS if extra.get(name) is not None}
    if (local := extra.get("step_tolerance")) is not None:
        out |= {"step_tolerance": float(local), "steps": int(extra["steps_taken"])}
    if (summed := extra.get("quadrature")) is not None:
        out["quadrature"] = summed
    if (window := extra.get("window")) is not None:
        out["window_cycles"] = int(window)
    if patch is not None:
        out["interface_nodes"] = int(patch.x.size)
        if patch.averaging is not None:
            out["profile_averaging"] = float(patch.averaging)
        if result.plan.model.patch.strips is not None:
            out["strips"] = int(result.plan.model.patch.strips[0])
    return out
