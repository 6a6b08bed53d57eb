"""What a bench would cost, before it runs."""

from ...model.model import Model
from .engine import engine_of, steps_of


def cost(model: Model, unknowns: dict) -> tuple:
    """(engine, steps of all passes, seconds) of a bench."""
    per_cycle = steps_of(model)
    time, slide = model.slide.samples(per_cycle)[:2]
    if model.load_varies:
        time, slide = model.point.refined(model.slide, time, slide, per_cycle)
    runs = engine_of(model, slide, unknowns.get("interface_points", 1))
    if runs.choice is not None and runs.choice.strips:
        unknowns["bond_list_about"] = int(runs.choice.strips)
    steps = 2 * time.size  # half and a quarter of the steps and what checks the sum beside them
    return runs.name, steps, steps * runs.seconds


def groups(model: Model) -> dict:
    """Dimensionless groups of the slide by name: its amplitude over the bond length, where the law has one."""
    length = model.friction.bond_length
    return {"amplitude_over_bond_length": model.slide.amplitude / length} if length else {}
