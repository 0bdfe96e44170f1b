"""A run that is killed at any moment, in the middle of a frame or of a checkpoint, leaves what it had completed.

A dozen runs are killed (SIGKILL, all ranks at once or one of them) after random times. Each time fields.xmf must be
well-formed and every frame in it readable, history.csv must hold whole rows, and the newest checkpoint must restart.
"""
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

from output_common import OUT, check_frames, command, history, run

KILLS = 12


def ranks_of(launcher):
    """Processes of the program below the launcher, or the launcher itself when it is the program."""
    parents, names = {}, {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            before, after = stat.read_text().rsplit(")", 1)
        except OSError:
            continue  # it has ended
        pid, name = before.split(" (", 1)
        parents[int(pid)], names[int(pid)] = int(after.split()[1]), name

    def below(pid):
        return pid == launcher or (pid in parents and below(parents[pid]))

    return [pid for pid in parents if names[pid] == "supple" and below(pid)]


def kill_at_random(ranks, folder, chance):
    """Starts a long run, waits until it writes frames, kills after a random time."""
    args = command(ranks, folder, "-ts_max_time", "100", "-checkpoint_every_steps", "3", "-quiet")
    process = subprocess.Popen(args, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while not (OUT / folder / "fields.xmf").exists() and process.poll() is None:
        time.sleep(0.01)
    time.sleep(chance.uniform(0.0, 0.4))
    victims = ranks_of(process.pid)
    if len(victims) != ranks:
        process.kill()
        sys.exit(f"{folder}: the run ended before it was killed, with code {process.poll()}")
    if chance.random() < 0.5:
        victims = [chance.choice(victims)]  # the launcher ends the others
    for pid in victims:
        os.kill(pid, signal.SIGKILL)
    process.wait()  # an end that does not come is found by tests/run


def main():
    chance = random.Random(1)
    frames = 0
    for k in range(KILLS):
        folder = f"kill{k}"
        kill_at_random(1 + k % 2, folder, chance)
        n = check_frames(folder)
        frames += n
        names, rows = history(folder)
        # A frame is written before the row of its step.
        if len(rows) < n - 1 or any(len(row) != len(names) for row in rows):
            sys.exit(f"{folder}: {len(rows)} rows in history.csv, {n} frames")
        if any((OUT / folder).glob("checkpoint_*.h5")):
            step = int(sorted((OUT / folder).glob("checkpoint_*.h5"))[-1].stem[-6:])
            run(2 - k % 2, folder, "-restart", "latest", "-ts_max_time", f"{(step + 4) * 0.01:g}")
            after = check_frames(folder)
            steps = history(folder)[1][:, 0]
            if after != step + 5 or list(steps) != list(range(step + 5)):
                sys.exit(f"{folder}: restart at {step} left {after} frames, rows {steps[:3]} to {steps[-3:]}")
    print(f"{KILLS} kills, {frames} completed frames, all readable")


if __name__ == "__main__":
    main()
