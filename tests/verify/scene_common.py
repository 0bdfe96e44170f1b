"""What scripts share that run small scenes given as one text of options, and read their histories."""
import csv
import subprocess
import sys

import numpy

from output_common import MPI, OUT, SUPPLE


def start(folder, options, ranks=1, code=0):
    """Runs the scene into OUT/folder, and returns all that it prints; another exit code than expected ends the script."""
    command = [*MPI, str(ranks), SUPPLE, *options.split(), "-output_dir", str(OUT / folder)]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode != code:
        sys.exit(f"{folder}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    return result.stdout + result.stderr


def history(folder):
    """The columns of its history by name."""
    with open(OUT / folder / "history.csv", newline="") as f:
        names, _, *rows = csv.reader(f)
    return {name: numpy.array([float(row[k]) for row in rows]) for k, name in enumerate(names)}


count = 0


def check(good, text):
    """Counts a check, and ends the script with the text where it fails."""
    global count
    count += 1
    if not good:
        sys.exit(text)


def near(value, expected, tolerance, what):
    """The same for a number that is to be expected within an absolute tolerance."""
    print(f"{what}: {value:.9g}, expected {expected:.9g}")
    check(abs(value - expected) <= tolerance, f"{what} is {value:.12g}, expected {expected:.12g} within {tolerance:g}")


def finish():
    """The last line of a script."""
    print(f"{count} passed, 0 failed")
