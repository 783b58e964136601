#!/usr/bin/env python3
"""The picture of the README: a run of programs/spline.mpf on the Spinner MVC 850, drawn from its recording.

    cargo build --release
    python3 tools/readme_picture.py              # runs, exports, writes docs/spline.svg
    python3 tools/readme_picture.py --csv run.csv -o picture.svg
    python3 tools/readme_picture.py --self-test  # draws made-up motions and looks at the result

In: the CSV that `sollwert export` writes (and, without --csv, the program that writes it). Out: one SVG of three panels: the path
coloured by feed; the feed over time with the limit that holds; the following error. Equal input gives equal bytes, lines are thinned
to what can be seen, and only Python's standard library is used, so that the picture can be made anew anywhere and its changes read.
"""
import argparse
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from xml.sax.saxutils import escape

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = "programs/spline.mpf"
MACHINE = "machines/spinner_mvc850.toml"
PICTURE = "docs/spline.svg"

WIDTH_PX, MARGIN_PX, LEFT_PX = 880, 20, 74
PLOT_WIDTH_PX = WIDTH_PX - LEFT_PX - MARGIN_PX
VISIBLE_PX = 0.2  # a point that is nearer than this to the line through its neighbours is left out
FEED_STEPS = 24  # colours from standstill to the highest feed
SLOW_TO_FAST = ["#a50f15", "#e6550d", "#e0a419", "#3d9c73", "#1f5fa8"]
LIMIT_COLOURS = ["#4c78a8", "#e45756", "#f2a93b", "#54a24b", "#b279a2", "#9d755d", "#72b7b2", "#6b6b6b"]
AXIS_COLOURS = ["#1f5fa8", "#d1495b", "#3d9c73", "#8f6bb3", "#b07d2b"]
INK, FAINT, PAPER = "#24292f", "#d8dee4", "#ffffff"


class Fault(Exception):
    """Something that the caller can mend, in one sentence."""


# --- data ----------------------------------------------------------------------------------------------------------------


