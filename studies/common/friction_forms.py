"""Exact answers of friction laws along given slides: bonds of eqs. 2.10 to 2.17, Jenkins elements, Coulomb.

Signs of the project: compression > 0; friction positive against positive slip; slide = upper - lower. Lengths called
`length` are bond lengths eps_0 [m]; `limit` = mu_s N [N] (or mu_s sigma [Pa], the result then has that unit).
"""

from itertools import pairwise

import numpy as np
from scipy.integrate import quad
from scipy.special import gamma, gammainc, gammaln, xlogy

from patchfem.closed_forms.contact import require_positive


def weight_along(relative_path, order=1.0):
    """Return the weight of a bond along the path (eq. 2.14, Fig. 13).

    It is x^p e^-x/p! with x = R/eps >= 0, has the area 1, and is largest at x = p.
    """
    x = np.asarray(relative_path, float)
    if order <= -1:
        raise ValueError(f"order must exceed -1, got {order}")
    if np.any(x < 0):
        raise ValueError("the path must not be negative (eq. 2.9)")
    with np.errstate(divide="ignore"):
        return np.exp(xlogy(order, x) - x - gammaln(order + 1))


def weight_across(relative_distance):
    """Return the weight of a bond perpendicular to the path (eq. 2.15, Fig. 14).

    It is e^(-y^2/2)/sqrt(2 pi) with y = eta/rho and has unit area over y, so that 2.16 divides by rho.
    """
    return np.exp(-(np.asarray(relative_distance, float) ** 2) / 2) / np.sqrt(2 * np.pi)


def growth_factor(share, order=1.0) -> float:
    """Return the steady friction of bonds that grow from zero (2.10 as printed) over that of fully grown bonds (2.18).

    G(a; p) = int_0^inf phi_p(s/(1 - e^(-s/a))) ds, a = share = ell/eps with 1/ell = a_s/v^2 + 1/l_k: the path on which
    a bond ripens, in bond lengths. G(0; p) = 1 and G(p; p) = 1; it falls like e^-a for bonds that break unripe.
    ValueError for a < 0 or p <= -1. To 1e-12, by adaptive quadrature between the scales of the integrand.
    """
    if share < 0:
        raise ValueError(f"'share' must not be negative, got {share}")
    weight_along(1.0, order)  # raises ValueError for a wrong order
    if share == 0:
        return 1.0
    ends = [share * 4.0**k for k in range(-2, 30)] + [
        1.0,
        *(order + 4.0 * 3.0**k for k in range(4)),
    ]
    last = order + 40 + 12 * np.sqrt(order + 40)
    cuts = np.unique([0.0, last, *(end for end in ends if 0 < end < last)])
    parts = [
        quad(
            lambda s: float(weight_along(s / -np.expm1(-s / share) if s > 0 else share, order)),
            a,
            b,
            epsabs=0.0,
            epsrel=1e-13,
            limit=200,
        )[0]
        for a, b in pairwise(cuts)
    ]
    return float(np.sum(parts))


def steady_bond_length(speed, length, ratio, rest_growth, slip_growth):
    """Return the bond length [m] in steady sliding (eq. 2.11).

    It is (eps_0 + eps_k w)/(1 + w) with w = v^2/(a_s l_k). ValueError unless the last four are positive.

    Parameters
    ----------
    speed : float
        Of either sign [m/s].
    length : float
        eps_0 [m].
    ratio : float
        eps_k / eps_0.
    rest_growth : float
        a_s [m/s^2].
    slip_growth : float
        l_k [m].
    """
    require_positive(length=length, ratio=ratio, rest_growth=rest_growth, slip_growth=slip_growth)
    slow = 1 / np.hypot(1.0, np.asarray(speed, float) / np.sqrt(rest_growth * slip_growth))
    return length * (ratio + (1 - ratio) * slow * slow)


def virgin_force(slide, length, order=1.0, initial=1.0):
    """Return the friction/limit after a first slide in one direction (eq. 2.17, constant bond length).

    P(p + 1, x) + m_0 phi_p(x), x = slide/length, P the lower incomplete gamma function, phi_p = x^p e^-x/p!.
    Stretch p = 1, m_0 = 1 and report p = 0, m_0 = 0 are both 1 - e^-x. ValueError for p <= -1 or a slide < 0.

    Parameters
    ----------
    slide : float
        >= 0 [m].
    length : float
        Bond length [m].
    order : float
        p > -1.
    initial : float
        Fraction m_0 of bonds at the start.
    """
    require_positive(length=length)
    x = np.asarray(slide, float) / length
    if order <= -1:
        raise ValueError(f"order must exceed -1, got {order}")
    if np.any(x < 0):
        raise ValueError(
            "slide must not be negative; for a negative slide use the negative of the force at the "
            "positive slide"
        )
    with np.errstate(divide="ignore", invalid="ignore"):
        first = initial * x**order * np.exp(-x) / gamma(order + 1) if initial else 0.0
    return gammainc(order + 1, x) + first


def stretch_loop(amplitude, length):
    """Return area/limit [m] and end force/limit of the steady loop of the stretch reading (p = 1), Dahl's loop.

    The bond length is constant. With x = amplitude/length they are 4 (amplitude - length tanh x) and tanh x.
    ValueError unless amplitude and length are positive.

    Parameters
    ----------
    amplitude, length : float
        [m]
    """
    require_positive(amplitude=amplitude, length=length)
    end = np.tanh(np.asarray(amplitude, float) / length)
    return 4 * (amplitude - length * end), end


def dither_drift(low, high):
    """Return the slide per cycle, in bond lengths, that a dithered force leaves in the stretch reading.

    p = 1, constant bond length and load. The force rises along ln((1 - low)/(1 - high)) and falls along
    ln((1 + high)/(1 + low)).

    Parameters
    ----------
    low, high : float
        Ends of the force / mu_s N, -1 < low < high < 1.
    """
    return float(np.log((1 - low) / (1 - high)) - np.log((1 + high) / (1 + low)))


def jenkins_loop(amplitude, length, limit=1.0):
    """Return area and end force of the steady loop of the elastic-plastic law 3.12 with its reversal.

    They are 4 limit (A - eps) and limit. Below the yield slide (amplitude <= length) the loop is a line: (0, limit
    A/eps). ValueError unless amplitude and length are positive.

    Parameters
    ----------
    amplitude, length : float
        [m]
    limit : float
        mu_s N [N].
    """
    require_positive(amplitude=amplitude, length=length)
    amplitude = np.asarray(amplitude, float)
    return 4 * limit * np.maximum(amplitude - length, 0), limit * np.minimum(amplitude / length, 1)
