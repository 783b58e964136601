#!/usr/bin/env python3
"""Independent reference for src/drive: models/drive.md sections 3 to 6 on scipy's solve_ivp.

Goes in: the cases below. Comes out: tests/drive/reference.csv, a few rows per case, and tests/drive/two_mass_sets.csv, axes with a second
mass drawn at random, each with its parameters; compared by tests/drive/reference.rs.
The plant is integrated numerically (DOP853, relative tolerance 1e-12) with terminal events for stop and breakaway; nothing is
shared with the Rust code, which solves each piece in closed form. Written from the model text alone.

    python3 -m venv .venv && .venv/bin/pip install numpy scipy
    .venv/bin/python tools/drive_reference.py
"""

import csv
import math
import pathlib
import random
from dataclasses import dataclass, replace

from scipy.integrate import solve_ivp

INF = math.inf


@dataclass(frozen=True)
class Drive:
    """Symbols of models/drive.md section 2; lu is mm or rad."""
    Tp: float
    np: int
    nv: int
    r: float
    R: float
    L: float
    Ke: float
    Kt: float
    J: float
    B: float
    Tc: float
    Ts: float
    Kv: float
    Kp: float
    Tn: float
    imax: float
    Kpi: float
    Tni: float
    umax: float
    vmax: float
    kvff: float = 0.0
    ktff: float = 0.0
    Jff: float = 0.0
    dpos: float = 0.0
    dff: float = 0.0
    g0: float = 0.0
    gs: float = 0.0
    gc: float = 0.0
    qpos: float = 0.0
    qmot: float = 0.0
    Jl: float = 0.0  # of J, behind a spring
    c: float = 0.0
    d: float = 0.0
    at_motor: bool = False  # MD31040 = 0
    screw: tuple = ()  # start, step, errors
    comp: tuple = ()
    pulse: float = 0.0  # MD32520
    fade: float = 1.0  # MD32540
    adapt: tuple = ()  # MD32530, MD32550, MD32560, MD32570
    play: float = 0.0
    half: float = 0.0  # of MD32450, with the direction of the set velocity


MVC_X = Drive(Tp=1e-3, np=8, nv=2, r=12 / math.tau, R=.75, L=6.5e-3, Ke=.43, Kt=1.30, J=.0085, B=.010, Tc=.6, Ts=.6,
              Kv=50, Kp=2.0, Tn=.010, imax=28, Kpi=22, Tni=.002, umax=245, vmax=400)
MVC_Y = replace(MVC_X, J=.0110, B=.012, Tc=1.2, Ts=1.2, Kp=2.2, Tn=.011)
UCP_Z = Drive(Tp=2e-3, np=16, nv=1, r=20 / math.tau, R=.35, L=3.6e-3, Ke=.50, Kt=1.50, J=.0120, B=.010, Tc=1.4, Ts=1.4,
              g0=4.0, Kv=50, Kp=2.8, Tn=.012, imax=45, Kpi=8, Tni=.002, umax=245, vmax=550)
UCP_A = Drive(Tp=2e-3, np=16, nv=1, r=1 / 120, R=1.1, L=9e-3, Ke=.45, Kt=1.35, J=.0032, B=.004, Tc=.7, Ts=.7,
              gs=1.1, gc=.25, Kv=33.33, Kp=.6, Tn=.015, imax=15, Kpi=20, Tni=.003, umax=245, vmax=math.radians(95))


def quantise(x, q):
    return x if q == 0 else q * math.floor(x / q + .5)


def clamp(x, m):
    return max(-m, min(m, x))


def plant(p, i, w, th, u, Tg, h):
    """One tick of length h: integrate to each event, change the law, go on."""
    t = 0.0
    force = 0  # direction after a breakaway, where Kt i - Tg = Ts to rounding
    while t < h:
        if w == 0 and force == 0 and abs(p.Kt * i - Tg) <= p.Ts:
            def leave(_, y):
                return abs(p.Kt * y[0] - Tg) - p.Ts
            leave.terminal, leave.direction = True, 1
            s = solve_ivp(lambda _, y: [(u - p.R * y[0]) / p.L], (t, h), [i], method="DOP853", rtol=1e-12, atol=1e-13,
                          max_step=h / 4, events=leave)
            i, t = s.y[0][-1], s.t[-1]
            if s.status == 0:
                return i, w, th
            force = math.copysign(1, p.Kt * i - Tg)
            continue
        side = force or (math.copysign(1, w) if w else math.copysign(1, p.Kt * i - Tg))
        force = 0
        f = p.Tc * side

        def law(_, y):
            return [(u - p.R * y[0] - p.Ke * y[1]) / p.L, (p.Kt * y[0] - p.B * y[1] - f - Tg) / p.J, y[1]]

        def stop(_, y):
            return y[1]
        stop.terminal, stop.direction = True, -side
        s = solve_ivp(law, (t, h), [i, w, th], method="DOP853", rtol=1e-12, atol=1e-13, max_step=h / 4, events=stop)
        (i, w, th), t = s.y[:, -1], s.t[-1]
        if s.status == 0:
            return i, w, th
        w = 0.0
    return i, w, th


