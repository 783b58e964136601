#!/usr/bin/env python3
"""Makes a recording with the built command and reads it with readers that are not ours: Python and Node.

In: the binary of sollwert, or a recording and its export. Out: what does not hold, one line each; exit status 1 if anything does
not. Run it with the Python that has tests/readers/requirements.txt; `npm install` must have run in tests/readers.
Usage: check.py BINARY      |      check.py --files RECORDING.mcap EXPORT.csv
"""
import csv
import json
import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.realpath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
faults = []


def hold(condition, text):
    if not condition:
        faults.append(text)


def read(*command):
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        sys.exit(f"{' '.join(command)} failed:\n{result.stdout}{result.stderr}")
    return result.stdout


def ends_of_table(path):
    """First and last row of a CSV file, and the number of rows."""
    with open(path, newline="", encoding="utf-8") as stream:
        rows = csv.DictReader(stream)
        first = last = next(rows)
        count = 1
        for last in rows:
            count += 1
    return first, last, count


def same(cell, value):
    """A cell of the table and a decoded value: equal to the last bit."""
    if isinstance(value, str):
        return cell == value
    return cell is not None and cell != "" and float(cell) == float(value)


def compare_with_table(document, table):
    first, last, rows = ends_of_table(table)
    topics = document["topics"]
    columns = {name: name.removeprefix("/axis/") for name in topics if name.startswith("/axis/")}
    longest = max((topics[name]["messages"] for name in columns), default=topics["/path"]["messages"])
    hold(rows == longest, f"the table has {rows} rows, the fastest topic {longest} messages")
    columns["/path"] = "path"
    for topic, prefix in columns.items():
        for end, row in (("first", first), ("last", last)):
            fields = topics[topic][end]["fields"]
            hold(fields, f"{topic}: the {end} message is empty")
            for name, value in fields.items():
                cell = row.get(f"{prefix}.{name}")
                hold(same(cell, value), f"{topic} {end} {name}: {value!r} in the recording, {cell!r} in the table")
    ends = [topics[topic]["last"]["log_time_ns"] / 1e9 for topic in columns if topic != "/path"]
    hold(not ends or float(last["time_s"]) == max(ends), "the last row has the time of the last message")


def check(recording, table):
    python = json.loads(read(sys.executable, os.path.join(HERE, "read_python.py"), recording))
    node = json.loads(read("node", os.path.join(HERE, "read_node.mjs"), recording))
    hold(python == node, f"Python and Node read different things:\n{json.dumps(python, sort_keys=True)}\n{json.dumps(node, sort_keys=True)}")
    for topic, found in python["topics"].items():
        hold(python["counts"][topic] == found["messages"], f"{topic}: the index counts other messages than there are")
        hold(found["first"]["sequence"] == 0 and found["last"]["sequence"] == found["messages"] - 1, f"{topic}: sequence")
    inputs = python["metadata"].get("inputs", {})
    for attachment in python["attachments"]:
        hold(inputs.get(attachment["name"]) == attachment["sha256"], f"sha256 of {attachment['name']}")
    hold(python["attachments"], "there are attachments")
    hold(python["metadata"].get("sollwert", {}).get("format") == "1", "metadata: format")
    compare_with_table(python, table)
    return python


def run_binary(binary):
    with tempfile.TemporaryDirectory() as folder:
        recording, table = os.path.join(folder, "spline.mcap"), os.path.join(folder, "spline.csv")
        program = os.path.join(ROOT, "programs", "spline.mpf")
        machine = os.path.join(ROOT, "machines", "spinner_mvc850.toml")
        figures = json.loads(read(binary, "run", program, "-m", machine, "-o", recording, "--json"))
        read(binary, "export", recording, "-o", table)
        document = check(recording, table)
        for topic in ("/axis/X", "/axis/Y", "/path", "/event", "/programmed", "/tool/setpoint", "/tool/actual"):
            hold(topic in document["topics"], f"topic {topic}")
        summary = document["metadata"].get("summary", {})
        cycle_time = json.loads(summary.get("cycle_time_s", "null"))
        hold(cycle_time == figures["cycle_time_s"], f"cycle time {cycle_time} in the recording, {figures['cycle_time_s']} in --json")
        hold("recording" not in summary and folder not in json.dumps(document), "no path in the recording")


def main(arguments):
    if len(arguments) == 3 and arguments[0] == "--files":
        check(arguments[1], arguments[2])
    elif len(arguments) == 1 and not arguments[0].startswith("-"):
        run_binary(os.path.realpath(arguments[0]))
    else:
        sys.exit(__doc__)
    for fault in faults:
        print(f"does not hold: {fault}")
    print(f"independent readers: {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
