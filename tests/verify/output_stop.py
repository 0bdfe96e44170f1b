"""A run that is asked to stop ends its step, writes a checkpoint, says so, and goes on from there.

SIGTERM on one rank of two, SIGUSR1 on the launcher, SIGINT on a run alone, and -wall_time: each ends with code 75, run.json says "stopped" and how
to go on, and with -restart the last row of history.csv is that of a run that nobody stopped. A step that takes longer than
-stop_grace is given up. A second SIGINT ends at once.
A step that takes long says how far it is.
"""
import json
import os
import re
import signal
import subprocess
import sys
import time

import numpy

from output_common import OUT, command, history, run
from output_kill import ranks_of

STOPPED = 75
# Slow enough to be met on the way: nonlinear steps of some milliseconds, solved to rounding so that sums of ranks do not grow.
SLOW = ["-ts_max_time", "4", "-body_bar_material", "corotated", "-snes_rtol", "1e-12", "-output_fields", "none", "-quiet"]


# Each iteration of Newton's method takes a little off the residual only.
LONG_STEPS = ["-ksp_rtol", "0.9", "-snes_max_it", "100000", "-snes_rtol", "1e-12"]


def start(ranks, folder, *more, rows=10):
    """A run that has written so many rows. Ctrl-C reaches it also where this test runs in the background, which ignores it."""
    (OUT / folder).mkdir(parents=True, exist_ok=True)
    with open(OUT / folder / "output.txt", "w") as output, open(OUT / folder / "errors.txt", "w") as errors:
        process = subprocess.Popen(command(ranks, folder, *SLOW, *more), stdout=output, stderr=errors,
                                   preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
    path = OUT / folder / "history.csv"
    while (not path.exists() or path.read_text().count("\n") < rows + 2) and process.poll() is None:
        time.sleep(0.02)
    if process.poll() is not None:
        sys.exit(f"{folder}: ended before it was stopped, with code {process.poll()}: {(OUT / folder / 'errors.txt').read_text()}")
    return process


def check_stopped(folder, code, word):
    text = (OUT / folder / "errors.txt").read_text()
    if code != STOPPED:
        sys.exit(f"{folder}: exit code {code}, not {STOPPED}: {text}")
    told = json.loads((OUT / folder / "run.json").read_text())
    if told["status"] != "stopped" or word not in told["reason"] or told["go_on"] != "-restart latest":
        sys.exit(f"{folder}: run.json says {told['status']}, {told['reason']}")
    if f"supple: stopped: {word}" not in text:
        sys.exit(f"{folder}: no line says why it stopped: {text}")
    last = int(history(folder)[1][-1, 0])
    if not (OUT / folder / f"checkpoint_{last:06d}.h5").exists():
        sys.exit(f"{folder}: no checkpoint of step {last}")
    return last


def check_same(folder, ranks, step):
    """Five more steps: rows are those of the run that nobody stopped."""
    run(ranks, folder, *SLOW, "-restart", "auto", "-ts_max_time", 0.01 * (step + 5))
    (names, rows), (_, whole) = history(folder), history("whole")
    whole = whole[: step + 6]
    if not numpy.array_equal(rows[:, 0], whole[:, 0]):
        sys.exit(f"{folder}: steps {rows[:3, 0]} to {rows[-3:, 0]}")
    for name in ("strain", "total", "centre_z"):
        column = whole[:, names.index(name)]
        worst = numpy.abs(rows[:, names.index(name)] - column).max() / numpy.abs(column).max()
        if not worst < 1e-6:
            sys.exit(f"{folder}: {name} differs by {worst:.2g} from the run that was not stopped")


def check_lost():
    """Files that are deleted during the run are named once; the run goes on, and makes no empty ones in their place."""
    process = start(1, "lost", "-output_fields", "displacement")
    names = ("history.csv", "fields.h5")
    for name in names:
        (OUT / "lost" / name).unlink()
    while process.poll() is None and (OUT / "lost" / "errors.txt").read_text().count("was deleted") < 2:
        time.sleep(0.02)
    process.send_signal(signal.SIGTERM)
    code = process.wait()
    text = (OUT / "lost" / "errors.txt").read_text()
    if code != STOPPED or any(len(re.findall(rf"warning: \S+{name} was deleted", text)) != 1 for name in names):
        sys.exit(f"lost: exit code {code}: {text}")
    if any((OUT / "lost" / name).exists() for name in names):
        sys.exit("lost: a deleted file is there again")


def main():
    run(1, "whole", *SLOW, "-restart", "auto")  # nothing to go on from: from the beginning

    # a signal to one rank of two, to the launcher, to a run alone
    process = start(2, "term")
    os.kill(ranks_of(process.pid)[-1], signal.SIGTERM)
    steps = [check_stopped("term", process.wait(), "SIGTERM")]
    check_same("term", 2, steps[-1])
    # a closed terminal, which nohup ignores, also in what it starts: here it counts
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    process = start(1, "hup")
    process.send_signal(signal.SIGHUP)
    steps.append(check_stopped("hup", process.wait(), "SIGHUP"))
    check_lost()
    process = start(2, "usr1")
    process.send_signal(signal.SIGUSR1)
    steps.append(check_stopped("usr1", process.wait(), "SIGUSR1"))
    check_same("usr1", 1, steps[-1])
    process = start(1, "int")
    process.send_signal(signal.SIGINT)
    steps.append(check_stopped("int", process.wait(), "SIGINT"))

    # Ctrl-C on the launcher of two ranks, which hands SIGUSR1 on
    process = start(2, "launcher")
    process.send_signal(signal.SIGINT)
    steps.append(check_stopped("launcher", process.wait(), "SIGUSR1"))

    # the end of -wall_time
    process = start(1, "wall", "-wall_time", "0:00:06", "-ts_max_time", "1e6")
    begun = time.monotonic()
    steps.append(check_stopped("wall", process.wait(), "the end of -wall_time"))
    if time.monotonic() - begun > 6:
        sys.exit(f"-wall_time 0:00:06: it took {time.monotonic() - begun:.1f} s")
    text = run(1, "refused", *SLOW, "-wall_time", "90", fails=True)
    if "-wall_time 90" not in text:
        sys.exit(f"-wall_time 90 is not refused: {text}")

    # ... before there was a step: not what a job that is put back into the queue would mend
    text = run(1, "early", *SLOW, *LONG_STEPS, "-wall_time", "0:00:01", "-body_bar_mesh", "box:0.4,0.1,0.1:100,25,25", fails=True)
    if "-wall_time" not in text or json.loads((OUT / "early" / "run.json").read_text())["status"] != "failed":
        sys.exit(f"-wall_time that is over before the first step: {text}")

    # steps of dozens of iterations: one of them is given up, and the checkpoint is of the step before
    for k in range(8):
        process = start(2, f"grace{k}", *LONG_STEPS, "-stop_grace", "0", rows=2)
        os.kill(ranks_of(process.pid)[k % 2], signal.SIGTERM)
        step = check_stopped(f"grace{k}", process.wait(), "SIGTERM")
        if "given up" in json.loads((OUT / f"grace{k}" / "run.json").read_text())["reason"]:
            run(1, f"grace{k}", *SLOW, "-restart", "latest", "-ts_max_time", 0.01 * (step + 2))
            break
    else:
        sys.exit("no step was given up in eight runs")

    # a step that takes more than five seconds (most of them asleep) says how far it is, unless it slept in its last iteration
    for k in range(6):
        process = start(1, f"long{k}", *LONG_STEPS, "-quiet", "no", "-body_bar_mesh", "box:0.4,0.1,0.1:40,10,10", rows=1)
        process.send_signal(signal.SIGSTOP)
        time.sleep(6)
        process.send_signal(signal.SIGCONT)
        time.sleep(0.5)
        process.send_signal(signal.SIGTERM)
        process.wait()
        text = (OUT / f"long{k}" / "output.txt").read_text()
        if re.search(r"step \d+ has taken \d+ s: Newton iteration \d+(, linear iteration \d+)?, residual \S+ N, length 0.01 s", text):
            break
    else:
        sys.exit(f"no line within a long step in six runs: {text}")

    # a second Ctrl-C, of the program and of scripts/mpi
    for ranks in (1, 2):
        process = start(ranks, f"twice{ranks}", *LONG_STEPS, "-stop_grace", "1000", "-body_bar_mesh", "box:0.4,0.1,0.1:80,20,20", rows=1)
        process.send_signal(signal.SIGINT)
        time.sleep(1)
        process.send_signal(signal.SIGINT)
        if process.wait() != 128 + signal.SIGINT:
            sys.exit(f"a second SIGINT on {ranks} ranks: exit code {process.returncode}")
    print(f"stopped after steps {steps}, gone on from there")


if __name__ == "__main__":
    main()