def two_masses(p, y, u, Tg, h):
    """One tick of (i, wm, phi, wl, thl): friction, gravity and load act behind the spring."""
    t, force, Jm = 0.0, 0, p.J - p.Jl
    y = list(y)

    def spring(y):
        return p.c * y[2] + p.d * (y[1] - y[3])

    while t < h:
        if y[3] == 0 and force == 0 and abs(spring(y) - Tg) <= p.Ts:
            def rest(_, y):
                return [(u - p.R * y[0] - p.Ke * y[1]) / p.L, (p.Kt * y[0] - spring(y)) / Jm, y[1], 0.0, 0.0]

            def leave(_, y):
                return abs(spring(y) - Tg) - p.Ts
            leave.terminal, leave.direction = True, 1
            s = solve_ivp(rest, (t, h), y, method="DOP853", rtol=1e-12, atol=1e-13, max_step=h / 4, events=leave)
            y, t = list(s.y[:, -1]), s.t[-1]
            if s.status == 0:
                return y
            force = math.copysign(1, spring(y) - Tg)
            continue
        side = force or (math.copysign(1, y[3]) if y[3] else math.copysign(1, spring(y) - Tg))
        force = 0
        f = p.Tc * side

        def law(_, y):
            return [(u - p.R * y[0] - p.Ke * y[1]) / p.L, (p.Kt * y[0] - spring(y)) / Jm, y[1] - y[3],
                    (spring(y) - p.B * y[3] - f - Tg) / p.Jl, y[3]]

        def stop(_, y):
            return y[3]
        stop.terminal, stop.direction = True, -side
        s = solve_ivp(law, (t, h), y, method="DOP853", rtol=1e-12, atol=1e-13, max_step=h / 4, events=stop)
        y, t = list(s.y[:, -1]), s.t[-1]
        if s.status == 0:
            return y
        y[3] = 0.0
    return y


def error(table, x):
    """Linear between equidistant points, the ends hold outside."""
    if not table:
        return 0.0
    start, step, values = table
    n = min(max((x - start) / step, 0.0), len(values) - 1.0)
    k = min(math.floor(n), len(values) - 2)
    return values[k] + (n - k) * (values[k + 1] - values[k])


def behind(table, total):
    """x with x + error(x) = total."""
    x = total
    for _ in range(200):
        x = total - error(table, x)
    return x


class Delay:
    def __init__(self, d, Tp):
        self.n = math.floor(d / Tp)
        self.f = d / Tp - self.n
        self.s = []

    def __call__(self, s):
        self.s.append(s)
        k = len(self.s) - 1
        return (1 - self.f) * self.s[max(0, k - self.n)] + self.f * self.s[max(0, k - self.n - 1)]


def amplitude(p, a):
    """MD32510: the pulse over the acceleration at the reversal, piece by piece (SINUMERIK 840D sl, 828D, function manual K3, 03/2013, 4.6.4.1)."""
    if not p.adapt:
        return p.pulse
    low, a1, a2, a3 = p.adapt
    if a < a1:
        return p.pulse * a / a1
    if a <= a2:
        return p.pulse
    if a < a3:
        return p.pulse + (low - p.pulse) / (a3 - a2) * (a - a2)
    return low


