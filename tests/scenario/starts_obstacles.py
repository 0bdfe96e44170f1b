"""Bodies that touch, overlap or lie inside an obstacle when a run begins; every obstacle and response, 1 and 3 ranks.

Static, held at the other side: pressed out of the obstacle without load, the work of contact is the strain energy in every row, and nothing is
lost; what begins w above the obstacle and is then pressed down as far has the same strain energy. Without a support: an error that names the body, or it is
where it was moved out to. Wholly inside an obstacle: an error that names effect, body and options, in dynamic runs, too; not if a part is outside."""
import csv
import os
import subprocess
import sys
from pathlib import Path

OUT = Path(os.environ["SB_OUT"])
SIZE = 0.1
WIDTH = 1e-3 * SIZE * 3**0.5
HELD = ("-bodies a -body_a_mesh box:0.1,0.1,0.1:2 -body_a_material stable_neohookean -body_a_young 1e6 -body_a_poisson 0.3 -time static "
        "-effects meet,top -effect_top_type prescribed_displacement -effect_top_on a.zmax -effect_top_displacement 0;0;{0} ")
# the lower side of the block is z = 0, and {0} the height of the obstacle's highest point; the bowl meets the corners
SHAPES = {"plane": "plane:0,0,1,{0}", "sphere": "sphere:0.05,0.05,{1},0.1", "box": "box:-1,-1,-1,1,1,{0}", "capsule": "capsule:-0.05,0.05,{1},0.15,0.05,{1},0.1",
          "cylinder": "cylinder:0.05,0.05,-0.2,0.05,0.05,{0},0.2", "bowl": "bowl:0.05,0.05,{2},0.2"}
passed = failed = 0


def check(name: str, bad: list[str]) -> None:
    global passed, failed
    passed, failed = passed + (not bad), failed + bool(bad)
    if bad:
        print(f"FAILED: {name}: {'; '.join(bad)}")


def run(name: str, options: str, ranks: int = 1) -> tuple[subprocess.CompletedProcess, list[dict]]:
    """The run, and the rows of its history."""
    done = subprocess.run([*os.environ["SB_MPI"].split(), str(ranks), os.environ["SB_SUPPLE"], *options.split(), "-effect_meet_type", "contact",
                           "-output_every", "0", "-quiet", "-output_dir", str(OUT / name)], capture_output=True, text=True, check=False)
    rows = list(csv.reader(open(OUT / name / "history.csv", encoding="utf-8"))) if done.returncode == 0 else []
    return done, [{k: float(v) for k, v in zip(rows[0], row, strict=False)} for row in rows[2:]]


def obstacle(shape: str, depth: float) -> str:
    return SHAPES[shape].format(depth, depth - 0.1, depth + (0.2**2 - 0.5 * SIZE**2) ** 0.5)


# held bodies
CASES = [(shape, response, depth, 1) for shape in SHAPES for response in ("barrier", "penalty")
         for depth in (-0.6 * WIDTH, 0.5 * WIDTH, 0.05 * SIZE) if depth > 0 or response == "barrier"]
CASES += [(shape, response, 0.05 * SIZE, 1) for shape in ("plane", "sphere") for response in ("projected", "multiplier", "augmented")]
CASES += [(shape, response, depth, 3) for shape in ("plane", "box") for response in ("barrier", "penalty") for depth in (0.5 * WIDTH, 0.05 * SIZE)]
for i, (shape, response, depth, ranks) in enumerate(CASES):
    scene = HELD + f"-effect_meet_response {response} -effect_meet_obstacle "
    done, rows = run(f"held{i}", scene.format(0) + obstacle(shape, depth), ranks)
    apart, other = run(f"apart{i}", scene.format(f"{-WIDTH - depth:.17g}") + obstacle(shape, -WIDTH), ranks)
    bad = [f"exit code {d.returncode}: {d.stderr[-300:]}" for d in (done, apart) if d.returncode]
    if not bad:
        strain = rows[-1]["strain"]
        if not strain > 0 or abs(strain - other[-1]["strain"]) > 2e-3 * strain:
            bad.append(f"strain energy {strain} J, pressed from apart {other[-1]['strain']} J")
        if any(abs(row["load_work"] + row["prescribed_work"] - row["strain"]) + abs(row["integrator_loss"]) > 1e-4 * strain for row in rows):
            bad.append(f"work {rows[-1]['load_work'] + rows[-1]['prescribed_work']} J of {strain} J, loss {rows[-1]['integrator_loss']} J")
    check(f"{shape} {response} {depth} m deep, {ranks} ranks", bad)

