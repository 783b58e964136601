#!/usr/bin/env python3
"""Independent reference for src/optimum: least times of some motions, found in the time domain.

Goes in: the cases below. Comes out: tests/optimum/reference.csv, the least time of every case, compared by tests/optimum/main.rs.
Nothing is shared with the Rust code, neither the formulation nor the solver: the path is q(u) with any parameter u (not the arc length),
the motion u(t) has constant third derivative on each of N equal steps of unknown length (one unknown a phase), and the problem is
solved as a sequence of linear programs (scipy, HiGHS) with a trust region; limits are asked for at the ends of every step. The Rust code
has cubics of v² over the arc length, and an interior-point method.

    python3 -m venv .venv && .venv/bin/pip install numpy scipy
    .venv/bin/python tools/optimum_reference.py
"""

import math
import pathlib
import sys
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_matrix

# [Essid 2019, table 2], every axis: mm/s, mm/s², mm/s³.
V, A, J = 20000.0 / 60.0, 1000.0, 15000.0


@dataclass
class Phase:
    """A stretch of path with one feed: q'(u), q''(u), q'''(u) as arrays (points, axes)."""
    derivatives: object
    u_end: float
    feed: float
    steps: int


def line(*direction):
    d = np.array(direction, dtype=float)
    return lambda u: (np.tile(d, (len(u), 1)), np.zeros((len(u), len(d))), np.zeros((len(u), len(d))))


def circle(radius):
    def derivatives(u):
        c, s = np.cos(u), np.sin(u)
        return (radius * np.stack([-s, c], 1), radius * np.stack([-c, -s], 1), radius * np.stack([s, -c], 1))
    return derivatives


def cubic(u):
    """x = 100 u, y = 100 (3 u³ - 4 u² + u)."""
    one = np.ones_like(u)
    return (np.stack([100 * one, 100 * (9 * u**2 - 8 * u + 1)], 1), np.stack([0 * one, 100 * (18 * u - 8)], 1),
            np.stack([0 * one, 1800 * one], 1))


def rows_of(phase, u, v, a, j):
    """Axis velocity, acceleration, jerk over their limits and their gradients by u, v, a, j (one sided values of j)."""
    d1, d2, d3 = phase.derivatives(u)
    h = 1e-6
    up, dn = phase.derivatives(u + h), phase.derivatives(u - h)
    e1, e2, e3 = [(p - m) / (2 * h) for p, m in zip(up, dn)]
    v_, a_, j_ = v[:, None], a[:, None], j[:, None]
    zero = np.zeros_like(d1)
    vel = (d1 * v_ / V, e1 * v_ / V, d1 / V, zero, zero)
    acc = ((d1 * a_ + d2 * v_**2) / A, (e1 * a_ + e2 * v_**2) / A, 2 * d2 * v_ / A, d1 / A, zero)
    jerk = ((d1 * j_ + 3 * d2 * v_ * a_ + d3 * v_**3) / J, (e1 * j_ + 3 * e2 * v_ * a_ + e3 * v_**3) / J,
            (3 * d2 * a_ + 3 * d3 * v_**2) / J, 3 * d2 * v_ / J, d1 / J)
    return vel, acc, jerk


