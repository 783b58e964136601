#!/usr/bin/env python3
"""Writes programs/spline.mpf: a curve as a CAM system would give it, chords of at most 0.5 mm error.

In: nothing. Out: the program. Standard library only. Run in the project's root; the result is committed.
"""

CHORD_ERROR_MM = 0.5
LENGTH_MM = 100.0


def point(u):
    """X = 100 u, Y = 100 (3 u^3 - 4 u^2 + u), 0 <= u <= 1."""
    return LENGTH_MM * u, LENGTH_MM * (3 * u**3 - 4 * u**2 + u)


def chord_error_mm(a, b):
    """Largest distance of the curve between the parameters a and b from its chord."""
    (xa, ya), (xb, yb) = point(a), point(b)
    length = ((xb - xa) ** 2 + (yb - ya) ** 2) ** 0.5
    samples = (point(a + (b - a) * k / 50) for k in range(1, 50))
    return max(abs((xb - xa) * (y - ya) - (yb - ya) * (x - xa)) / length for x, y in samples)


def next_parameter(u, error_mm):
    """The end of the longest chord from u whose error is at most error_mm."""
    if chord_error_mm(u, 1.0) <= error_mm:
        return 1.0
    low, high = u, 1.0
    for _ in range(30):
        middle = (low + high) / 2
        # The error grows with the chord until past the turning point; the first crossing is wanted.
        steps = (u + (middle - u) * k / 8 for k in range(1, 9))
        if all(chord_error_mm(u, step) <= error_mm for step in steps):
            low = middle
        else:
            high = middle
    return low


def chords(error_mm):
    parameters = [0.0]
    while parameters[-1] < 1.0:
        parameters.append(next_parameter(parameters[-1], error_mm))
    return parameters


def even_chords():
    """As few chords as CHORD_ERROR_MM allows, with the error as small as that number allows: no short rest at the end."""
    count = len(chords(CHORD_ERROR_MM * 0.999))
    low, high = 0.0, CHORD_ERROR_MM * 0.999
    for _ in range(16):
        middle = (low + high) / 2
        if len(chords(middle)) <= count:
            high = middle
        else:
            low = middle
    return chords(high)


def main():
    lines = [
        "; spline.mpf: the curve X = 100 u, Y = 100 (3 u^3 - 4 u^2 + u), 0 <= u <= 1,",
        "; as chords with an error of at most 0.5 mm. Written by tools/make_programs.py.",
        "N10 G17 G71 G90 G94 G642 CTOL=0.1 SOFT",
        "N20 G0 X0 Y0",
    ]
    for number, u in enumerate(even_chords()[1:]):
        x, y = point(u)
        head = "G1 " if number == 0 else ""
        tail = " F3000" if number == 0 else ""
        lines.append(f"N{30 + 10 * number} {head}X{x:.3f} Y{y:.3f}{tail}")
    lines.append(f"N{10 * len(lines) - 10} M30")
    with open("programs/spline.mpf", "w", newline="\n") as file:
        file.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