# half of a body in a plane: pushed out by parts of the first load step where that fails at once, to where exact constraints put it
for cells, ranks, element, law, nu in ((3, 2, "p1", "stable_neohookean", 0.3), (2, 1, "cr", "stable_neohookean", 0.45)):
    energy = []
    for response in ("projected", "augmented"):
        done, rows = run("sunk", f"{HELD.format(0)} -body_a_mesh box:0.1,0.1,0.1:{cells} -body_a_element {element} -body_a_material {law} -body_a_poisson {nu} "
                         f"-effect_meet_response {response} -effect_meet_obstacle plane:0,0,1,0.05", ranks)
        energy.append(rows[-1]["strain"] if rows else 0.0)
    good = energy[0] > 0 and abs(energy[1] - energy[0]) < 1e-5 * energy[0]
    check(f"sunk {cells} cells, {element}, {law}", [] if good else [f"strain energy {energy} J {done.stderr[-300:]}"])

# supports that stand on the obstacle, and a body without a support
BASE = HELD.format(0).replace("a.zmax", "a.zmin")
for shape, depth in (("plane", 0.0), ("plane", 1e-5), ("box", 1e-5)):
    done, rows = run("base", f"{BASE} -effect_meet_obstacle {obstacle(shape, depth)}")
    good = done.returncode == 0 and rows[-1]["strain"] < 1e-2 and abs(rows[-1]["load_work"] - rows[-1]["strain"]) < 1e-9
    check(f"clamped base {depth} m in a {shape}", [] if good else [done.stderr[-300:] or str(rows[-1])])
TWO = ("-bodies a,b -body_default_mesh box:0.1,0.1,0.1:{0} -body_b_translate {1} -body_default_element {2} -body_default_material corotated -body_default_young 1e6 "
       "-body_default_poisson 0.3 -body_default_density 1000 -time static -effects {3}meet,hold -effect_hold_type fixed -effect_meet_response {4} ")
for cells, element, response in ((2, "p1", "projected"), (2, "cr", "augmented"), (1, "cr", "multiplier"), (1, "p2", "multiplier")):
    for load in ("", "gravity,"):
        for body, scene in (("a", TWO.format(cells, "1,0,0.5", element, load, response) + "-effect_hold_on b.zmax -effect_meet_obstacle plane:0,0,1,0.001"),
                            ("b", TWO.format(cells, "0.013,0.007,0.099", element, load, response) + "-effect_hold_on a.zmin")):
            done, rows = run("free", scene)
            good = rows[-1]["max_displacement"] < 2e-3 if done.returncode == 0 else f"the body {body} " in done.stderr
            check(f"no support, {cells} cells, {element}, {response}, {load} {body}", [] if good else [done.stderr[-300:] or str(rows[-1]["max_displacement"])])

# wholly inside
INSIDE = {"plane": "plane:0,0,1,0.3", "sphere": "sphere:0.05,0.05,0.05,0.3", "box": "box:-1,-1,-1,1,1,1", "capsule": "capsule:-0.5,0.05,0.05,0.5,0.05,0.05,0.2",
          "cylinder": "cylinder:0.05,0.05,-1,0.05,0.05,1,0.3", "bowl": "bowl:2,0,0,0.5", "mesh": f"mesh:{OUT / 'tet.off'}"}
OUT.joinpath("tet.off").write_text("OFF\n4 4 0\n-1 -1 -1\n9 -1 -1\n-1 9 -1\n-1 -1 9\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")
FREE = HELD.replace("static", "euler_implicit -ts_dt 0.01 -ts_max_time 0.02 -body_a_density 1000").replace("meet,top", "meet").split("-effect_top_type")[0]
for shape, text in INSIDE.items():
    for response in ("barrier", "projected", "multiplier", "augmented", "penalty"):
        for name, scene in (("static", HELD.format(0)), ("dynamic", FREE)):
            if response == "multiplier" and name == "dynamic":
                continue
            done, _ = run("inside", f"{scene} -effect_meet_response {response} -effect_meet_obstacle {text}", 2 if response == "penalty" else 1)
            named = all(word in done.stderr for word in ("effect meet", "body a ", "-body_a_translate", "-effect_meet_obstacle"))
            check(f"inside {shape} {response} {name}", [] if done.returncode == 1 and named else [f"{done.returncode} {done.stderr[-300:]}"])
done, _ = run("reaches", f"{FREE} -effect_meet_obstacle plane:0,0,1,0.099")
check("a part is outside", [] if done.returncode == 0 else [done.stderr[-300:]])
print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