def read_columns(path):
    """Columns of an export by name: numbers, or text for `path.limit_*`; `None` for a column that is neither."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    if len(rows) < 2:
        raise Fault(f"{path} has {len(rows)} rows: nothing to draw")
    wanted = ["time_s", "X.position_setpoint_mm", "Y.position_setpoint_mm", "path.feed_mm_min", "path.limit_kind"]
    absent = [name for name in wanted if name not in rows[0]]
    if absent:
        raise Fault(f"{path} has no column {', '.join(absent)}: it is no export of a run in X and Y")
    hold_limits(rows)
    columns = {}
    for name in rows[0]:
        texts = [row[name] for row in rows]
        columns[name] = texts if name.startswith("path.limit_") else numbers(held(texts))
    return columns


def hold_limits(rows):
    """Fills the limit of rows that have none (the path ticks slower than the axes). An axis is empty where the limit has none."""
    last = next((row for row in rows if row["path.limit_kind"]), rows[0])
    for row in rows:
        if row["path.limit_kind"]:
            last = row
        else:
            row.update({name: last[name] for name in row if name.startswith("path.limit_")})


def held(texts):
    """Each missing text is the last one before it, or the first one of all."""
    last = next((text for text in texts if text), "")
    filled = []
    for text in texts:
        last = text or last
        filled.append(last)
    return filled


def numbers(texts):
    """The texts as floats, or `None` if they are none."""
    try:
        values = [float(text) for text in texts]
    except ValueError:
        return None
    return values if all(math.isfinite(value) for value in values) else None


def limit_names(columns):
    """`X.jerk` or `feed`, one for each row."""
    axes = columns.get("path.limit_axis", [""] * len(columns["path.limit_kind"]))
    return [f"{axis}.{kind}" if axis else kind for axis, kind in zip(axes, columns["path.limit_kind"])]


def run_and_export(folder):
    """Runs the README's program; gives the path of the CSV and the figures of `run --json`."""
    program = ROOT / "target" / "release" / "sollwert"
    if not program.exists():
        raise Fault("target/release/sollwert is not there: run `cargo build --release` first")
    recording, table = folder / "spline.mcap", folder / "spline.csv"
    run = [program, "run", PROGRAM, "-m", MACHINE, "-o", recording, "--json"]
    figures = json.loads(subprocess.run(run, cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout)
    subprocess.run([program, "export", recording, "-o", table], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return table, figures


# --- drawing -------------------------------------------------------------------------------------------------------------


def thinned(points, tolerance_px=VISIBLE_PX):
    """Douglas and Peucker: the points that a line needs to stay within the tolerance."""
    if len(points) < 3:
        return points
    keep, open_spans = {0, len(points) - 1}, [(0, len(points) - 1)]
    while open_spans:
        first, last = open_spans.pop()
        (x0, y0), (x1, y1) = points[first], points[last]
        length = math.hypot(x1 - x0, y1 - y0)
        worst, place = 0.0, None
        for i in range(first + 1, last):
            x, y = points[i]
            away = abs((x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)) / length if length else math.hypot(x - x0, y - y0)
            if away > worst:
                worst, place = away, i
        if worst > tolerance_px:
            keep.add(place)
            open_spans += [(first, place), (place, last)]
    return [points[i] for i in sorted(keep)]


def line_data(points):
    """Attribute `d` of a line, with a tenth of a pixel."""
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in thinned(points))


def ticks(low, high, most=6):
    """Round values that divide a range."""
    if high <= low:
        return [low]
    rough = (high - low) / most
    power = 10 ** math.floor(math.log10(rough))
    step = next(step for step in (power, 2 * power, 5 * power, 10 * power) if step >= rough * (1 - 1e-9))
    return [i * step for i in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def shown(value):
    """A number for an axis."""
    return f"{value:.6g}".replace("-", "\u2212")


def colour_between(stops, share):
    """Colour at a share of the way along the stops."""
    place = min(max(share, 0.0), 1.0) * (len(stops) - 1)
    index = min(int(place), len(stops) - 2)
    mixed = []
    for channel in (1, 3, 5):
        a, b = (int(stop[channel : channel + 2], 16) for stop in stops[index : index + 2])
        mixed.append(round(a + (b - a) * (place - index)))
    return "#%02x%02x%02x" % tuple(mixed)


class Panel:
    """A plot with its own scales, at a height of the picture."""

    def __init__(self, top_px, height_px, x_range, y_range, label, x_label):
        self.top, self.height = top_px, height_px
        self.x_low, self.x_high = widened(x_range)
        self.y_low, self.y_high = widened(y_range)
        self.label, self.x_label = label, x_label

    def x(self, value):
        return LEFT_PX + (value - self.x_low) / (self.x_high - self.x_low) * PLOT_WIDTH_PX

    def y(self, value):
        return self.top + self.height - (value - self.y_low) / (self.y_high - self.y_low) * self.height

    def frame(self):
        """Grid, numbers and labels."""
        out = [text(LEFT_PX, self.top - 8, self.label, weight="600")]
        bottom = self.top + self.height
        for value in ticks(self.y_low, self.y_high, 4):
            y = self.y(value)
            out.append(f'<path d="M{LEFT_PX} {y:.1f}h{PLOT_WIDTH_PX}" stroke="{FAINT}"/>')
            out.append(text(LEFT_PX - 8, y + 4, shown(value), anchor="end"))
        for value in ticks(self.x_low, self.x_high, 10):
            x = self.x(value)
            out.append(f'<path d="M{x:.1f} {self.top}v{self.height}" stroke="{FAINT}"/>')
            out.append(text(x, bottom + 16, shown(value), anchor="middle"))
        out.append(text(LEFT_PX + PLOT_WIDTH_PX, bottom + 32, self.x_label, anchor="end"))
        return out


def widened(bounds):
    """A range that is not empty."""
    low, high = bounds
    return (low, high) if high - low > 1e-12 * max(1.0, abs(low), abs(high)) else (low - 0.5, high + 0.5)


def text(x, y, content, anchor="start", weight="400"):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-weight="{weight}">{escape(content)}</text>'


def runs_of(values):
    """(value, first, last) of each stretch of equal values."""
    start = 0
    for i in range(1, len(values) + 1):
        if i == len(values) or values[i] != values[start]:
            yield values[start], start, i - 1
            start = i


def draw_path(columns, top_px):
    """Panel 1: Y over X with equal scales, coloured by feed."""
    x, y, feed = columns["X.position_setpoint_mm"], columns["Y.position_setpoint_mm"], columns["path.feed_mm_min"]
    (x_low, x_high), (y_low, y_high) = widened((min(x), max(x))), widened((min(y), max(y)))
    room = 0.03 * (x_high - x_low)
    scale = min(PLOT_WIDTH_PX / (x_high - x_low + 2 * room), 330.0 / (y_high - y_low + 2 * room))
    height = round((y_high - y_low + 2 * room) * scale)
    spare = PLOT_WIDTH_PX / scale - (x_high - x_low)
    panel = Panel(
        top_px,
        height,
        (x_low - spare / 2, x_high + spare / 2),
        (y_low - room, y_high + room),
        "Path: Y over X in mm, coloured by feed",
        "X in mm",
    )
    out = panel.frame()
    highest = max(max(feed), 1e-9)
    steps = [round(value / highest * FEED_STEPS) for value in feed]
    for step, first, last in runs_of(steps):
        # Each stretch ends where the next one begins, so that the line has no gaps.
        points = [(panel.x(x[i]), panel.y(y[i])) for i in range(first, min(last + 2, len(x)))]
        if len(points) > 1:
            colour = colour_between(SLOW_TO_FAST, step / FEED_STEPS)
            out.append(f'<path d="{line_data(points)}" stroke="{colour}" stroke-width="3.5" stroke-linecap="round" fill="none"/>')
    legend = f"{shown(round(highest))} mm/min"
    wide, right = 160, LEFT_PX + PLOT_WIDTH_PX
    start = right - 12 - 7.5 * len(legend) - wide
    for step in range(FEED_STEPS):
        colour = colour_between(SLOW_TO_FAST, step / (FEED_STEPS - 1))
        at = start + step * wide / FEED_STEPS
        out.append(f'<rect x="{at:.1f}" y="{top_px - 17}" width="{wide / FEED_STEPS + 0.5:.1f}" height="9" fill="{colour}"/>')
    out.append(text(start - 6, top_px - 8, "0", anchor="end"))
    out.append(text(right, top_px - 8, legend, anchor="end"))
    return out, top_px + height


def draw_feed(columns, top_px):
    """Panel 2: feed over time, and under it the limit that holds."""
    time, feed, limits = columns["time_s"], columns["path.feed_mm_min"], limit_names(columns)
    programmed = columns.get("path.programmed_feed_mm_min")
    highest = max(feed + (programmed or []))
    label = "Feed in mm/min (dashed: programmed), and the limit that holds"
    panel = Panel(top_px, 130, (time[0], time[-1]), (0.0, highest * 1.08), label, "")
    out = panel.frame()
    if programmed:
        points = [(panel.x(t), panel.y(f)) for t, f in zip(time, programmed)]
        out.append(f'<path d="{line_data(points)}" stroke="#8c959f" stroke-dasharray="5 4" fill="none"/>')
    points = [(panel.x(t), panel.y(f)) for t, f in zip(time, feed)]
    out.append(f'<path d="{line_data(points)}" stroke="{INK}" stroke-width="1.6" fill="none"/>')

    strip = top_px + panel.height + 24
    shares = limit_shares(time, limits)
    colours = {name: LIMIT_COLOURS[min(i, len(LIMIT_COLOURS) - 1)] for i, (name, _) in enumerate(shares)}
    # One path a limit: a block from each tick at which it begins to hold to the one at which it ends.
    for name, _ in shares:
        blocks = [(time[a - 1 if a else 0], time[b]) for which, a, b in runs_of(limits) if which == name]
        data = "".join(f"M{panel.x(a):.1f} {strip}H{panel.x(b):.1f}v14H{panel.x(a):.1f}z" for a, b in blocks if b > a)
        out.append(f'<path d="{data}" fill="{colours[name]}"/>')
    at, line = LEFT_PX, strip + 32
    for name, share in shares:
        entry = f"{name} {100 * share:.0f} %"
        wide = 22 + 7.0 * len(entry)
        if at + wide > LEFT_PX + PLOT_WIDTH_PX:
            at, line = LEFT_PX, line + 18
        out.append(f'<rect x="{at:.1f}" y="{line - 10}" width="11" height="11" fill="{colours[name]}"/>')
        out.append(text(at + 16, line, entry))
        at += wide
    return out, line


def limit_shares(time, limits):
    """Limits by their share of the time, largest first; a tick counts to the limit that holds at its end."""
    total = {}
    for i in range(1, len(time)):
        total[limits[i]] = total.get(limits[i], 0.0) + time[i] - time[i - 1]
    whole = sum(total.values()) or 1.0
    return sorted(((name, part / whole) for name, part in total.items()), key=lambda entry: (-entry[1], entry[0]))


def draw_errors(columns, top_px, note):
    """Panel 3: following error of the axes that move."""
    time = columns["time_s"]
    errors = {
        name.split(".")[0]: [1000.0 * value for value in values]
        for name, values in columns.items()
        if name.endswith(".following_error_mm") and values and max(values) - min(values) > 1e-9
    }
    if not errors:
        return [], top_px - 40
    bound = 1.08 * max(abs(value) for values in errors.values() for value in values)
    label = "Following error in µm" + (f" ({note})" if note else "")
    panel = Panel(top_px, 120, (time[0], time[-1]), (-bound, bound), label, "time in s")
    out = panel.frame()
    right = LEFT_PX + PLOT_WIDTH_PX
    for i, (axis, values) in enumerate(errors.items()):
        colour = AXIS_COLOURS[i % len(AXIS_COLOURS)]
        points = [(panel.x(t), panel.y(v)) for t, v in zip(time, values)]
        out.append(f'<path d="{line_data(points)}" stroke="{colour}" stroke-width="1.4" fill="none"/>')
        at = right - 34 * (len(errors) - i)
        out.append(f'<path d="M{at} {top_px - 12}h14" stroke="{colour}" stroke-width="3"/>')
        out.append(text(at + 18, top_px - 8, axis))
    return out, top_px + panel.height + 32


def draw(columns, title, note):
    """The whole picture as text of an SVG. It brings its own paper: a page may be light or dark."""
    body = [text(LEFT_PX, 34, title, weight="600")]
    part, bottom = draw_path(columns, 78)
    body += part
    part, bottom = draw_feed(columns, bottom + 78)
    body += part
    part, bottom = draw_errors(columns, bottom + 46, note)
    body += part
    height = round(bottom + 14)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH_PX} {height}" width="{WIDTH_PX}" height="{height}" '
        f'font-family="-apple-system, Segoe UI, Helvetica, Arial, sans-serif" font-size="13" fill="{INK}">'
    )
    paper = f'<rect x="0.5" y="0.5" width="{WIDTH_PX - 1}" height="{height - 1}" rx="8" fill="{PAPER}" stroke="{FAINT}"/>'
    return "\n".join([head, f"<title>{escape(title)}</title>", paper, *body, "</svg>"]) + "\n"


