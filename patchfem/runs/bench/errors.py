"""What a bench leaves open: its steps, its mesh and its sum over bonds."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ...response.errors import change, step_error
from . import bench
from .engine import LIST
from .watch import Watch

FINER = 0.5  # merge width of the run that shows what merging does
MERGED = 2.0  # times its change: where merging is of second order 4/3 would do


def errors_of(model, patch, coarse, fine, steps: int, say=None) -> tuple:
    """([error by measure name, ...], seconds) of the pass `fine` at `steps` per cycle: runs at half and a quarter of
    them, one on the coarser mesh where there is one, and what the sum over bonds loses."""
    begin, few = perf_counter(), max(4, steps // 16 * 4)
    half, quarter = (bench.run(model, patch, number, watch=Watch(fine.engine.choice, say))
                     for number in (max(4, steps // 8 * 4), few))
    first_order = model.load_varies  # twice the change, as of few steps
    out = [step_error(fine.values, half.values, quarter.values, min(steps, 399) if first_order else steps)]
    if coarse is not None:
        rough = bench.run(model, coarse, few, watch=Watch(fine.engine.choice, say))
        out.append(change(quarter.values, rough.values))
    if fine.engine.kind == LIST:
        out += sum_errors(model, patch, fine, quarter, few, say)
    return out, perf_counter() - begin


def sum_errors(model, patch, fine, quarter, few: int, say=None) -> list:
    """[error by measure name, ...] of the list of bonds of the pass `fine`: the bound that the engine states, and of a
    merged list the change of the pass `quarter`, at `few` steps per cycle, when its strips are made narrower."""
    choice, found = fine.engine.choice, [stated(model, fine)]
    if choice.merge > 0:
        finer = bench.run(model, patch, few, watch=Watch(replace(choice, merge=FINER * choice.merge), say))
        found.append({name: MERGED * gap for name, gap in change(quarter.values, finer.values).items()})
    return found


def stated(model, fine) -> dict:
    """Error by measure name that follows from the bound of the sum over bonds, which is a share of the friction limit:
    forces and slip directly, work as that share of what went to and fro, the store as that of a bond length at the
    limit."""
    error, f, power = fine.engine.choice.error, model.friction, float(np.abs(np.diff(fine.ledger[0])).sum())
    force = error * f.static
    out = {"friction_force_peak": force * float(fine.load.max()), "friction_ratio_end": force,
           "friction_ratio_peak": force, "slip_amplitude": error * f.bond_length, "work_check": error}
    out |= {name: error * power for name in ("friction_work", "energy_dissipated")}
    out["energy_stored"] = out["friction_force_peak"] * f.bond_length
    out["energy_created"] = error * fine.values["energy_created"]
    out["loop_area"] = error * float(np.abs(np.diff(fine.ledger[0][fine.first:])).sum())
    out["equivalent_stiffness"] = error * abs(fine.values.get("equivalent_stiffness", 0.0))
    return {name: value for name, value in out.items() if name in fine.values} | \
        {name: 0.0 for name in fine.values if name not in out}
