"""scripts/live without a screen: a run that it starts, one on two ranks that it attaches to, pause and the next frame, the picture; an instrument that keys and mouse press into tissue.
"""
import argparse
import importlib.machinery
import importlib.util
import json
import os
import shutil
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


def refused(*args):
    """The message of an error; in this process, as what is loaded takes seconds."""
    sys.argv = ["live", *map(str, args)]
    try:
        module.main()
    except module.RunError as error:
        return str(error)
    sys.exit(f"live {args} ends without an error")


def coloured(path):
    """The part of the picture's right that is coloured as bodies are, the scale included."""
    pixels = numpy.asarray(Image.open(path).convert("RGB")).astype(int)[:, 330:]
    return (pixels.max(axis=2) - pixels.min(axis=2) > 40).mean()


def wait(process, condition, text):
    """Until it is so; it never will be when the run, which has a last step, has ended. No clock: the machine may be busy."""
    while not condition():
        if process.poll() is not None:
            check(condition(), f"{text}, and the run has ended with {process.returncode}")
        time.sleep(0.02)


def watched(process, folder, **options):
    """A window without a screen on the run, with its first frame."""
    wait(process, (OUT / folder / "run.json").exists, "the run does not begin")
    window = module.Window(OUT / folder, process, argparse.Namespace(**{"field": "von_mises", "picture": None, "move": None, **options}))
    window.window.SetOffScreenRendering(1)
    wait(process, window.update, "no frame comes")
    return window


def states(process):
    """Of all processes of the run: R, S, T (stopped), ..."""
    found = set()
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            if os.getsid(int(pid)) == process.pid:
                found.add(Path("/proc", pid, "stat").read_text().rpartition(")")[2].split()[0])
        except OSError:  # it has ended meanwhile
            pass
    return found


def check_move():
    """The arrow key presses the instrument into the tissue, the mouse takes it away again: the force in the history, the obstacle in the picture, the places in both."""
    more = ("-effect_tool_displacement", "live", "-body_tissue_mesh", "box:0.1,0.06,0.04:3", "-ts_dt", "0.05", "-ts_max_time", "200", "-output_every", "0", "-live_pace", "0", "-quiet")
    process = subprocess.Popen([*MPI, "2", SUPPLE, str(Path("scenarios/indent.opts").resolve()), "-output_dir", str(OUT / "moved"), *more], start_new_session=True)
    try:
        window = watched(process, "moved", plot="tool_force_z", move="tool")

        def force():
            return (window.run.history["tool_force_z"].tolist() or [0.0])[-1]

        window.picture(OUT / "before.png")
        window.renderer.GetActiveCamera().SetViewUp(0, 0, 1)
        for _ in range(3):
            window.key("Down")

        def depth():
            tool = window.obstacles[0][0]
            return (tool.x - tool.positions(window.run.times[window.shown])).mean(axis=0)[2]

        wait(process, lambda: window.update() and force() < -0.05 and depth() > 1e-3, "nothing is pressed")
        window.picture(OUT / "pressed.png")
        check(window.place[2] < -5e-3, f"the tool is wanted at {window.place}")
        window.key("bracketright")  # the angle is not live
        told = (OUT / "moved" / "live.txt").read_text()
        check(told.startswith("tool ") and "angle" not in told, f"the run will warn of what live.txt has: {told}")
        parts = [numpy.asarray(Image.open(OUT / name).convert("RGB")).astype(int)[:, 330:] for name in ("before.png", "pressed.png")]
        check((numpy.abs(parts[0] - parts[1]).max(axis=2) > 30).mean() > 0.01, "the picture is the same")
        window.drag((500, 300))
        window.drag((500, 600))
        window.drag(None)
        check(window.place[2] > 0.02, f"the mouse has moved the tool to {window.place}")
        wait(process, lambda: window.update() and force() == 0, "the tool is not taken away")
    finally:
        module.send(process, module.signal.SIGKILL)
        process.wait()