class Motion:
    def __init__(self, phases):
        self.phases = phases
        self.slices, at = [], 0
        for p in phases:
            n = p.steps
            self.slices.append(dict(u=slice(at, at + n + 1), v=slice(at + n + 1, at + 2 * n + 2), a=slice(at + 2 * n + 2, at + 3 * n + 3),
                                    j=slice(at + 3 * n + 3, at + 4 * n + 3), dt=at + 4 * n + 3))
            at += 4 * n + 4
        self.size = at

    def start(self, seconds):
        """A slow motion from rest to rest, cut into the phases."""
        x = np.zeros(self.size)
        ends = np.cumsum([p.u_end for p in self.phases])
        total = ends[-1]
        tau = np.linspace(0, 1, 20001)
        along = total * (10 * tau**3 - 15 * tau**4 + 6 * tau**5)
        begin = 0.0
        for p, s, end in zip(self.phases, self.slices, ends):
            t0, t1 = np.interp([begin, end], along, tau)
            t = np.linspace(t0, t1, p.steps + 1)
            x[s["u"]] = total * (10 * t**3 - 15 * t**4 + 6 * t**5) - begin
            x[s["v"]] = total * (30 * t**2 - 60 * t**3 + 30 * t**4) / seconds
            x[s["a"]] = total * (60 * t - 180 * t**2 + 120 * t**3) / seconds**2
            m = (t[1:] + t[:-1]) / 2
            x[s["j"]] = total * (60 - 360 * m + 360 * m**2) / seconds**3
            x[s["dt"]] = (t1 - t0) * seconds / p.steps
            begin = end
        return x

    def time(self, x):
        return sum(p.steps * x[s["dt"]] for p, s in zip(self.phases, self.slices))

    def equalities(self, x):
        """Residuals and gradients: motion over every step, ends, joints."""
        r, i, k, g, row = [], [], [], [], 0

        def put(res, terms):
            nonlocal row
            res = np.atleast_1d(res)
            for col, val in terms:
                col = np.atleast_1d(col)
                i.append(np.arange(row, row + len(res)))
                k.append(np.broadcast_to(col, len(res)))
                g.append(np.broadcast_to(val, len(res)))
            r.append(res)
            row += len(res)

        index = np.arange(self.size)
        for p, s in zip(self.phases, self.slices):
            u, v, a, j, h = x[s["u"]], x[s["v"]], x[s["a"]], x[s["j"]], x[s["dt"]]
            iu, iv, ia, ij, ih = index[s["u"]], index[s["v"]], index[s["a"]], index[s["j"]], s["dt"]
            v0, a0 = v[:-1], a[:-1]
            put(u[1:] - u[:-1] - v0 * h - a0 * h**2 / 2 - j * h**3 / 6,
                [(iu[1:], 1), (iu[:-1], -1), (iv[:-1], -h), (ia[:-1], -h**2 / 2), (ij, -h**3 / 6), (ih, -v0 - a0 * h - j * h**2 / 2)])
            put((v[1:] - v0 - a0 * h - j * h**2 / 2),
                [(iv[1:], 1), (iv[:-1], -1), (ia[:-1], -h), (ij, -h**2 / 2), (ih, -a0 - j * h)])
            put((a[1:] - a0 - j * h), [(ia[1:], 1), (ia[:-1], -1), (ij, -h), (ih, -j)])
            put(u[0], [(iu[0], 1)])
            put(u[-1] - p.u_end, [(iu[-1], 1)])
        first, last = self.slices[0], self.slices[-1]
        for s, at in ((first, 0), (last, -1)):
            for name in "va":
                put(x[s[name]][at], [(index[s[name]][at], 1)])
        for s, n in zip(self.slices, self.slices[1:]):
            for name in "va":
                put(x[n[name]][0] - x[s[name]][-1], [(index[n[name]][0], 1), (index[s[name]][-1], -1)])
        return np.concatenate(r), (np.concatenate(g), (np.concatenate(i), np.concatenate(k))), row

    def inequalities(self, x):
        """Values (at most 1) and gradients."""
        r, i, k, g, row = [], [], [], [], 0
        index = np.arange(self.size)
        for p, s in zip(self.phases, self.slices):
            n = p.steps
            for nodes in (np.arange(0, n), np.arange(1, n + 1)):
                steps = np.arange(n)
                u, v, a, j = x[s["u"]][nodes], x[s["v"]][nodes], x[s["a"]][nodes], x[s["j"]][steps]
                cols = [index[s["u"]][nodes], index[s["v"]][nodes], index[s["a"]][nodes], index[s["j"]][steps]]
                for value, *grads in rows_of(p, u, v, a, j):
                    for axis in range(value.shape[1]):
                        for sign in (1, -1):
                            r.append(sign * value[:, axis])
                            for col, grad in zip(cols, grads):
                                i.append(np.arange(row, row + n))
                                k.append(col)
                                g.append(sign * grad[:, axis])
                            row += n
                d1, d2, _ = p.derivatives(u)
                speed = np.linalg.norm(d1, axis=1)
                turn = (d1 * d2).sum(1) / speed
                r.append(v * speed / p.feed)
                for col, grad in ((cols[0], v * turn / p.feed), (cols[1], speed / p.feed)):
                    i.append(np.arange(row, row + n))
                    k.append(col)
                    g.append(grad)
                row += n
        return np.concatenate(r), (np.concatenate(g), (np.concatenate(i), np.concatenate(k))), row

    def solve(self, seconds, name):
        x = self.start(seconds)
        scale = np.zeros(self.size)
        radius = 0.3
        cost = np.zeros(self.size)
        for p, s in zip(self.phases, self.slices):
            cost[s["dt"]] = p.steps
        weight = 10.0 * seconds

        def merit(x):
            # Residuals of the motion in shares of the way.
            eq = np.abs(self.equalities(x)[0]).max() / max(p.u_end for p in self.phases)
            return self.time(x) + weight * (np.maximum(self.inequalities(x)[0] - 1, 0).max(initial=0) + eq)

        best, quiet = merit(x), 0
        for round_ in range(300):
            for s in self.slices:
                for key in "uvaj":
                    scale[s[key]] = max(np.abs(x[s[key]]).max(), 1e-9)
                scale[s["dt"]] = x[s["dt"]]
            eq, eg, en = self.equalities(x)
            iq, ig, im = self.inequalities(x)
            # One slack for all limits: a share by which they may be exceeded, at a price.
            rows, cols = ig[1]
            g = coo_matrix((np.concatenate([ig[0] * scale[cols], -np.ones(im)]),
                            (np.concatenate([rows, np.arange(im)]), np.concatenate([cols, np.full(im, self.size)]))), (im, self.size + 1))
            e = coo_matrix((eg[0] * scale[eg[1][1]], eg[1]), (en, self.size + 1))
            bounds = [(-radius, radius)] * self.size + [(0, None)]
            found = linprog(np.append(cost * scale, weight), A_ub=g.tocsr(), b_ub=1 - iq, A_eq=e.tocsr(), b_eq=-eq, bounds=bounds, method="highs")
            if found.status != 0:
                radius /= 2
                if radius < 1e-7:
                    break
                continue
            next_x = x + scale * found.x[:-1]
            value = merit(next_x)
            if value < best:
                gained = best - value
                x, best = next_x, value
                radius = min(radius * 1.5, 0.5)
                quiet = quiet + 1 if gained < 2e-6 * best else 0
                if quiet > 3:
                    break
            else:
                radius /= 3
                if radius < 1e-7:
                    break
        over = self.inequalities(x)[0].max() - 1
        left = np.abs(self.equalities(x)[0]).max()
        print(f"{name}: {self.time(x):.5f} s, limits exceeded by {over:.1e}, equations by {left:.1e}, {round_ + 1} rounds", file=sys.stderr)
        return self.time(x)


