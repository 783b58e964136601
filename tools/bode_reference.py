#!/usr/bin/env python3
"""Independent reference for the frequency responses: scipy and alias sums.

Goes in: the cases below. Comes out: tests/drive/bode.json, compared by tests/drive/bode.rs. The plant is discretised by scipy's
cont2discrete, filters by its bilinear transform. Then everything stays in the frequency domain: a signal that is held from a slow to a
fast rate and sampled again is the mean over all images of the slow spectrum, H(w) = 1/n sum_k G(w + k w_slow) hold(w + k w_slow).
The Rust code has no images: it lifts state matrices. Written from docs/drive.md alone.

    python3 -m venv .venv && .venv/bin/pip install numpy scipy
    .venv/bin/python tools/bode_reference.py
"""

import cmath
import json
import math
import pathlib
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import bilinear, cont2discrete


@dataclass(frozen=True)
class Axis:
    """The X axis of the Spinner, symbols of models/drive.md."""
    np: int = 8
    nv: int = 2
    Tp: float = 1e-3
    r: float = 12 / math.tau
    R: float = .75
    L: float = 6.5e-3
    Ke: float = .43
    Kt: float = 1.30
    J: float = .0085
    B: float = .010
    Kv: float = 50.0
    Kp: float = 2.0
    Tn: float = .010
    Kpi: float = 22.0
    Tni: float = .002
    kvff: float = 0.0
    ktff: float = 0.0
    Jff: float = .0085
    dpos: float = 0.0
    dff: float = 0.0
    pt1: bool = False
    dsc: bool = False
    at_motor: bool = False
    Jl: float = 0.0
    c: float = 0.0
    d: float = 0.0
    speed_filter: tuple = ()  # numerator, denominator in s, frequency met exactly
    model: tuple = ()
    current_filter: tuple = ()
    average: int = 1  # jerk filter: samples of a moving average


def pt2(hz, damping):
    w = math.tau * hz
    return ([1.0], [1 / w**2, 2 * damping / w, 1.0], hz)


def second_order(hz, damping, numerator_hz, numerator_damping):
    w, wz = math.tau * hz, math.tau * numerator_hz
    return ([1 / wz**2, 2 * numerator_damping / wz, 1.0], [1 / w**2, 2 * damping / w, 1.0], numerator_hz)


def sampled(filter_, T, z):
    """Bilinear transform that meets one frequency: fs such that it is pre-warped there."""
    if not filter_:
        return 1.0
    numerator, denominator, hz = filter_
    w = math.tau * hz
    b, a = bilinear(numerator, denominator, fs=w / (2 * math.tan(w * T / 2)))
    return np.polyval(b, z) / np.polyval(a, z) if len(a) == len(b) else \
        np.polyval(b, z) * z ** (len(a) - len(b)) / np.polyval(a, z)


def plant(p, T):
    """ZOH of (i, wm, thl, ...) by u: matrices and the rows i, wm, thm, thl."""
    if p.Jl:
        Jm = p.J - p.Jl
        # i, wm, phi, wl, thl
        A = np.array([[-p.R / p.L, -p.Ke / p.L, 0, 0, 0],
                      [p.Kt / Jm, -p.d / Jm, -p.c / Jm, p.d / Jm, 0],
                      [0, 1, 0, -1, 0],
                      [0, p.d / p.Jl, p.c / p.Jl, -(p.d + p.B) / p.Jl, 0],
                      [0, 0, 0, 1, 0]])
        C = np.array([[1, 0, 0, 0, 0], [0, 1, 0, 0, 0], [0, 0, 1, 0, 1], [0, 0, 0, 0, 1]], float)
    else:
        A = np.array([[-p.R / p.L, -p.Ke / p.L, 0], [p.Kt / p.J, -p.B / p.J, 0], [0, 1, 0]])
        C = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1]], float)
    B = np.zeros((len(A), 1))
    B[0, 0] = 1 / p.L
    Ad, Bd, _, _, _ = cont2discrete((A, B, np.eye(len(A)), np.zeros((len(A), 1))), T)
    return Ad, Bd, C


def images(n, response, hold=None):
    """From a value held for n fast cycles to samples every n of them."""
    def slow(angle):
        total = 0
        for k in range(n):
            z = cmath.exp(1j * (angle + math.tau * k) / n)
            kernel = hold(z) if hold else sum(z**-j for j in range(n))
            total = total + response(z, (angle + math.tau * k) / n) * kernel
        return total / n
    return slow