def check_keys():
    """A long run on two ranks is paused: no more frames come; the next one can be looked at; then it goes on."""
    process = subprocess.Popen(command(2, "long", "-quiet", "-ts_max_time", "100"), start_new_session=True)
    try:
        window = watched(process, "long", plot="strain")
        mesh = window.run.mesh(-1)
        wait(process, lambda: window.update() and window.shown > 3, "frames do not follow each other")
        check(window.run.mesh(-1) is mesh, "the mesh is read again with each frame")
        window.key("space")
        wait(process, lambda: states(process) == {"T"}, "the run goes on although it is paused")
        wait(process, window.refresh, "what was written last cannot be read")
        count, shown = len(window.run), window.shown
        rows = [line.split(",") for line in (OUT / "long" / "history.csv").read_text().splitlines()]
        strain = numpy.array([float(row[rows[0].index("strain")]) for row in rows[2:] if len(row) == len(rows[0])])
        check(len(strain) > 3 and numpy.array_equal(window.run.history["strain"], strain), "the history is not that of the file")
        check(not window.update(), "a window that is paused shows another frame")
        if shown + 1 < count:
            window.key("n")
            check(window.shown == shown + 1, f"the next frame is {window.shown}, not {shown + 1}")
        window.key("f")
        check(window.options.field != "von_mises", "the next field")
        window.picture(OUT / "long.png")
        check(coloured(OUT / "long.png") > 0.02, "nothing is drawn")
        window.key("space")
        wait(process, lambda: window.update() and window.shown > count, "the run does not go on")
    finally:
        module.send(process, module.signal.SIGKILL)
        process.wait()


def check_window():
    """A window on a screen without a user: Ctrl-C ends it and the run that it started, which writes its checkpoint."""
    if not shutil.which("Xvfb"):
        print("no Xvfb, so no window was opened: apt-get install xvfb")
        return
    screen = subprocess.Popen(["Xvfb", "-displayfd", "1", "-screen", "0", "1000x700x24"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        environment = {name: value for name, value in os.environ.items() if not name.startswith("VTK_")} | {"DISPLAY": ":" + screen.stdout.readline().strip()}
        process = subprocess.Popen([sys.executable, LIVE, str(scenario()), "-output_dir", str(OUT / "window"), "-ts_max_time", "100"], env=environment,
                                   preexec_fn=lambda: module.signal.signal(module.signal.SIGINT, module.signal.default_int_handler))
        history = OUT / "window" / "history.csv"
        wait(process, lambda: history.exists() and history.read_text().count("\n") > 100, "the run does not begin")
        process.send_signal(module.signal.SIGINT)
        process.wait()
        told = json.loads((OUT / "window" / "run.json").read_text())
        check(told["status"] == "stopped", f"after Ctrl-C the run is {told['status']}")
    finally:
        screen.kill()
        screen.wait()


def load_module():
    sys.path.insert(0, str(Path(LIVE).parent))
    loader = importlib.machinery.SourceFileLoader("live", LIVE)
    found = importlib.util.module_from_spec(importlib.util.spec_from_loader("live", loader))
    loader.exec_module(found)
    return found


module = load_module()


def main():
    told = live("--plot", "max_displacement", "--picture", OUT / "started.png", "--ranks", "2", scenario(), "-output_dir", OUT / "started", "-ts_max_time", "0.3")
    check("of 31 frames" in told and not told.split(": ")[1].startswith("0 ") and coloured(OUT / "started.png") > 0.05, f"{told}{coloured(OUT / 'started.png'):.1%} of the picture is coloured")
    # the diagram is at the left
    dark = (numpy.asarray(Image.open(OUT / "started.png").convert("L"))[330:590, 10:320] < 90).mean()
    check(0.005 < dark < 0.2, f"{dark:.1%} of the diagram is dark")
    run(2, "done", "-quiet", "-ts_max_time", "0.05")
    window = module.Window(OUT / "done", None, argparse.Namespace(field="von_mises", plot="strain", picture=None, move=None))
    module.follow(window, OUT / "done.png")
    check(window.shown == 5 and coloured(OUT / "done.png") > 0.05, "a run that has ended")
    check("'strian'" in refused(OUT / "done", "--plot", "strian", "--picture", OUT / "no.png"), "unknown column")
    check("'strian'" in refused(scenario(), "-output_dir", OUT / "no", "--plot", "strian", "--picture", OUT / "no.png"), "unknown column of a run that is started")
    os.environ.pop("DISPLAY", None)
    check("--picture" in refused(scenario()), "no screen")
    process = subprocess.Popen(command(1, "ends", "-quiet", "-ts_max_time", "0.5"))
    window = module.Window(OUT / "ends", process, argparse.Namespace(field="von_mises", plot="strain", picture=None, move=None))
    module.follow(window, OUT / "ends.png")
    check("completed" in window.text.GetInput(), f"the last picture says {window.text.GetInput()}")
    check("nothing.opts" in live(OUT / "nothing.opts", fails=True), "neither scenario nor folder")
    check_window()
    check_keys()
    check_move()


if __name__ == "__main__":
    main()