# --- self-test -----------------------------------------------------------------------------------------------------------


def made_up_rows(count):
    """A motion along the README's curve with dips in the feed: it looks like a run, and none of its figures is one."""
    rows, time_s, u = [], 0.0, 0.0
    for k in range(count):
        feed = 3000.0 * (0.25 + 0.75 * abs(math.sin(9.0 * u))) if 0 < k < count - 1 else 0.0
        limit = ("", "feed") if feed > 2900 else ("X", "jerk") if math.cos(9.0 * u) > 0 else ("Y", "acceleration")
        rows.append(
            {
                "time_s": repr(time_s),
                "X.position_setpoint_mm": repr(100.0 * u),
                "X.following_error_mm": repr(1e-3 * math.sin(40.0 * u)),
                "Y.position_setpoint_mm": repr(100.0 * (3 * u**3 - 4 * u**2 + u)),
                "Y.following_error_mm": repr(-2e-3 * math.cos(30.0 * u)),
                "Z.position_setpoint_mm": "0",
                "Z.following_error_mm": "0",
                "path.feed_mm_min": repr(feed) if k else "",
                "path.programmed_feed_mm_min": "3000",
                "path.limit_axis": limit[0] if k else "",
                "path.limit_kind": limit[1] if k else "",
                "path.program": "spline.mpf",
            }
        )
        time_s, u = time_s + 0.001, (k + 1) / (count - 1)
    return rows