def simulate(p, x_set, load, held=True):
    """Rows (x, x_meas, e_fol, w, i, i_avg, u, t_ref, t_fric, flags), one a position cycle."""
    Tv, Ti = p.Tp / p.np, p.Tp / p.np / p.nv

    def gravity(th):
        return p.g0 + p.gs * math.sin(p.r * th) + p.gc * math.cos(p.r * th)

    # The axis measures its first set-point.
    start = behind(p.comp, x_set[0])
    th, w = (start if p.at_motor else behind(p.screw, start)) / p.r, 0.0
    hold = gravity(th) if held else 0.0
    i, Iv = hold / p.Kt, hold
    Ii, i_avg, q_th = p.R * i, i, quantise(th, p.qmot)
    D_x, D_v, D_a = Delay(p.dpos, p.Tp), Delay(p.dff, p.Tp), Delay(p.dff, p.Tp)
    x_old, v_old, rows = x_set[0], 0.0, []
    direction, fading, nut = 0, 0.0, p.r * th
    if p.Jl:
        phi = hold / p.c
        y = [i, 0.0, phi, 0.0, th - phi if p.at_motor else th]
        th = y[4] + y[2]

    def load_angle():
        return y[4] if p.Jl else th

    def position():
        if p.play:
            return nut
        nominal = p.r * load_angle()
        return nominal + error(p.screw, nominal)
    for k, xs in enumerate(x_set):
        v = (xs - x_old) / p.Tp
        a = (v - v_old) / p.Tp
        fading *= math.exp(-p.Tp / p.fade)
        if abs(v) > 1e-9:
            now = int(math.copysign(1, v))
            if now == -direction:
                fading = now * amplitude(p, abs(a))
            direction = now
        x_old, v_old = xs, v
        x_ref, v_ff, t_ff = D_x(xs), p.kvff * D_v(v), p.ktff * p.Jff * D_a(a) / p.r
        x_meas = quantise(p.r * th if p.at_motor else position(), p.qpos)
        x_meas -= p.half * direction
        x_meas += error(p.comp, x_meas)
        e_fol = x_ref - x_meas
        v_un = p.Kv * e_fol + v_ff + fading
        w_ref = clamp(v_un, p.vmax) / p.r
        samples = []
        for n in range(p.np * p.nv):
            if n % p.nv == 0:
                w_meas = w
                if p.qmot:
                    q_new = quantise(th, p.qmot)
                    w_meas, q_th = (q_new - q_th) / Tv, q_new
                ew = w_ref - w_meas
                dI = p.Kp * Tv / p.Tn * ew
                t_un = p.Kp * ew + Iv + dI + t_ff
                t_ref = clamp(t_un, p.Kt * p.imax)
                if t_ref == t_un or ew * t_un < 0:
                    Iv += dI
                i_ref = t_ref / p.Kt
                t_clamped = t_ref != t_un
            ei = i_ref - i
            dI = p.Kpi * Ti / p.Tni * ei
            u_un = p.Kpi * ei + Ii + dI
            u = clamp(u_un, p.umax)
            if u == u_un or ei * u_un < 0:
                Ii += dI
            Tg = gravity(load_angle()) + load(k)
            if n == 0:
                wl = y[3] if p.Jl else w
                drive = (p.c * y[2] + p.d * (y[1] - y[3]) if p.Jl else p.Kt * i) - Tg
                t_fric = p.Tc * math.copysign(1, wl) + p.B * wl if wl else clamp(drive, p.Ts)
                flags = (v_un != clamp(v_un, p.vmax)) + 2 * t_clamped + 4 * (u != u_un)
                flags += 8 * (wl == 0 and p.Ts > 0 and abs(drive) <= p.Ts)
                rows.append((position(), x_meas, e_fol, w, i, i_avg, u, t_ref, t_fric, flags))
            samples.append(i)
            if p.Jl:
                y = two_masses(p, y, u, Tg, Ti)
                i, w, th = y[0], y[1], y[4] + y[2]
            else:
                i, w, th = plant(p, i, w, th, u, Tg, Ti)
            # The load is carried by whichever flank it touches at the end of a tick.
            nut = max(p.r * th - p.play / 2, min(p.r * th + p.play / 2, nut))
        i_avg = sum(samples) / len(samples)
    return rows


