#!/usr/bin/env python3
"""Deviations of another plant than the one that is believed, for tests/tune: a load behind a spring with play, and Stribeck friction.

Goes in: the machine class MVC850, axes X and Y, as models/drive.md has them for the controllers (section 4); the plants are other ones. Comes
out: tests/tune/other_plant.csv (set-points and control deviation of X with the gains before, two programs), tests/tune/other_plant_gains.csv
(RMS of the deviation for a grid of gains: the deviation is nearly affine in them, so that a test reads any gains off it) and
tests/tune/other_plant_xy.csv (paths in X and Y with the deviations of both). The plant is integrated with the fourth-order Runge-Kutta method
in steps of 6.25 us, friction is a smooth function of speed. Nothing is shared with the Rust code; tests/tune/foreign.rs has the plant once
more, held against these files, for gains that are not known beforehand.

    python3 -m venv .venv && .venv/bin/pip install numpy numba
    .venv/bin/python tools/tune_reference.py
"""

import math
import pathlib

import numpy as np
from numba import njit

TP, NV, NI, TI = 1e-3, 8, 2, 62.5e-6  # 8 speed cycles in a position cycle, 2 current cycles in a speed cycle
SUB = 10
R_LU = 12 / math.tau
KT, KE, R, L = 1.30, .43, .75, 6.5e-3
KV, KPI, TNI = 50.0, 22.0, 2e-3
UMAX, IMAX = 245.0, 28.0
# Controllers: gain and time of the speed loop, inertia that the feed-forward believes.
CONTROL = {"X": (2.0, .010, .0085), "Y": (2.2, .011, .011)}
# Plants: inertias of motor and load, spring, damping, play; Coulomb, viscous, share above Coulomb at rest, Stribeck speed.
PLANT = {
    "X": (.0060, .0035, 2000.0, .25, .0008, .75, .011, .35, 6.0),
    "Y": (.0065, .0060, 2600.0, .40, .0012, 1.35, .016, .25, 8.0),
}
SCALE_MM = 1e-3
BEFORE = (1.0, 0.0, 1.2e-3)
VELOCITY, TORQUE, DELAY_MS = (.985, 1.0, 1.015), (0.0, .75, 1.5), (.4, .7, 1.0, 1.3, 1.6)
MOVES = {
    "seen": [(40, 150, 1500), (-40, 150, 1500), (25, 60, 800), (-30, 100, 1200), (5, 200, 1500)],
    "unseen": [(12, 100, 1200), (-32, 160, 1500), (20, 50, 600)],
}


def profile(moves):
    """Moves with raised-cosine acceleration: way mm, speed mm/s, peak acceleration mm/s2."""
    x = [0.0] * 50
    for way, speed, acc in moves:
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
        x += [start + way] * 40
    return np.round(np.array(x), 6)


@njit
def slope(i, wm, tm, wl, tl, u, plant):
    JM, JL, C, D, PLAY, TC, B, OVER, WS = plant
    twist = tm - tl
    s = 0.0
    if twist > PLAY / 2:
        s = C * (twist - PLAY / 2) + D * (wm - wl)
    elif twist < -PLAY / 2:
        s = C * (twist + PLAY / 2) + D * (wm - wl)
    friction = math.tanh(wl / .02) * TC * (1 + OVER * math.exp(-(wl / WS) ** 2)) + B * wl
    return np.array([(u - R * i - KE * wm) / L, (KT * i - s) / JM, wm, (s - friction) / JL, wl])