def responses(p, hz):
    Tv = p.Tp / p.np
    Ti = Tv / p.nv
    Ad, Bd, C = plant(p, Ti)

    def motor(z):
        return (C @ np.linalg.solve(z * np.eye(len(Ad)) - Ad, Bd))[:, 0]

    def current_controller(z):
        return p.Kpi * (1 + Ti / p.Tni * z / (z - 1))

    def current_closed(z, _=None):
        """i_ref to i, wm, thm, thl at T_i."""
        m, c = motor(z), current_controller(z)
        return m * c / (1 + m[0] * c)

    fast = images(p.nv, current_closed)  # at T_v, as a function of w T_v

    def speed(z, angle):
        """Loop gain, and from w_ref and from t_ff to thm, thl and wm, at T_v."""
        g = fast(angle) * sampled(p.current_filter, Tv, z) / p.Kt
        integral = p.Kp * Tv / p.Tn * z / (z - 1)
        loop = g[1] * (p.Kp + integral)
        forward = (p.Kp + integral * sampled(p.model, Tv, z)) * sampled(p.speed_filter, Tv, z)
        return loop, g * forward / (1 + loop), g / (1 + loop)

    at_i = cmath.exp(1j * math.tau * hz * Ti)
    angle_v, angle_p = math.tau * hz * Tv, math.tau * hz * p.Tp
    loop, by_ref, _ = speed(cmath.exp(1j * angle_v), angle_v)
    result = {
        "current_open": motor(at_i)[0] * current_controller(at_i),
        "current_closed": current_closed(at_i)[0],
        "speed_open": loop,
        "speed_closed": by_ref[1],
    }

    measured = 2 if p.at_motor else 3
    zp = cmath.exp(1j * angle_p)
    by_speed = images(p.np, lambda z, angle: p.r * speed(z, angle)[1])
    by_torque = images(p.np, lambda z, angle: p.r * speed(z, angle)[2])
    if p.dsc:
        def open_v(z, angle):
            return p.Kv * speed(z, angle)[1][measured]

        def closed_v(z, angle):
            return p.r * speed(z, angle)[1] * (p.Kv / p.r) / (1 + open_v(z, angle))

        def ramp(z):
            n = p.np
            return sum((j + 1) / n * z**-j + (n - 1 - j) / n * z**-(n + j) for j in range(n))
        result["position_open"] = open_v(cmath.exp(1j * angle_v), angle_v)
        by_reference = images(p.np, closed_v, ramp)(angle_p)
        by_velocity = images(p.np, lambda z, a: closed_v(z, a) / p.Kv)(angle_p)
        by_ff = images(p.np, lambda z, a: p.r * (speed(z, a)[2] - speed(z, a)[1] * p.Kv * speed(z, a)[2][measured]
                                                 / (1 + open_v(z, a))))(angle_p)
    else:
        g = by_speed(angle_p)
        loop = p.Kv / p.r * g[measured]
        result["position_open"] = loop
        by_reference = p.Kv / p.r * g / (1 + loop)
        by_velocity = g / p.r / (1 + loop)
        t = by_torque(angle_p)
        by_ff = t - g * (p.Kv / p.r) * t[measured] / (1 + loop)
    result["position_closed"] = by_reference[measured]

    def delay(d):
        n = math.floor(d / p.Tp)
        f = d / p.Tp - n
        return ((1 - f) + f / zp) * zp**-n
    filter_ = sum(zp**-k for k in range(p.average)) / p.average
    difference = (1 - 1 / zp) / p.Tp
    if p.pt1:
        share = p.Tp / (p.dpos + p.Tp)
        balance = share / (1 - (1 - share) / zp)
    else:
        balance = delay(p.dpos)
    v_ff = p.kvff * difference * delay(p.dff)
    t_ff = p.ktff * p.Jff / p.r * difference**2 * delay(p.dff)
    result["setpoint"] = (filter_ * (balance * by_reference + v_ff * by_velocity + t_ff * by_ff))[3]
    return result


def cases():
    plain = Axis()
    # The Rust test has the same data.
    yield "plain", plain
    yield "options", replace(plain, kvff=.9, ktff=.6, dpos=1.3e-3, dff=.4e-3, average=5,
                             speed_filter=second_order(400, .7, 300, .1), model=pt2(120, .9), current_filter=pt2(900, .6))
    yield "dsc", replace(plain, dsc=True, Kv=120.0, kvff=1.0, ktff=.5, dpos=2.2e-3, pt1=True)
    yield "two_mass", replace(plain, Jl=.005, c=2500.0, d=.02, at_motor=True, kvff=1.0)
    yield "two_mass_scale", replace(plain, Jl=.005, c=2500.0, d=.02, dsc=True, current_filter=second_order(150, .5, 147, .02))


def main():
    target = pathlib.Path(__file__).parent.parent / "tests" / "drive" / "bode.json"
    rows = []
    for name, axis in cases():
        for hz in [0.7, 5.0, 17.0, 48.0, 96.0, 111.0, 163.0, 240.0]:
            values = {key: [value.real, value.imag] for key, value in responses(axis, hz).items()}
            rows.append({"case": name, "frequency_hz": hz, **values})
    target.write_text("[\n" + ",\n".join(json.dumps(row) for row in rows) + "\n]\n")


if __name__ == "__main__":
    main()
