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


def check(good, text):
    if not good:
        sys.exit(text)