@njit
def deviation(xset, velocity, torque, delay, control, plant):
    KP, TN, JFF = control
    out = np.zeros(len(xset))
    y = np.zeros(5)
    iv = ii = v_before = 0.0
    h = TI / SUB
    whole = int(delay / TP + 1e-9)
    share = delay / TP - whole
    for k in range(len(xset)):
        v = (xset[k] - xset[max(k - 1, 0)]) / TP
        a = (v - v_before) / TP
        v_before = v
        ref = (1 - share) * xset[max(k - whole, 0)] + share * xset[max(k - whole - 1, 0)]
        e = ref - math.floor(R_LU * y[4] / SCALE_MM + .5) * SCALE_MM
        out[k] = e
        wref = (KV * e + velocity * v) / R_LU
        tff = torque * JFF * a / R_LU
        for _ in range(NV):
            ew = wref - y[1]
            di = KP * NI * TI / TN * ew
            t = KP * ew + iv + di + tff
            tref = max(-KT * IMAX, min(KT * IMAX, t))
            if tref == t or ew * t < 0:
                iv += di
            for _ in range(NI):
                ei = tref / KT - y[0]
                dv = KPI * TI / TNI * ei
                un = KPI * ei + ii + dv
                u = max(-UMAX, min(UMAX, un))
                if u == un or ei * un < 0:
                    ii += dv
                for _ in range(SUB):
                    k1 = slope(y[0], y[1], y[2], y[3], y[4], u, plant)
                    p = y + h / 2 * k1
                    k2 = slope(p[0], p[1], p[2], p[3], p[4], u, plant)
                    p = y + h / 2 * k2
                    k3 = slope(p[0], p[1], p[2], p[3], p[4], u, plant)
                    p = y + h * k3
                    k4 = slope(p[0], p[1], p[2], p[3], p[4], u, plant)
                    y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return out


# Paths: lines by their end, circles by radius and sense; speed mm/s and peak acceleration mm/s2 along the path.
PATHS = {
    "seen": [("circle", 12, 1, 100, 900), ("line", (10, 6), 80, 900), ("line", (0, 9), 120, 1000), ("circle", 8, -1, 70, 800)],
    "unseen": [("line", (-8, 11), 110, 900), ("circle", 9, -1, 90, 900), ("line", (6, -2), 60, 700)],
}


def path(moves):
    """X and Y in mm: each move from rest to rest."""
    points = [np.zeros((50, 2))]
    for kind, what, *rest in moves:
        start = points[-1][-1]
        if kind == "line":
            way = np.array(what, float) - start
            s = profile([(float(np.hypot(*way)), *rest)])[50:]
            points.append(start + np.outer(s / np.hypot(*way), way))
        else:
            sense, speed, acc = rest
            s = profile([(math.tau * what, speed, acc)])[50:]
            angle = sense * s / what
            points.append(start + what * np.column_stack((1 - np.cos(angle), np.sin(angle))))
    return np.round(np.concatenate(points), 6)


def main():
    folder = pathlib.Path(__file__).resolve().parent.parent / "tests" / "tune"
    lines, gains = ["program,setpoint_mm,deviation_mm"], ["program,velocity,torque,delay_ms,rms_mm"]
    for name, moves in MOVES.items():
        x = profile(moves)
        before = deviation(x, *BEFORE, CONTROL["X"], PLANT["X"])
        lines += [f"{name},{a:.6f},{b:.6f}" for a, b in zip(x, before)]
        rms = {}
        for v in VELOCITY:
            for t in TORQUE:
                for d in DELAY_MS:
                    rms[v, t, d] = math.sqrt(np.mean(deviation(x, v, t, d * 1e-3, CONTROL["X"], PLANT["X"]) ** 2))
                    gains.append(f"{name},{v},{t},{d},{rms[v, t, d]:.9f}")
        best = min(rms, key=rms.get)
        print(name, len(x), "ms, before", math.sqrt(np.mean(before ** 2)), "best of the grid", best, rms[best])
    rows = ["program,x_mm,x_deviation_mm,y_mm,y_deviation_mm"]
    for name, moves in PATHS.items():
        xy = path(moves)
        both = [deviation(xy[:, i].copy(), *BEFORE, CONTROL[axis], PLANT[axis]) for i, axis in enumerate("XY")]
        rows += [f"{name},{x:.6f},{a:.6f},{y:.6f},{b:.6f}" for (x, y), a, b in zip(xy, *both)]
        print(name, len(xy), "ms, RMS of X and Y", [math.sqrt(np.mean(one ** 2)) for one in both])
    (folder / "other_plant_xy.csv").write_text("\n".join(rows) + "\n")
    (folder / "other_plant.csv").write_text("\n".join(lines) + "\n")
    (folder / "other_plant_gains.csv").write_text("\n".join(gains) + "\n")


if __name__ == "__main__":
    main()
