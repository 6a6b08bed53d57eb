"""Compiled twins of the friction laws. Every function here has its NumPy form in this folder and a test against it.

Flags: only fast-math that keeps NaN and infinity meaningful. All arrays are C-ordered float64 and writable.
"""

from math import exp, log

from ...compiled.jit import njit
from ..flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT

SHORT = 0.5  # bond lengths up to which the series of a slide do for every point


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def shape(x):
    """(f1, f2, exp(-x)) [1] for one x >= 0: f1 = (1 - exp(-x))/x, f2 = (1 - f1)/x, without cancellation.

    Twin: `recursion.shape_functions`. Cost: 6 ns, NumPy 20 us per call.
    """
    if x < 0.03:
        f2 = 0.5 - x * (
            1 / 6 - x * (1 / 24 - x * (1 / 120 - x * (1 / 720 - x * (1 / 5040 - x / 40320))))
        )
        f1 = 1 - x * f2
        return f1, f2, 1 - x * f1
    e = exp(-x)
    f1 = (1 - e) / x
    return f1, (1 - f1) / x, e


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def short_shape(x):
    """`shape` for 0 <= x <= SHORT, by the series alone: without a branch, so a loop over points takes several at once.

    The first term left out is 1e-16 of f2. Cost: 1 ns in such a loop.
    """
    f2 = 0.5 - x * (
        1 / 6
        - x
        * (
            1 / 24
            - x
            * (
                1 / 120
                - x
                * (
                    1 / 720
                    - x
                    * (
                        1 / 5040
                        - x
                        * (
                            1 / 40320
                            - x
                            * (
                                1 / 362880
                                - x
                                * (
                                    1 / 3628800
                                    - x
                                    * (
                                        1 / 39916800
                                        - x
                                        * (1 / 479001600 - x * (1 / 6227020800 - x / 87178291200))
                                    )
                                )
                            )
                        )
                    )
                )
            )
        )
    )
    f1 = 1 - x * f2
    return f1, f2, 1 - x * f1


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def moments(x, e):
    """Integrals from 0 to x of y exp(-y), y^2 exp(-y) and of the latter once more, without cancellation; e = exp(-x).

    Twin: `recursion.moments`.
    """
    if x < SHORT:
        return short_moments(x, e)
    return moments_of(x, e, 6 - e * (x * x * x + 3 * x * x + 6 * x + 6))


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def short_moments(x, e):
    """`moments` for 0 <= x <= SHORT, by the series alone."""
    return moments_of(
        x,
        e,
        x**4
        * (
            1 / 4
            - x
            * (
                1 / 5
                - x
                * (
                    1 / 12
                    - x
                    * (
                        1 / 42
                        - x
                        * (
                            1 / 192
                            - x
                            * (
                                1 / 1080
                                - x
                                * (
                                    1 / 7200
                                    - x
                                    * (
                                        1 / 55440
                                        - x
                                        * (
                                            1 / 483840
                                            - x
                                            * (
                                                1 / 4717440
                                                - x
                                                * (
                                                    1 / 50803200
                                                    - x * (1 / 598752000 - x / 7664025600)
                                                )
                                            )
                                        )
                                    )
                                )
                            )
                        )
                    )
                )
            )
        ),
    )


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def moments_of(x, e, c):
    """The three integrals of `moments` from that of y^3 exp(-y)."""
    third = (c + x * x * x * e) / 3
    return (third + x * x * e) / 2, third, x * third - c


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def bond_mean(m, z, dq, sigma, eps):
    """Path-mean stretch [Pa m] of one point over an increment (2.17, stretch, p = 1), and its slope over dq [Pa].

    m [Pa], z [Pa m]: density and stretch before; dq [m]; sigma [Pa] forms the new bonds; eps [m]. The traction is
    mu_s/eps_0 times the mean. Twin: `recursion.advance`. Cost: 10 ns.
    """
    f1, f2, _ = shape(abs(dq) / eps)
    return mean_of(m, z, dq, sigma, eps, f1, f2)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def short_mean(m, z, dq, sigma, eps):
    """`bond_mean` for |dq| <= SHORT eps, without a branch."""
    f1, f2, _ = short_shape(abs(dq) / eps)
    return mean_of(m, z, dq, sigma, eps, f1, f2)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def mean_of(m, z, dq, sigma, eps, f1, f2):
    """`bond_mean` from the shape functions of |dq|/eps."""
    g = 1.0 if dq > 0 else -1.0
    x = abs(dq) / eps
    young = sigma - m
    mean = z * f1 + g * eps * x * (sigma * f2 - young * (f1 - f2))
    slope = g * z * (f2 - f1) / eps + sigma * (f1 - f2) - young * (f2 - x * (f1 - f2))
    return mean, slope


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def bond_step(m, z, s2, dq, sigma, eps):
    """(m [Pa], z [Pa m], s2 [Pa m2]) of one point after an increment dq [m], and the integral of s2 dR/eps [Pa m2].

    m, z, s2: before; sigma [Pa] forms the new bonds; eps [m]. mu_s/(2 eps_0) times the integral is dissipated. Twin:
    `recursion.advance`.
    """
    x = abs(dq) / eps
    f1, _, e = shape(x)
    a2, a3, a4 = moments(x, e)
    return step_of(m, z, s2, dq, sigma, eps, f1, e, a2, a3, a4)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def short_step(m, z, s2, dq, sigma, eps):
    """`bond_step` for |dq| <= SHORT eps, without a branch."""
    x = abs(dq) / eps
    f1, _, e = short_shape(x)
    a2, a3, a4 = short_moments(x, e)
    return step_of(m, z, s2, dq, sigma, eps, f1, e, a2, a3, a4)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def step_of(m, z, s2, dq, sigma, eps, f1, e, a2, a3, a4):
    """`bond_step` from the shape functions and moments of |dq|/eps."""
    path = abs(dq)
    g = 1.0 if dq > 0 else -1.0
    x = path / eps
    a1, young = x * f1, sigma - m
    dissipated = s2 * a1 + 2 * g * z * eps * a2 + m * eps * eps * a3 + sigma * eps * eps * a4
    m1 = sigma - young * e
    z1 = z * e + g * eps * (sigma * a1 - young * x * e)
    s21 = e * (s2 + 2 * g * z * path + m * path * path) + sigma * eps * eps * a3
    return m1, z1, s21, dissipated


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def free_part(play, dq, half):
    """Elastic part of an increment and the play after it (twin: `parameters.elastic_part`)."""
    start = play * half
    end = start + dq
    if end >= half:
        return half - start, 1.0
    if end <= -half:
        return -half - start, -1.0
    return dq, end / half


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def loose_mean(m, z, play, half, dq, sigma, eps):
    """`bond_mean` of a point with an elastic range: path-mean stretch [Pa m] over dq [m], and its slope [Pa].

    play [1]: place in the range, half [m]: half its width. Twin: `recursion.moved`.
    """
    free = free_part(play, dq, half)[0]
    rest = dq - free
    if rest == 0.0 or abs(dq) < 1e-280:  # no 1/dq of a step that small
        return z + 0.5 * m * dq, 0.5 * m
    if free == 0.0:
        return bond_mean(m, z, dq, sigma, eps)
    mean, slope = bond_mean(m, z + m * free, rest, sigma, eps)
    total = (free * (z + 0.5 * m * free) + rest * mean) / dq
    return total, (mean + slope * rest - total) / dq


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def loose_step(m, z, s2, play, half, dq, sigma, eps):
    """`bond_step` of a point with an elastic range: (m, z, s2, play, integral of s2 dR/eps).

    play [1]: place in the range, half [m]: half its width. Twin: `recursion.moved`.
    """
    free, play = free_part(play, dq, half)
    s2 += free * (2 * z + m * free)
    z += m * free
    m, z, s2, dissipated = bond_step(m, z, s2, dq - free, sigma, eps)
    return m, z, s2, play, dissipated


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def grow(eps, v0, v1, path, dt, growth):
    """(bond length after the step, I_A + I_B) of eq. 2.10 (twin: `parameters.grow`).

    growth: (a_s, l_k, v_h, eps_0, eps_k), a_s < 0 for a constant length.
    """
    a_s, l_k, floor, eps0, epsk = growth[0], growth[1], growth[2], growth[3], growth[4]
    if a_s < 0:
        return eps, 0.0
    if max(abs(v0), abs(v1)) < floor:
        rest = a_s * dt / floor
    elif abs(v1 - v0) > 1e-6 * (abs(v0) + abs(v1)):  # as in `parameters`: closer speeds cancel
        rest = a_s * dt * (_primitive(v1, floor) - _primitive(v0, floor)) / (v1 - v0)
    else:
        rest = a_s * dt / max(abs(v0 + v1) / 2, floor)
    rest, slide = min(rest, 1e100), min(path / l_k, 1e100)
    total = rest + slide
    if total == 0:
        return eps, 0.0
    target = (rest * eps0 + slide * epsk) / total
    return target + (eps - target) * exp(-total), total


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _primitive(v, floor):
    if abs(v) < floor:
        return v / floor
    return (1 + log(abs(v) / floor)) * (1.0 if v > 0 else -1.0)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def bond_end(m, z, dq, sigma, eps):
    """(stretch sum, slope) of one point at the end of the slide dq (z of `bond_step`)."""
    g = 1.0 if dq > 0 else -1.0
    x = abs(dq) / eps
    f1, _, e = shape(x)
    young = sigma - m
    z1 = z * e + g * eps * (sigma * x * f1 - young * x * e)
    return z1, sigma - young * e - g * z1 / eps


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def press_point(m, z, s2, s0, s1, initial, length):
    """Bonds of one point after a change of its load at rest (twin: `recursion.pressed`)."""
    if s1 >= s0:
        return m + initial * (s1 - s0), z, s2
    left = m * s1 / s0
    least = z * z / s2 if s2 > 0 else 0.0
    keep = left / least if least > left else 1.0
    bound = length * s1
    if keep * abs(z) > bound:
        keep = bound / abs(z)
    return left, z * keep, s2 * keep
