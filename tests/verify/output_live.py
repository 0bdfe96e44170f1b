"""scripts/live without a screen: a run that it starts, one on two ranks that it attaches to, pause and the next frame, the picture.

"""
import argparse
import importlib.machinery
import importlib.util
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy
from PIL import Image

from output_common import OUT, command, run, scenario

LIVE = str(Path("scripts/live").resolve())


def check(condition, text):
    if not condition:
        sys.exit(text)


def live(*args, fails=False):
    done = subprocess.run([sys.executable, LIVE, *map(str, args)], capture_output=True, text=True)
    check((done.returncode != 0) == fails and "Traceback" not in done.stderr, f"live {args}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    check("ERR|" not in done.stderr, done.stderr)
    return done.stdout + done.stderr


def coloured(path):
    """The part of the picture's right that is coloured as bodies are, the scale included."""
    pixels = numpy.asarray(Image.open(path).convert("RGB")).astype(int)[:, 330:]
    return (pixels.max(axis=2) - pixels.min(axis=2) > 40).mean()


def wait(condition, text):
    end = time.monotonic() + 240
    while not condition():
        check(time.monotonic() < end, text)
        time.sleep(0.05)


def check_keys():
    """A long run on two ranks is paused: no more frames come; the next one can be looked at; then it goes on."""
    loader = importlib.machinery.SourceFileLoader("live", LIVE)
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("live", loader))
    loader.exec_module(module)
    process = subprocess.Popen(command(2, "long", "-quiet", "-ts_max_time", "1000"), start_new_session=True)
    try:
        wait((OUT / "long" / "run.json").exists, "the run does not begin")
        window = module.Window(OUT / "long", process, argparse.Namespace(field="von_mises", plot="strain", picture=None))
        window.window.SetOffScreenRendering(1)
        wait(window.update, "no frame comes")
        wait(lambda: window.update() and window.shown > 3, "frames do not follow each other")
        window.key("space")
        time.sleep(1)  # what was being written
        window.refresh()
        count = len(window.run)
        time.sleep(2)
        shown = window.shown
        check(window.refresh() and len(window.run) == count and not window.update(), "the run goes on although it is paused")
        if shown + 1 < count:
            window.key("n")
            check(window.shown == shown + 1, f"the next frame is {window.shown}, not {shown + 1}")
        window.key("f")
        check(window.options.field != "von_mises", "the next field")
        window.picture(OUT / "long.png")
        check(coloured(OUT / "long.png") > 0.02, "nothing is drawn")
        window.key("space")
        wait(lambda: window.update() and window.shown > count, "the run does not go on")
    finally:
        module.send(process, module.signal.SIGKILL)
        process.wait()


def main():
    told = live("--plot", "max_displacement", "--picture", OUT / "started.png", "--ranks", "2", scenario(), "-output_dir", OUT / "started", "-ts_max_time", "0.3")
    check("of 31 frames" in told and not told.split(": ")[1].startswith("0 ") and coloured(OUT / "started.png") > 0.05, f"{told}{coloured(OUT / 'started.png'):.1%} of the picture is coloured")
    # the diagram is at the left
    dark = (numpy.asarray(Image.open(OUT / "started.png").convert("L"))[330:590, 10:320] < 90).mean()
    check(0.005 < dark < 0.2, f"{dark:.1%} of the diagram is dark")
    run(2, "done", "-quiet", "-ts_max_time", "0.05")
    check("1 of 6 frames" in live(OUT / "done", "--picture", OUT / "done.png"), "a run that has ended")
    check("no column 'strian'" in live(OUT / "done", "--plot", "strian", "--picture", OUT / "no.png", fails=True), "unknown column")
    check("neither a scenario" in live(OUT / "nothing.opts", fails=True), "neither scenario nor folder")
    check_keys()


if __name__ == "__main__":
    main()
