"""scripts/live without a screen: a run that it starts, one on two ranks that it attaches to, pause and the next frame, the picture; an instrument that keys and mouse press into tissue.
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

from output_common import MPI, OUT, SUPPLE, command, run, scenario

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


def load_module():
    loader = importlib.machinery.SourceFileLoader("live", LIVE)
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("live", loader))
    loader.exec_module(module)
    return module


def check_move():
    """The arrow key presses the instrument into the tissue, the mouse takes it away again: the force in the history, the obstacle in the picture, the places in both."""
    module = load_module()
    more = ("-effect_tool_displacement", "live", "-body_tissue_mesh", "box:0.1,0.06,0.04:3", "-ts_dt", "0.05", "-ts_max_time", "1000", "-output_every", "0", "-live_pace", "0", "-quiet")
    process = subprocess.Popen([*MPI, "2", SUPPLE, str(Path("scenarios/indent.opts").resolve()), "-output_dir", str(OUT / "moved"), *more], start_new_session=True)
    try:
        wait((OUT / "moved" / "run.json").exists, "the run does not begin")
        window = module.Window(OUT / "moved", process, argparse.Namespace(field="von_mises", plot="tool_force_z", picture=None, move="tool"))
        window.window.SetOffScreenRendering(1)

        def force():
            return (window.run.history["tool_force_z"].tolist() or [0.0])[-1]

        wait(window.update, "no frame comes")
        window.picture(OUT / "before.png")
        window.renderer.GetActiveCamera().SetViewUp(0, 0, 1)
        for _ in range(3):
            window.key("Down")
        def depth():
            tool = window.obstacles[0][0]
            return (tool.x - tool.positions(window.run.times[window.shown])).mean(axis=0)[2]

        wait(lambda: window.update() and force() < -0.05 and depth() > 1e-3, "nothing is pressed")
        window.picture(OUT / "pressed.png")
        check(window.place[2] < -5e-3, f"the tool is wanted at {window.place}")
        parts = [numpy.asarray(Image.open(OUT / name).convert("RGB")).astype(int)[:, 330:] for name in ("before.png", "pressed.png")]
        check((numpy.abs(parts[0] - parts[1]).max(axis=2) > 30).mean() > 0.01, "the picture is the same")
        window.drag((500, 300))
        window.drag((500, 600))
        window.drag(None)
        check(window.place[2] > 0.02, f"the mouse has moved the tool to {window.place}")
        wait(lambda: window.update() and force() == 0, "the tool is not taken away")
    finally:
        module.send(process, module.signal.SIGKILL)
        process.wait()


def check_keys():
    """A long run on two ranks is paused: no more frames come; the next one can be looked at; then it goes on."""
    module = load_module()
    process = subprocess.Popen(command(2, "long", "-quiet", "-ts_max_time", "1000"), start_new_session=True)
    try:
        wait((OUT / "long" / "run.json").exists, "the run does not begin")
        window = module.Window(OUT / "long", process, argparse.Namespace(field="von_mises", plot="strain", picture=None, move=None))
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
    check_move()


if __name__ == "__main__":
    main()
