"""A law of constant load along flanks, as what `contact_kernels` runs with: `contacts.arrays.Flanked`.

The law is that of a contact under the load N of the scene; under another normal force R it has R/N of its elements or
bristles. Those that a falling force lays off take their stretch with them, and those that a rising one brings come
without any, so that a force that only rises leaves the friction as it is: the stretch of all becomes R0/R1 of itself.
Either loses some of the energy stored, R k z^2/(2 N), and neither gives any. A step is half of the change of the normal
force, the slide, the other half.
"""

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from ...friction.laws import lugre_kernels as law

LOAD = 0  # of contacts.arrays.Climbing.flank, as in `contact_kernels`
PLACE, BEFORE, NORMAL = 11, 12, 13  # of now_at


@njit(error_model="numpy", **LEAN)
def begun(c, v, dt):
    """Nothing: a step needs no beginning."""


@njit(error_model="numpy", **LEAN)
def pressed(c, memory, r0, r1, out):
    """Write the memory under the normal force r1 [N], from that under r0 [N], into out; the energy lost [J]."""
    kept = r0 / r1 if r1 > r0 else 1.0
    for k in range(memory.shape[1]):
        out[0, k] = kept * memory[0, k]
    energy = law.state(c.num, memory, 0, 0.0, 0.0)[1] / c.flank[LOAD]
    if memory.shape[1] > 1:  # of elements side by side the second number is their energy
        out[0, 1] *= kept
    return energy * (r0 * (1 - kept) if r1 > r0 else r0 - r1)


@njit(error_model="numpy", **LEAN)
def drag(ds, flat, end, dt, c):
    """(mean force [N] along the flank over the path ds [m] in dt [s], its slope [N/m]); c.now_at[NORMAL] becomes the
    normal force flat + f end at the end, on a slope `end`, where f is the force there."""
    at, close, load = c.now_at, 1e-14 * c.flank[LOAD], c.flank[LOAD]
    pulled, gain, tried, missed = 0.0, 0.0, 0.0, 0.0
    for count in range(60):
        before = at[NORMAL]
        mean = 0.5 * (at[BEFORE] + before)
        pressed(c, c.mem, at[BEFORE], mean, c.tried)
        pulled, gain = law.mean(c.num, c.tried, 0, 0.0, ds, 0.0, dt)
        pulled, gain = mean / load * pulled, mean / load * gain
        bound = c.bound[0] * before / load
        now = max(flat + min(max(2 * pulled - at[PLACE], -bound), bound) * end, 0.0)
        miss = now - before
        if abs(miss) <= close:
            at[NORMAL] = now
            break
        if count > 0 and abs(missed - miss) > 0.1 * abs(before - tried):
            now = max(before - miss * (before - tried) / (miss - missed), 0.0)
        at[NORMAL], tried, missed = now, before, miss
    return pulled, gain


@njit(error_model="numpy", **LEAN)
def commit(ds, along, v0, v1, dt, c):
    """Keep the step over the path ds [m] under the mean force `along` [N] between the speeds v0, v1 [m/s] along the
    flank; (energy dissipated [J], True)."""
    at = c.now_at
    mean = 0.5 * (at[BEFORE] + at[NORMAL])
    lost = pressed(c, c.mem, at[BEFORE], mean, c.tried)
    if mean > 0.0:
        part = mean / c.flank[LOAD]
        lost += part * law.commit(c.num, c.tried, 0, ds, along / part, v0, v1, dt, 0.0)
    return lost + pressed(c, c.tried, mean, at[NORMAL], c.mem), True


@njit(error_model="numpy", **LEAN)
def state(c, q, v):
    """(force along the flank [N], energy stored in the law [J], irreversible slip [m]) at the slide q [m] and the speed
    v [m/s] along the flank."""
    part = c.now_at[NORMAL] / c.flank[LOAD]
    along, energy, kept = law.state(c.num, c.mem, 0, q, v)
    return part * along, part * energy, kept