def write_rows(path, rows):
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def check_picture(svg):
    """What must hold of any picture, seen from outside."""
    root = ElementTree.fromstring(svg)
    _, _, width, height = (float(value) for value in root.get("viewBox").split())
    assert len(svg) < 120_000, f"{len(svg)} bytes are too many to be read in a diff"
    space = "{http://www.w3.org/2000/svg}"
    for path in root.iter(space + "path"):
        data = path.get("d")
        assert "nan" not in data and "inf" not in data, data[:80]
        if "L" in data:
            for point in data[1:].split("L"):
                x, y = (float(value) for value in point.split())
                assert 0 <= x <= width and 0 <= y <= height, f"({x}, {y}) lies outside the picture"
    return root


def self_test():
    with tempfile.TemporaryDirectory() as name:
        table = pathlib.Path(name) / "run.csv"
        write_rows(table, made_up_rows(4000))
        columns = read_columns(table)
        svg = draw(columns, "a & b < c", "representative drive")
        check_picture(svg)
        assert svg == draw(read_columns(table), "a & b < c", "representative drive"), "equal input, other bytes"
        shares = limit_shares(columns["time_s"], limit_names(columns))
        assert {name for name, _ in shares} == {"feed", "X.jerk", "Y.acceleration"}, shares
        assert abs(sum(share for _, share in shares) - 1.0) < 1e-9
        assert "representative drive" in svg and "X.jerk" in svg
        # A line keeps its ends, and no point of the original is further away than allowed.
        wave = [(i / 10, 20 * math.sin(i / 50)) for i in range(2000)]
        thin = thinned(wave, 0.2)
        assert thin[0] == wave[0] and thin[-1] == wave[-1] and len(thin) < 200
        # Standing still, two rows, a straight line: no range is empty.
        for count, stop in ((2, False), (50, True)):
            rows = made_up_rows(count)
            for row in rows if stop else []:
                row.update({key: "1" for key in row if key.endswith("_mm") or key == "path.feed_mm_min"})
            write_rows(table, rows)
            check_picture(draw(read_columns(table), "t", ""))
        for rows in (made_up_rows(2)[:1], [{"time_s": "0", "a": "1"}, {"time_s": "1", "a": "1"}]):
            write_rows(table, rows)
            try:
                read_columns(table)
            except Fault:
                continue
            raise AssertionError("a table that cannot be drawn was not refused")
    print("readme_picture: self-test passed")


