"""The recursion along a given slide that all points share: every exponential once per step, points by multiplication.

With one increment and one bond length for all points, the step of `recursion.advance` is linear in (m, z, s2, sigma)
with coefficients of the step, so the loops over points hold no function and vectorise.
"""

from numba import njit

from ..flags_kernels import FAST, LEAN
from .point_kernels import free_part, grow, moments, shape


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def step_numbers(dq, eps):
    """The 13 coefficients of one damaging increment, as `step_points` uses them; 20 ns."""
    path = abs(dq)
    g = 1.0 if dq > 0 else -1.0
    x = path / eps
    f1, f2, e = shape(x)
    a1 = x * f1
    a2, a3, a4 = moments(x, e)
    bend = f1 - f2
    return (e, g * eps * (a1 - x * e), g * eps * x * e, 2 * g * path * e, path * path * e, eps * eps * a3,
            f1, g * eps * x * (f2 - bend), g * eps * x * bend,
            a1, 2 * g * eps * a2, eps * eps * a3, eps * eps * a4)


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def step_points(k, m, z, s2, sigma, weight):
    """Move m, z, s2 (n,) in place; weighted sums of the path-mean stretch and of the integral of s2 dR/eps.

    Twin: `recursion.advance`. 2000 points: 0.4 ns per point; NumPy 25 ns.
    """
    mean, burnt = 0.0, 0.0
    for j in range(m.size):
        mj, zj, sj, s = m[j], z[j], s2[j], sigma[j]
        mean += weight[j] * (k[6] * zj + k[7] * s + k[8] * mj)
        burnt += weight[j] * (k[9] * sj + k[10] * zj + k[11] * mj + k[12] * s)
        m[j] = s - (s - mj) * k[0]
        z[j] = zj * k[0] + k[1] * s + k[2] * mj
        s2[j] = k[0] * sj + k[3] * zj + k[4] * mj + k[5] * s
    return mean, burnt


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def stretch_points(dq, m, z, s2, weight):
    """Stretch all points by dq without damage, in place; weighted sum of the path-mean stretch."""
    mean = 0.0
    for j in range(m.size):
        zj, dz = z[j], m[j] * dq
        mean += weight[j] * (zj + 0.5 * dz)
        z[j] = zj + dz
        s2[j] += dq * (2 * zj + dz)
    return mean


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def state_points(q, m, z, s2, sigma, weight):
    """(force [N], stored energy [J], irreversible slip [m]) of points that all stand at the slide q."""
    force, energy, slip, total = 0.0, 0.0, 0.0, 0.0
    for j in range(m.size):
        force += weight[j] * z[j]
        energy += weight[j] * s2[j]
        share = weight[j] * sigma[j] if m[j] > 0 else 0.0
        slip += share * z[j] / (m[j] if m[j] > 0 else 1.0)
        total += share
    return force, 0.5 * energy, q - slip / total if total > 0 else q


@njit(error_model="numpy", **LEAN)
def rigid_path(path, dt, weight, bonds, sigma, growth, eps, burnt, forces):
    """Points (n,) under sigma (n,) [Pa] along the slide path (k,) [m] with steps of dt [s]; bonds (4 or 5, n) and the
    bond length eps (1,) are moved in place. burnt, forces: as in `dynamics.march.loop_kernels.follow_path`.

    1 point: 27 ns per step (45 with growth), the NumPy law 60 us; 2000 points: 0.5 ns per point-step.
    """
    m, z, s2 = bonds[0], bonds[1], bonds[2]
    loose = bonds.shape[0] > 4
    for i in range(path.size):
        forces[i, 0], burnt[i, 1], forces[i, 2] = state_points(path[i], m, z, s2, sigma, weight)
        if i == path.size - 1:
            break
        dq = path[i + 1] - path[i]
        v = dq / dt if dt > 0 else 0.0
        middle = grow(eps[0], v, v, abs(dq) / 2, dt / 2, growth)[0]
        free, mean = 0.0, 0.0
        if loose:
            free, play = free_part(bonds[4, 0], dq, growth[5] * middle)
            if free != 0.0:
                mean = stretch_points(free, m, z, s2, weight)
            for j in range(m.size):
                bonds[4, j] = play
        rest = dq - free
        if rest != 0.0 or dq == 0.0:
            more, spent = step_points(step_numbers(rest, middle), m, z, s2, sigma, weight)
            mean = more if free == 0.0 else free / dq * mean + rest / dq * more
            burnt[i, 0] = 0.5 * spent
        else:
            burnt[i, 0] = 0.0
        forces[i, 1] = mean
        eps[0] = grow(eps[0], v, v, abs(dq), dt, growth)[0]
    for j in range(m.size):
        bonds[3, j] += path[-1] - path[0]
