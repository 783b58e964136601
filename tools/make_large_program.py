#!/usr/bin/env python3
"""Writes a program of many plain blocks: for measuring speed and memory.

Usage: tools/make_large_program.py BLOCKS FILE [--memory]

The path is a spiral of short segments, as CAM writes them: `N10 X1.234 Y5.678 Z-0.12`. With --memory the program is handed to
`sollwert moves` and `sollwert time` afterwards (the one in target/release), and the largest resident memory of each is printed.
"""
import math
import os
import subprocess
import sys
import time


def write(blocks, name):
    """Streams the program; the file of ten million blocks has about 350 MB."""
    with open(name, "w", encoding="ascii") as out:
        out.write("N1 G17 G71 G90 G94 G642 CTOL=0.05 SOFT\nN2 G0 X0 Y0 Z100\nN3 G1 F3000\n")
        lines = []
        for i in range(blocks):
            angle = i * 0.02
            radius = 20 + 15 * math.sin(i * 1e-4)
            x, y, z = radius * math.cos(angle), radius * math.sin(angle), 100 + 5 * math.sin(i * 1e-5)
            lines.append(f"N{(i % 99999 + 1) * 10} X{x:.3f} Y{y:.3f} Z{z:.3f}\n")
            if len(lines) == 10000:
                out.writelines(lines)
                lines.clear()
        out.writelines(lines)
        out.write("M30\n")


def measured(arguments):
    """Wall time in seconds and largest resident memory in MB of one command."""
    started = time.monotonic()
    process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    return time.monotonic() - started, usage.ru_maxrss / 1024, status


def main():
    if len(sys.argv) < 3 or not sys.argv[1].isdigit():
        sys.exit(__doc__)
    blocks, name = int(sys.argv[1]), sys.argv[2]
    write(blocks, name)
    if "--memory" not in sys.argv[3:]:
        return
    command = os.path.join(os.path.dirname(__file__), "..", "target", "release", "sollwert")
    for sub_command in ("moves", "time"):
        seconds, megabytes, status = measured([command, sub_command, name, "-m", "spinner_mvc850"])
        rate = blocks / seconds
        print(f"{sub_command}: {seconds:.1f} s, {rate:.0f} blocks/s, {megabytes:.0f} MB resident, status {status}")


if __name__ == "__main__":
    main()
