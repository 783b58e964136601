#!/usr/bin/env python3
"""Traces of another plant than the one that is fitted, for tests/identify: a load behind a spring with play, and Stribeck friction.

Goes in: the two cases below. Comes out: tests/identify/other_plant.csv, read by tests/identify/other_plant.rs. Controllers as in
models/drive.md section 4; the plant is integrated numerically (fourth-order Runge-Kutta, 12.5 us) with friction as a smooth function of
speed. Nothing is shared with the Rust code. The values printed are the truth that an identification must not miss in its intervals.

    python3 -m venv .venv && .venv/bin/pip install numpy
    .venv/bin/python tools/identify_reference.py
"""

import math
import pathlib

import numpy as np

TP, NP, TI = 2e-3, 16, 125e-6
SUB = 10  # plant steps in TI
R_LU = 20 / math.tau
KT, KE, R, L = 1.40, .47, .42, 4.0e-3
KV, KP, TN, KPI, TNI = 50.0, 3.0, .012, 9.0, 2e-3
UMAX, IMAX = 245.0, 40.0
KVFF, DPOS = 1.0, 2.0e-3
# Coulomb, viscous, share above Coulomb at rest, Stribeck speed, load inertia, stiffness, damping, play (rad at the motor)
CASES = {
    "mild": dict(J=.0135, B=.012, Tc=1.6, over=.10, ws=2.0, Jl=.0050, c=2500.0, d=.35, play=.0003),
    "strong": dict(J=.0135, B=.012, Tc=1.6, over=.80, ws=25.0, Jl=.0070, c=350.0, d=.20, play=.004),
}


def profile():
    """Moves with raised-cosine acceleration: way mm, speed mm/s, peak acceleration mm/s2."""
    x = [0.0] * 50
    for way, speed, acc in [(12, 10, 800), (-12, 10, 800), (30, 40, 1500), (-30, 40, 1500), (60, 120, 2500), (-60, 120, 2500),
                            (90, 250, 3000), (-90, 250, 3000), (25, 150, 3000), (-25, 150, 3000)]:
        start, ramp = x[-1], max(2 * speed / acc, .02)
        const = max(abs(way) / speed - ramp, 0.0)
        peak = math.copysign(abs(way) / (ramp + const), way)
        total = 2 * ramp + const

        def lift(t):
            return t * t / (2 * ramp) + ramp / math.tau ** 2 * (math.cos(math.tau * t / ramp) - 1)

        for k in range(1, math.ceil(total / TP) + 1):
            t = min(k * TP, total)
            if t < ramp:
                s = peak * lift(t)
            elif total - t < ramp:
                s = way - peak * lift(total - t)
            else:
                s = peak * (lift(ramp) + t - ramp)
            x.append(start + s)
        x += [start + way] * 25
    return x


def simulate(p, xset, rng):
    Jm, Jl, c, d, play = p["J"] - p["Jl"], p["Jl"], p["c"], p["d"], p["play"]

    def friction(w):
        return math.tanh(w / .02) * p["Tc"] * (1 + p["over"] * math.exp(-(w / p["ws"]) ** 2)) + p["B"] * w

    def slope(i, wm, tm, wl, tl, u):
        twist = tm - tl
        if twist > play / 2:
            s = c * (twist - play / 2) + d * (wm - wl)
        elif twist < -play / 2:
            s = c * (twist + play / 2) + d * (wm - wl)
        else:
            s = 0.0
        return (u - R * i - KE * wm) / L, (KT * i - s) / Jm, wm, (s - friction(wl)) / Jl, wl

    state = [0.0] * 5
    iv = ii = 0.0
    before, rows, mean = xset[0], [], 0.0
    h = TI / SUB
    for k, x in enumerate(xset):
        measured = math.floor(R_LU * state[4] / 1e-3 + .5) * 1e-3
        ref = xset[max(k - 1, 0)]  # DPOS is one cycle
        vff = KVFF * (x - before) / TP
        before = x
        e = ref - measured
        wref = (KV * e + vff) / R_LU
        rows.append((x, measured, e, vff, KV * e + vff, mean))
        total = 0.0
        for _ in range(NP):
            ew = wref - state[1]
            di = KP * TI / TN * ew
            t = KP * ew + iv + di
            tref = max(-KT * IMAX, min(KT * IMAX, t))
            if tref == t or ew * t < 0:
                iv += di
            ei = tref / KT - state[0]
            dv = KPI * TI / TNI * ei
            un = KPI * ei + ii + dv
            u = max(-UMAX, min(UMAX, un))
            if u == un or ei * un < 0:
                ii += dv
            total += state[0]
            for _ in range(SUB):
                k1 = slope(*state, u)
                k2 = slope(*[s + h / 2 * a for s, a in zip(state, k1)], u)
                k3 = slope(*[s + h / 2 * a for s, a in zip(state, k2)], u)
                k4 = slope(*[s + h * a for s, a in zip(state, k3)], u)
                state = [s + h / 6 * (a + 2 * b + 2 * cc + dd) for s, a, b, cc, dd in zip(state, k1, k2, k3, k4)]
        mean = total / NP
    noisy = [round((row[5] + rng.normal(0, .05)) / .02) * .02 for row in rows]
    return [row[:5] + (n,) for row, n in zip(rows, noisy)]


def main():
    out = pathlib.Path(__file__).resolve().parent.parent / "tests" / "identify" / "other_plant.csv"
    xset = profile()
    rng = np.random.default_rng(20)
    lines = ["case,setpoint_mm,measured_mm,current_mean_a"]
    for name, p in CASES.items():
        for x, m, _e, _v, _c, i in simulate(p, xset, rng):
            lines.append(f"{name},{x:.6f},{m:.3f},{i:.2f}")
        print(name, p)
    out.write_text("\n".join(lines) + "\n")
    print(len(lines), "lines", out.stat().st_size, "bytes")


if __name__ == "__main__":
    main()