def cases():
    """Name, drive, set-points, load(k), held, rows to keep. The Rust test has the same set-points by the same formulas."""
    none = lambda k: 0.0
    # Reversals on a circle of 2 mm at 8 Hz.
    yield ("reversal", replace(MVC_X, kvff=1, dpos=1.2e-3, ktff=.5, Jff=.0085, dff=.3e-3),
           [2 * math.sin(math.tau * 8 * k * 1e-3) for k in range(161)], none, True, 4)
    # Slow ramp with breakaway far above Coulomb: six slips.
    yield ("stick_slip", replace(MVC_Y, Ts=3.6, Tn=.004),
           [0.0 if k < 2 else .01 + .0002 * k for k in range(401)], none, True, 10)
    # The same axis at a constant set-point: the integrator makes it hunt.
    yield ("hunting", replace(MVC_Y, Ts=3.6, Tn=.004),
           [0.0 if k < 2 else .01 for k in range(461)], none, True, 10)
    # A jump of 20 mm of a vertical axis: speed clamp, current and voltage limit; a load comes and goes.
    yield ("saturation", replace(UCP_Z, umax=35, vmax=250, imax=20),
           [0.0 if k < 5 else 20.0 for k in range(121)], lambda k: 3.0 if 70 <= k < 90 else 0.0, True, 3)
    # Tilting table, cold start, both encoders quantised, negative transmission.
    yield ("tilt", replace(UCP_A, r=-1 / 120, kvff=1, Ts=.9, qpos=2e-6, qmot=2e-4),
           [.3 + .05 * (1 - math.cos(math.tau * 4 * k * 2e-3)) for k in range(131)], none, False, 4)
    # A load behind a spring (anti-resonance 71 Hz, resonance 112 Hz), vertical, with stops, breakaways and a load that comes and goes.
    yield ("two_mass", replace(MVC_X, kvff=1, Ts=.9, g0=.5, Jl=.0051, c=1000, d=.03),
           [.3 * math.sin(math.tau * 5 * k * 1e-3) for k in range(301)], lambda k: 1.0 if 150 <= k < 170 else 0.0, True, 6)
    # Measured at the motor, screw with an error, compensated for the most part; the spring winds up.
    yield ("screw", replace(MVC_X, kvff=1, at_motor=True, Jl=.004, c=6000, d=.05,
                            screw=(-4.0, 1.5, (2e-3, 5e-3, -3e-3, 1e-3, 4e-3, 0.0)),
                            comp=(-4.0, 3.0, (2e-3, -2e-3, 3e-3))),
           [-5.0 + 6.0 * (1 - math.cos(math.tau * 2 * k * 1e-3)) for k in range(401)], none, True, 8)

    # Measured at the motor, play with its compensation, a friction pulse whose amplitude follows the acceleration: the reversals of a growing sine
    # are below the first, between the first and second, between the second and third and above the third one.
    yield ("reversal_pulse", replace(MVC_Y, kvff=1, at_motor=True, play=.02, half=.0075, pulse=6, fade=.012, adapt=(1.5, 200, 600, 1200)),
           [2e-6 * k * k * math.sin(math.tau * 6 * k * 1e-3) for k in range(801)], none, True, 8)


SET_KEYS = ("J", "Jl", "c", "d", "B", "Tc", "Ts", "g0", "kvff", "at_motor", "Kp", "Tn")
SETS = 4


def drawn(generator):
    """An axis with a second mass: resonance 30 Hz to 1 kHz, damping of it 0.01 to 0.3, speed loop well below the resonance of a stiff axis."""
    def log(low, high):
        return low * (high / low) ** generator.random()
    J = log(.004, .02)
    Jl = J * generator.uniform(.2, .8)
    reduced = Jl * (J - Jl) / J
    w = math.tau * log(30, 1000)
    Tc = log(.1, 2)
    return replace(MVC_X, J=J, Jl=Jl, c=reduced * w * w, d=2 * log(.01, .3) * reduced * w, B=log(.001, .05), Tc=Tc,
                   Ts=Tc * generator.choice((1, 1, 1.6)), g0=generator.choice((0, generator.uniform(-1, 1))),
                   kvff=generator.choice((0, 1)), at_motor=generator.random() < .5, Kp=50 * J, Tn=log(.01, .04))


def sets():
    """Drives that do not swing themselves up: an unstable one makes any two solutions part."""
    generator, count = random.Random(20261126), 0
    while count < SETS:
        drive = drawn(generator)
        rows = simulate(drive, [.4 * math.sin(math.tau * 9 * k * 1e-3) for k in range(81)], lambda k: .5 if 40 <= k < 55 else 0.0)
        if max(abs(row[0]) for row in rows) < .8:
            yield f"set{count}", drive, rows
            count += 1


def cells(row):
    return [*(f"{float(value):.13g}" for value in row[:-1]), row[-1]]


def main():
    tests = pathlib.Path(__file__).parent.parent / "tests" / "drive"
    columns = ["case", "k", "x_lu", "x_meas_lu", "e_fol_lu", "w_rad_s", "i_a", "i_avg_a", "u_v", "t_ref_n_m", "t_fric_n_m", "flags"]
    with (tests / "two_mass_sets.csv").open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["parameters", "case", *SET_KEYS])
        out.writerow(columns)
        for name, drive, rows in sets():
            out.writerow(["parameters", name, *(repr(float(getattr(drive, key))) for key in SET_KEYS)])
            for k, row in enumerate(rows):
                if k % 2 == 0:
                    out.writerow([name, k, *cells(row)])
            print(name, "done", flush=True)
    with (tests / "reference.csv").open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(columns)
        for name, drive, x_set, load, held, keep in cases():
            for k, row in enumerate(simulate(drive, x_set, load, held)):
                if k % keep == 0:
                    out.writerow([name, k, *cells(row)])
            print(name, "done", flush=True)


if __name__ == "__main__":
    main()
