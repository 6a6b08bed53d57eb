"""A modal test of a rig: a random base acceleration, the motion of the rig, H1 of two accelerometers, a mode fitted.

The motion is marched; on grooves, which are computed from event to event only, it is sampled at the same times.

The record is straight between its rows, so the spectrum that moves the block on the base is that of the rows times
sinc^2(f/RATE): what H1 differs from 1 is divided by it.
"""

from typing import NamedTuple

import numpy as np
from scipy import signal
from scipy.optimize import least_squares

import patchfem as pf
from patchfem.event_driven import runs
from patchfem.event_driven.cases import EXACT_RTOL, Schedule, make_rig_case
from patchfem.runs import choose_numerics, solve_with_coarser
from patchfem.runs.interfaces.contact_points import make_contact
from patchfem.runs.rig.joints import make_joints
from patchfem.structure.drives import RecordedDrive
from patchfem.time_steps.time_march import march

G = 9.80665  # [m/s^2] standard gravity
RATE = 4000.0  # [1/s] rows of the record per second
STEPS = 32  # rows that count as a cycle
BAND = (20.0, 400.0)  # [Hz] band of the random base acceleration


class Test(NamedTuple):
    """Samples of a random test at RATE.

    Contains acceleration of base and block [m s-2], displacement [m] and velocity [m/s] of the
    block relative to the base.
    """

    base: np.ndarray
    block: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray


class Estimate(NamedTuple):
    """H1 of block over base acceleration: f (k,) [Hz], complex h (k,), coherence (k,)."""

    f: np.ndarray
    h: np.ndarray
    coherence: np.ndarray

    def between(self, low: float, high: float) -> "Estimate":
        """Return the part between two frequencies [Hz]."""
        inside = (self.f >= low) & (self.f <= high)
        return Estimate(self.f[inside], self.h[inside], self.coherence[inside])


def _random_base(seconds: float, rms: float, seed: int = 1) -> RecordedDrive:
    """Return a normal random record with a flat spectrum over BAND and the given rms [g]."""
    count = int(seconds * RATE)
    f = np.fft.rfftfreq(count, 1 / RATE)
    random = np.random.default_rng(seed)
    lines = (random.standard_normal(f.size) + 1j * random.standard_normal(f.size)) * (
        (f > BAND[0]) & (f < BAND[1])
    )
    value = np.fft.irfft(lines, count)
    value *= rms * G / value.std()
    value[0] = 0.0
    return RecordedDrive(np.arange(count) / RATE, value, STEPS / RATE)


def march_samples(scene, drive=None, steps: int = STEPS, seconds: float | None = None):
    """Integrate the rig of a scene from rest and return every sample.

    Parameters
    ----------
    scene : Path or str
    drive : optional
        By default that of the scene.
    steps : int
        Steps of what counts as its cycle.
    seconds : float, optional
        Duration; by default that of the drive.
    """
    model = pf.build(scene)
    drive = drive or model.rig.drive.signal
    modes = model.rig.modes
    patch = None
    if model.patch is not None:
        patch = solve_with_coarser(model.patch, model.accuracy.tolerance, False)[0]
    contact = make_contact(model, choose_numerics(model), patch)
    # 1e-6 compensates round-off, so that a whole number of cycles is not reduced by one
    cycles = int((seconds or drive.duration) / drive.period + 1e-6)
    motion = march(modes, drive, contact, cycles, steps, window=cycles)
    if motion.outcome is not None:
        raise RuntimeError(motion.message)
    return motion.window


def follow_events(scene, drive, seconds: float):
    """Integrate the rig of a scene without [contact] from event to event, and return the motion at 1/RATE, from rest.

    Parameters
    ----------
    scene : Path or str
    drive
        Base acceleration.
    seconds : float
        Duration.
    """
    model = pf.build(scene)
    times = np.arange(round(seconds * RATE) + 1) / RATE
    joints = make_joints(model, choose_numerics(model), None)
    schedule = Schedule(seconds / drive.period, 1, times)
    case = make_rig_case(model.rig, joints.laws, schedule, signal=drive, rtol=EXACT_RTOL)
    motion = runs.run_case(case)
    if motion.message:
        raise RuntimeError(motion.message)

    # events have rows of their own, also at the time of a sample, after which they stand
    response = motion.make_response(model.rig.modes, drive)
    return response.select(np.searchsorted(response.time, times))


def run_random_test(scene, seconds: float, rms: float, seed: int = 1) -> Test:
    """Run the rig of a scene from rest under `_random_base`."""
    drive = _random_base(seconds, rms, seed)
    integrate = march_samples if pf.build(scene).grooves is None else follow_events
    seen = integrate(scene, drive, seconds=seconds - STEPS / RATE)
    return Test(seen.base_acceleration, seen.acceleration, seen.output, seen.output_rate)


def h1(test: Test, seconds: float) -> Estimate:
    """Estimate H1 = S_xy/S_xx with Hann windows of several seconds that overlap by half."""
    how = {"fs": RATE, "nperseg": int(seconds * RATE)}
    f, input_power = signal.welch(test.base, **how)
    with np.errstate(invalid="ignore", divide="ignore"):
        h = (
            1
            + signal.csd(test.base, test.block - test.base, **how)[1]
            / input_power
            / np.sinc(f / RATE) ** 2
        )
        return Estimate(f, h, signal.coherence(test.base, test.block, **how)[1])


def mode_transmissibility(f, frequency: float, damping: float):
    """Return absolute over base acceleration of one mode, (f_0^2 + 2 i zeta f_0 f)/(f_0^2 - f^2 + 2 i zeta f_0 f)."""
    damper = 2j * damping * frequency * np.asarray(f)
    return (frequency**2 + damper) / (frequency**2 - np.asarray(f) ** 2 + damper)


def fit_mode(seen: Estimate) -> tuple:
    """Fit one mode to an estimate; return frequency [Hz], damping ratio and rms of the logarithmic misfit."""

    def misfit(p):
        left = np.log(mode_transmissibility(seen.f, *p) / seen.h)
        return np.concatenate([left.real, left.imag])

    found = least_squares(misfit, [145.0, 0.3])
    return float(found.x[0]), float(found.x[1]), float(np.sqrt(2 * np.mean(found.fun**2)))
