"""A path of loads with its history, cut where nodes enter or leave the contact."""

import numpy as np
from partial_slip import Operators, SlipState, Step, advance
from slip_sets import press_forces, rigid_columns

from patchfem.core import NotConverged, PatchfemError

CUTS = 4  # cuts of one leg allowed per node of the interface
AHEAD = 1e-9  # share of the rest of a leg at which the next contact set is looked up


def load_path(state: SlipState, operators: Operators, steps, friction: float,
              follow: bool | None = None) -> tuple:
    """States of a pair at the end of each of `steps`, between which loads, motions and gap run straight.

    follow (None: for alike pieces): an increment ends wherever a node enters or leaves the contact, so that the node
    starts its slip from there. Without it there is one increment to a step. What an entering node moves before it
    touches then counts as slip, an error of the first order in the step. PatchfemError for `follow` with unlike pieces,
    else as `advance`.
    """
    follow = operators.coupling is None if follow is None else follow
    if follow and operators.coupling is not None:
        raise PatchfemError("contact: a path is followed from node to node for alike pieces only; take small steps")
    out = []
    for step in steps:
        for part in _cuts(state, operators, step) if follow else ():
            state = advance(state, operators, part, friction)
        state = advance(state, operators, step, friction)
        out.append(state)
    return tuple(out)


def _between(state: SlipState, operators: Operators, step: Step):
    """The Step at a share of the way from `state` to `step`."""
    end = state.gap if step.gap is None else np.asarray(step.gap, float)
    moment = float(state.normal_force @ operators.x) - step.spring * state.rotation

    def at(share: float) -> Step:
        def line(first, last):
            return None if last is None else first + share * (last - first)

        return Step(line(state.load, step.load), line(state.approach, step.approach), line(moment, step.moment),
                    step.spring, line(state.shear, step.shear), line(state.slide, step.slide),
                    line(state.gap, end))

    return at


def _cuts(state: SlipState, operators: Operators, step: Step) -> list:
    """Steps at which the contact set changes on the way to `step`, in order, the end left out."""
    at = _between(state, operators, step)
    share, active, out = 0.0, state.active, []
    if step.load is None and not active.any():
        share = _touch(at(0.0), at(1.0))
    for _ in range(CUTS * operators.x.size):
        if share >= 1 - 2 * AHEAD:  # the rest is shorter than the look ahead
            return out
        ahead = share + AHEAD * (1 - share)
        active, force, rate, opening, widening = _rates(operators, at(ahead), at(1.0), 1 - ahead, active)
        with np.errstate(divide="ignore", invalid="ignore"):
            leaves = np.where(active & (rate < 0), -force / rate, np.inf)
            enters = np.where(~active & (widening < 0), -opening / widening, np.inf)
        first = max(min(leaves.min(), enters.min()), 0.0)
        share = ahead + first
        if share < 1 - AHEAD:
            out.append(at(share))
        turned = np.minimum(leaves, enters) <= first + 1e-14  # mirrored nodes change together
        active = active ^ turned if np.isfinite(first) else active
    raise NotConverged("contact: the contact set changes too often along one leg of the load path; take smaller steps")


def _touch(first: Step, last: Step) -> float:
    """Share of the way after which pieces that are apart touch."""
    before, after = first.gap - first.approach, last.gap - last.approach
    if after.min() >= 0:
        return 1.0
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.where(after < 0, np.maximum(before, 0.0) / (before - after), np.inf).min())


def _rates(operators: Operators, here: Step, end: Step, rest: float, active) -> tuple:
    """Contact set just after a cut, and how forces and openings (m,) change over the rest of the way."""
    x, kept = operators.x, operators.inverse("normal")

    def loads(step):
        if step.load is None:
            return step.gap - step.approach, np.zeros(0)
        return step.gap, np.array([step.load] if step.moment is None else [step.load, step.moment])

    gap, target = loads(here)
    last, goal = loads(end)
    force, motion, _ = press_forces(kept, x, gap, target, active, here.spring)
    index = np.flatnonzero(force > 0)
    rigid = rigid_columns(x, target.size)
    _, inverse = kept.on(index)
    slope, drift = (last - gap) / rest, (goal - target) / rest
    rate, lead = np.zeros(x.size), np.zeros(target.size)
    rate[index] = -inverse @ slope[index]
    if target.size:
        lift = inverse @ rigid[index]
        stiff = np.diag([0.0, here.spring][:target.size])
        lead = np.linalg.solve(rigid[index].T @ lift + stiff, drift - rigid[index].T @ rate[index])
        rate[index] += lift @ lead
    active = force > 0
    opening = np.where(active, 0.0, gap - rigid @ motion + kept.full @ force)
    return active, force, rate, np.maximum(opening, 0.0), slope - rigid @ lead + kept.full @ rate