def cases(steps):
    third = steps // 3
    yield "line", [Phase(line(1.0), 100.0, 10000 / 60, steps)], 3.0
    # Unequal shares of two axes: the length of (3, 4) / 5.
    yield "diagonal", [Phase(line(0.6, 0.8), 50.0, 30000 / 60, steps)], 3.0
    yield "slow_middle", [Phase(line(1.0), 40.0, 100.0, third), Phase(line(1.0), 20.0, 20.0, third), Phase(line(1.0), 40.0, 100.0, third)], 5.0
    yield "circle_at_feed", [Phase(circle(20.0), 2 * math.pi, 50.0, steps)], 8.0
    yield "circle_at_limits", [Phase(circle(5.0), 2 * math.pi, 10000 / 60, steps)], 4.0
    yield "cubic", [Phase(cubic, 1.0, 30000 / 60, steps)], 5.0


if __name__ == "__main__":
    here = pathlib.Path(__file__).resolve().parent.parent
    chosen = sys.argv[1:]
    lines = ["case,steps,time_s"]
    for steps in (150, 300):
        for name, phases, seconds in cases(steps):
            if not chosen or name in chosen:
                lines.append(f"{name},{steps},{Motion(phases).solve(seconds, name):.5f}")
    if not chosen:
        (here / "tests/optimum/reference.csv").write_text("\n".join(lines) + "\n")
