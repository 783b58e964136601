#!/usr/bin/env python3
"""Traces of another plant than the one that is fitted, for tests/identify: a load behind a spring with play, and Stribeck friction.

Goes in: the two cases below, and PLANTS plants drawn at random. Comes out: tests/identify/other_plant.csv (the cases, with noise) and
tests/identify/other_plants.csv (the plants, and of the first SAMPLED of them every STRIDE-th row, without noise), read by
tests/identify/other_plant.rs. Controllers as in models/drive.md section 4; the plant is integrated numerically (fourth-order Runge-Kutta,
12.5 us) with friction as a smooth function of speed. Nothing is shared with the Rust code. The values printed are the truth that an
identification must not miss in its intervals. `--plants` writes the second file alone; the profile is shared with tune_reference.py by hand.

    python3 -m venv .venv && .venv/bin/pip install numpy
    .venv/bin/python tools/identify_reference.py
"""

import math
import pathlib
import sys

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


PLANTS, SAMPLED, STRIDE = 200, 6, 40


def drawn(rng):
    """A plant between stiff and soft, with a little friction at low speed or much, and how far it moves."""
    inertia = rng.uniform(.010, .018)
    return dict(
        J=inertia, B=rng.uniform(.008, .02), Tc=rng.uniform(1.0, 2.2), over=rng.uniform(0, .8), ws=rng.uniform(1, 25),
        Jl=inertia * rng.uniform(.25, .55), c=350 * (2500 / 350) ** rng.uniform(), d=rng.uniform(.15, .4),
        play=rng.uniform(0, .004), scale=rng.uniform(.7, 1.2))


def side_by_side(plants, xset):
    """The same as `simulate`, without noise, all plants at once: measured position and mean current, one row a cycle."""
    J, B, Tc, over, ws, Jl, c, d, play, scale = (np.array([p[k] for p in plants]) for k in plants[0])
    state = np.zeros((5, len(plants)))
    iv, ii, mean = np.zeros(len(plants)), np.zeros(len(plants)), np.zeros(len(plants))
    h, rows = TI / SUB, []

    def slope(z, u):
        i, wm, tm, wl, tl = z
        twist = tm - tl
        beyond = np.where(np.abs(twist) > play / 2, twist - np.copysign(play / 2, twist), 0.0)
        s = np.where(beyond != 0.0, c * beyond + d * (wm - wl), 0.0)
        friction = np.tanh(wl / .02) * Tc * (1 + over * np.exp(-(wl / ws) ** 2)) + B * wl
        return np.array([(u - R * i - KE * wm) / L, (KT * i - s) / (J - Jl), wm, (s - friction) / Jl, wl])

    def pi(off, gain, reset, limit, integral):
        more = gain * TI / reset * off
        asked = gain * off + integral + more
        given = np.clip(asked, -limit, limit)
        return given, integral + np.where((given == asked) | (off * asked < 0), more, 0.0)

    for k, x in enumerate(xset):
        measured = np.floor(R_LU * state[4] / 1e-3 + .5) * 1e-3
        e = scale * xset[max(k - 1, 0)] - measured
        wref = (KV * e + KVFF * scale * (x - xset[max(k - 1, 0)]) / TP) / R_LU
        rows.append((measured, mean))
        total = np.zeros(len(plants))
        for _ in range(NP):
            tref, iv = pi(wref - state[1], KP, TN, KT * IMAX, iv)
            u, ii = pi(tref / KT - state[0], KPI, TNI, UMAX, ii)
            total += state[0]
            for _ in range(SUB):
                k1 = slope(state, u)
                k2 = slope(state + h / 2 * k1, u)
                k3 = slope(state + h / 2 * k2, u)
                k4 = slope(state + h * k3, u)
                state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        mean = total / NP
    return rows


def write_plants():
    out = pathlib.Path(__file__).resolve().parent.parent / "tests" / "identify" / "other_plants.csv"
    rng = np.random.default_rng(7)
    plants = [{k: float(f"{v:.6g}") for k, v in drawn(rng).items()} for _ in range(PLANTS)]
    lines = ["plant," + ",".join(plants[0])]
    lines += [f"{n}," + ",".join(f"{v:.6g}" for v in p.values()) for n, p in enumerate(plants)]
    lines.append("row,then position_mm and current_a of each of the first plants")
    rows = side_by_side(plants[:SAMPLED], profile())
    for k in range(0, len(rows), STRIDE):
        cells = [f"{m:.3f},{i:.4f}" for m, i in zip(*rows[k])]
        lines.append(f"row {k}," + ",".join(cells))
    out.write_text("\n".join(lines) + "\n")
    print(len(lines), "lines", out.stat().st_size, "bytes")


def main():
    write_plants()
    if "--plants" in sys.argv[1:]:
        return
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
