"""supple -show: where bodies, sets, effects and obstacles are before a run, the same on 1 and 3 ranks, with one frame and no step; and its picture.

Values of scenarios against what their options say; results of an earlier run stay.
"""
import json
import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy

from output_common import MPI, OUT, SUPPLE
from scene_common import check, finish, near, start

ROOT = Path(__file__).resolve().parent.parent.parent
NUMBER = r"(-?[\d.e+-]+)"


def show(name, ranks=1, *more):
    """The table without what differs between ranks: the solver's part of the header is left out by -quiet."""
    result = subprocess.run([*MPI, str(ranks), SUPPLE, str(ROOT / "scenarios" / f"{name}.opts"), "-show", "-quiet", "-output_dir", str(OUT / name), *more],
                            capture_output=True, text=True, cwd=ROOT)
    check(result.returncode == 0, f"{name} on {ranks} ranks: exit code {result.returncode}: {result.stdout}{result.stderr}")
    return result.stdout


def line(table, title, name):
    """The line of a name in the part of a table."""
    part = f"\n{table}".partition(f"\n\n{title}")[2].partition("\n\n")[0]
    found = [text for text in part.splitlines() if text.startswith(f"  {name} ")]
    check(len(found) == 1, f"{name}: {len(found)} lines below {title} in: {table}")
    return found[0]


def box(text):
    return numpy.array([float(x) for x in re.search(rf"\({NUMBER}, {NUMBER}, {NUMBER}\) to \({NUMBER}, {NUMBER}, {NUMBER}\)", text).groups()])


tables = {}
for name in ("indent", "two_bodies", "drop", "pile", "finger"):
    tables[name] = show(name)
    check(show(name, 3) == tables[name], f"{name}: another table on 3 ranks")
    folder = OUT / f"{name}_show"
    check(f"scripts/render {folder} --show" in tables[name], f"{name}: no command for a picture")
    about = json.loads((folder / "run.json").read_text())
    check(about["status"] == "shown", f"{name}: status {about['status']}")
    check(not (folder / "history.csv").exists() and not list(folder.glob("checkpoint*")) and not list(folder.glob("before*")), f"{name}: more than a frame")
    with h5py.File(folder / "fields.h5") as file:
        frames = [frame for hundred in file["step"].values() for frame in hundred]
        check(frames == ["000000"], f"{name}: frames {frames}")

# boxes, sets and effects as the options say
near(abs(box(line(tables["two_bodies"], "bodies", "stiff")) - [0.2, 0, 0, 0.3, 0.1, 0.3]).max(), 0, 1e-12, "two_bodies: a body that is moved, m")
text = line(tables["two_bodies"], "sets", "zmax")
check("32 vertices, 36 facets, 0 tets" in text, text)
near(abs(box(text) - [0, 0, 0.3, 0.3, 0.1, 0.3]).max(), 0, 1e-12, "two_bodies: a set of two bodies, m")
check("vector 0,0,-9.81" in line(tables["two_bodies"], "effects", "gravity"), "an option that was given")
check("fixed on zmax" in line(tables["two_bodies"], "effects", "ceiling"), "where an effect acts")
check("obstacles" not in tables["two_bodies"], "obstacles of a scene without any")
check("tension 1.5*ramp(2*t)" in line(tables["finger"], "effects", "pull"), "a formula that was given")
check("displacement 0.02*ramp(t/0.3-1);0;-0.008*ramp(t/0.3), friction 0.2" in line(tables["indent"], "effects", "tool"), "several options that were given")

# distances: of a turned cube from the plane z = 0 its lowest vertex; of the nearest vertex of a block from a capsule
low = box(line(tables["drop"], "bodies", "block"))[2]
near(float(re.search(rf"block is {NUMBER} m away", line(tables["drop"], "obstacles", "floor"))[1]), low, 1e-5, "drop: distance from the floor, m")
with h5py.File(OUT / "indent_show" / "fields.h5") as file:
    x = file["mesh/x"][()]
    top = file["mesh/set_zmax"][()].astype(bool)
check(numpy.allclose(x[top][:, 2], 0.04) and top.sum() == 273, "the set in the frame")
distance = numpy.linalg.norm(x - [0.04, 0.031, 0.055], axis=1).min() - 0.015
near(float(re.search(rf"tissue is {NUMBER} m away", line(tables["indent"], "obstacles", "tool"))[1]), distance, 1e-3 * distance, "indent: distance from the tool, m")
inside = show("indent", 1, "-effect_tool_obstacle", "capsule:0.04,0.03,0.05,0.04,0.03,0.1,0.015")
check("tissue is 0.005 m inside" in line(inside, "obstacles", "tool"), f"depth: {inside}")

# bodies that are moved at the start, copies in one line, a name that another one begins with
start("moved", "-bodies a,ball -body_a_mesh box:1,1,1:1 -body_a_displacement 0.5*x;0;0 -body_ball_mesh box:1,1,1:1 -body_ball_copies grid:3,2,1,2,3,1 -body_ball_translate 5,0,0 -body_a_material linear "
      "-body_ball_material linear -body_a_young 1 -body_ball_young 1 -body_a_poisson 0 -body_ball_poisson 0 -effects g,g_x -effect_g_type gravity -effect_g_vector 0,0,-1 -effect_g_x_type gravity "
      "-effect_g_x_vector 1,0,0 -time newmark -ts_dt 0.1 -ts_max_time 0.1 -body_a_density 1 -body_ball_density 1")
results = (OUT / "moved" / "history.csv").read_bytes()
table = start("moved", f"{OUT}/moved/scenario.opts -show", 2)
near(abs(box(line(table, "bodies", "a")) - [0, 0, 0, 1.5, 1, 1]).max(), 0, 1e-12, "a body that begins stretched, m")
near(abs(box(line(table, "bodies", "6 x ball")) - [5, 0, 0, 10, 4, 1]).max(), 0, 1e-12, "copies, m")
check("vector 0,0,-1" in line(table, "effects", "g") and "x_" not in line(table, "effects", "g").replace("g_x", ""), "options of another effect")
check((OUT / "moved" / "history.csv").read_bytes() == results and not list((OUT / "moved").glob("before*")), "results of an earlier run are gone")
text = start("moved", f"{OUT}/moved/scenario.opts -show -restart latest", 1, code=1)
check("-show" in text and "-restart latest" in text, text)

# the picture
for name in ("indent", "pile"):
    result = subprocess.run([sys.executable, str(ROOT / "scripts" / "render"), str(OUT / f"{name}_show"), "--show", "--size", "600x400"], capture_output=True, text=True, cwd=ROOT)
    check(result.returncode == 0, f"{name}: {result.stdout}{result.stderr}")
    check(("1 bodies, 2 sets, 1 obstacles" if name == "indent" else "5 bodies, 0 sets, 1 obstacles") in result.stdout, result.stdout)
    check((OUT / f"{name}_show" / "picture.png").read_bytes()[1:4] == b"PNG", f"{name}: no picture")
finish()
