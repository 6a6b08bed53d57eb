"""Stops and releases of set-valued friction inside a step of a march: where the slide ends it, and at what speed.

A march moves the modes under one mean friction force per step, so a stop or a release that falls inside the step would
be off by up to a step, and a slide that holds would keep a speed. Here the force h(x) that would hold the slide is
taken to change linearly over the step, 0 <= x <= 1, and the slide to accelerate by its difference to the friction: then
every stop and every release is the root of a line or a parabola. What the step must give is the slide and the speed at
its end; the mean force gives the one and a blow at its end the other. Both are of second order in the step, and a step
never gives energy: where it would, it is solved by the mean force alone, which cannot.
"""

from math import sqrt

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from ...friction.laws.coulomb_kernels import stick

MOST = 20  # stops and releases in a step


@njit(error_model="numpy", **LEAN)
def leaves(h0, h1, s0, s1, x):
    """(place from x on where the holding force passes static friction, the sign there); (1, 0) where it does not.

    h0, h1: holding force [N] at the ends of the step; s0, s1: static friction [N] there; place x of the step.
    """
    h, s = h0 + (h1 - h0) * x, s0 + (s1 - s0) * x
    if abs(h) > s:
        return x, 1.0 if h > 0 else -1.0
    place, way = 1.0, 0.0
    for sign in (1.0, -1.0):
        rise = sign * (h1 - h0) - (s1 - s0)
        if rise > 0:
            at = x + (s - sign * h) / rise
            if at < place:
                place, way = at, sign
    return place, way


@njit(error_model="numpy", **LEAN)
def stops(speed, start, bend):
    """Where speed + start y + bend y^2 falls to 0, infinite where it does not; speed >= 0, start >= 0 where it is 0."""
    if speed == 0.0:
        return -start / bend if bend < 0 else float("inf")
    root = start * start - 4 * bend * speed
    if root < 0:
        return float("inf")
    below = sqrt(root) - start
    return 2 * speed / below if below > 0 else float("inf")


@njit(error_model="numpy", **LEAN)
def inside(v, h0, h1, s0, s1, k0, k1, gain, rest):
    """The slide of a step from event to event: (slide over the length of the step [m/s], speed at the end [m/s], True
    where it ends at rest, events).

    v [m/s]: speed at the start, of no account where rest; h0, h1: holding force, s0, s1: static, k0, k1: kinetic
    friction [N] at the ends of the step; gain [m/(s N)]: speed that a force gives the slide over the whole step.
    """
    x, slide, way, count = 0.0, 0.0, 1.0 if v > 0 else -1.0, 0
    v = 0.0 if rest else v
    while count < MOST:
        if rest:
            x, way = leaves(h0, h1, s0, s1, x)
            if way == 0.0:
                return slide, 0.0, True, count
            rest, count = False, count + 1
        start = gain * (h0 + (h1 - h0) * x - way * (k0 + (k1 - k0) * x))
        bend = 0.5 * gain * (h1 - h0 - way * (k1 - k0))
        if v == 0.0:  # just released: kinetic friction at most its static one, but for round-off
            start = way * max(way * start, 0.0)
        y = stops(way * v, way * start, way * bend)
        rest = y <= 1.0 - x or way * (v + (1.0 - x) * (start + (1.0 - x) * bend)) <= 0
        y = min(y, 1.0 - x)
        slide += y * (v + y * (0.5 * start + y * bend / 3))
        v = 0.0 if rest else v + y * (start + y * bend)
        if not rest:
            return slide, v, False, count
        x, count = x + y, count + 1
    return slide, 0.0, True, count


@njit(error_model="numpy", **LEAN)
def through(free, rate, beta, gamma, share, v, dt, s0, s1, k0, k1, rest, top):
    """(slide dq [m], speed at the end [m/s], True where it ends at rest) of a step of Coulomb's law.

    free [m], rate [m/s]: slide and speed at the end of the step without friction; beta [m/N], gamma [m/(s N)]: what a
    friction of one newton takes from them; share [1/kg]: acceleration per newton; v [m/s]: speed at the start of the
    step of dt [s], with no account where rest; s0, s1 and k0, k1 [N]: static and kinetic friction at its ends; top [N]:
    force that would hold a slide at rest at the end of the step, infinite where it is not known. The mean force is
    (free - dq)/beta; the rest of the speed at the end is taken, or given, by a blow.
    """
    way, mean, most = 1.0 if v > 0 else -1.0, 0.5 * (k0 + k1), max(s0, s1)
    if most == 0.0:
        return free, rate, False
    if rest and abs(top) <= s1 and abs(free) <= beta * min(s0, s1):  # a line through a crest would pass above it
        return 0.0, 0.0, True
    if not rest:
        dq, end = free - beta * way * mean, rate - gamma * way * mean
        if way * end > 0 and way * dq >= 0:
            return dq, end, False
    if beta > 0.25 * share * dt * dt and gamma > 0.5 * share * dt:  # else modes swing within the step
        first = 0.0 if rest else v
        near, far = (free - first * dt) / beta, (rate - first) / gamma
        part, speed, held, _ = inside(v, 3 * near - 2 * far, 4 * far - 3 * near, s0, s1, k0, k1, share * dt, rest)
        used = min(max((free - part * dt) / beta, -most), most)
        dq, end = (0.0 if part == 0.0 and abs(free) <= beta * most else free - beta * used), rate - gamma * used
        if not held:  # no blow beyond what static friction gives in a step
            near = end - share * dt * min(max((end - speed) / (share * dt), -most - used), most - used)
            held = near * speed <= 0
            speed = 0.0 if held else near
        if used * dq + (end * end - speed * speed) / (2 * share) >= 0:
            return dq, speed, held
    dq, used = stick(free, beta, most, mean)
    return dq, 0.0 if dq == 0.0 else rate - gamma * used, dq == 0.0