# --- command -------------------------------------------------------------------------------------------------------------


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--csv", type=pathlib.Path, help="an export to draw, instead of running the program")
    parser.add_argument("-o", "--output", type=pathlib.Path, help=f"the picture (default: {PICTURE})")
    parser.add_argument("--title", help="first line of the picture")
    parser.add_argument("--self-test", action="store_true", help="draw made-up motions and look at the result")
    arguments = parser.parse_args()
    if arguments.self_test:
        self_test()
        return
    with tempfile.TemporaryDirectory() as name:
        title, note, table = arguments.title or "", "", arguments.csv
        if table is None:
            table, figures = run_and_export(pathlib.Path(name))
            title = title or f"{figures['program']} on {figures['machine']}: {figures['cycle_time_s']:.3f} s"
            values = [line.split("#")[0].split("=") for line in (ROOT / MACHINE).read_text(encoding="utf-8").splitlines()]
            measured = [value[1].strip() for value in values if len(value) == 2 and value[0].strip() == "identified"]
            note = "representative drive" if "false" in measured else ""
        svg = draw(read_columns(table), title, note)
    check_picture(svg)
    output = arguments.output or ROOT / PICTURE
    with open(output, "w", encoding="utf-8", newline="\n") as file:
        file.write(svg)
    print(f"{output}: {len(svg)} bytes")


if __name__ == "__main__":
    try:
        main()
    except Fault as fault:
        sys.exit(f"readme_picture: {fault}")
