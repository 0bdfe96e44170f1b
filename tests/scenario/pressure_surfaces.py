"""A pressure says whether its surface is closed, and the volume inside, or where it is open; the volume of a cavity is in the history;
what fails with an open one names it."""
import csv
import itertools
import json
import os
import subprocess
import sys
from pathlib import Path

OUT = Path(os.environ["SB_OUT"])
passed = failed = 0

# A box of 3 x 3 x 3 cubes without the middle one, each of six tets.
points = list(itertools.product(range(4), repeat=3))
tets = []
for corner in itertools.product(range(3), repeat=3):
    for way in itertools.permutations(range(3)):
        at, tet = list(corner), [tuple(corner)]
        for k in way:
            at[k] += 1
            tet.append(tuple(at))
        if corner != (1, 1, 1):
            tets.append([points.index(p) + 1 for p in tet])
(OUT / "hollow.mesh").write_text(
    f"MeshVersionFormatted 2\nDimension 3\nVertices {len(points)}\n" + "".join(f"{x} {y} {z} 0\n" for x, y, z in points)
    + f"Tetrahedra {len(tets)}\n" + "".join(" ".join(map(str, t)) + " 0\n" for t in tets) + "End\n", encoding="utf-8")
SCENE = (f"-bodies a -body_a_material stable_neohookean -body_a_young 1e5 -body_a_poisson 0.3 -body_a_density 1000 -body_a_scale 1 -body_a_mesh {OUT}/hollow.mesh "
         "-sets inside,top,foot -set_inside_at box:0.9,0.9,0.9,2.1,2.1,2.1 -set_top_at plane:0,0,1,3,0.01 -set_foot_at plane:0,0,1,0,0.01 "
         "-effects p,clamp -effect_p_type pressure -effect_clamp_type fixed -effect_clamp_on foot -ts_dt 0.01 -ts_max_time 0.02")


def check(holds: bool, what: str) -> None:
    """Counts a check; says which one failed."""
    global passed, failed
    passed, failed = passed + bool(holds), failed + (not holds)
    if not holds:
        print("FAILED:", what)


def run(name: str, ranks: int, options: str) -> tuple[str, str, list[dict[str, str]]]:
    """The note on the pressure, errors and warnings, and the history."""
    done = subprocess.run([*os.environ["SB_MPI"].split(), str(ranks), os.environ["SB_SUPPLE"], *SCENE.split(), *options.split(),
                           "-output_dir", str(OUT / name)], capture_output=True, text=True, check=False)
    with open(OUT / name / "history.csv", encoding="utf-8") as file:
        units, *rows = csv.DictReader(file)
    check(units.get("p_volume", "m^3") == "m^3", f"{options}: unit {units.get('p_volume')}")
    return json.loads((OUT / name / "run.json").read_text(encoding="utf-8"))["effect_notes"][0], done.stderr, rows


# options, ranks, words of the note, volume at rest
for i, (options, ranks, words, volume) in enumerate((
    ("-effect_p_on inside -effect_p_value 5e3", 1, ("closed", "cavity of 1 m^3"), 1.0),
    ("-effect_p_on inside -effect_p_value 5e3", 3, ("closed", "cavity of 1 m^3"), 1.0),
    ("-effect_p_on inside -effect_p_value 5e3 -body_a_element p2", 2, ("closed", "cavity of 1 m^3"), 1.0),
    ("-effect_p_on inside -effect_p_value 5e3 -body_a_element cr", 2, ("closed", "cavity of 1 m^3"), 1.0),
    ("-effect_p_on boundary -effect_p_value 5e3", 2, ("closed", "26 m^3"), 26.0),
    ("-effect_p_on boundary -effect_p_value 5e3 -body_a_element dg", 2, ("closed", "26 m^3"), 26.0),
    ("-effect_p_on top -effect_p_value 5e3", 1, ("open", "12 edges", "(0, 0.5, 3)", "potential"), None),
    ("-effect_p_on top -effect_p_value 5e3", 3, ("open", "12 edges", "(0, 0.5, 3)", "potential"), None),
    ("-effect_p_on top -effect_p_value 5e3 -effect_p_follower no", 2, ("open", "12 edges", "(0, 0.5, 3)"), None),
    ("-effect_p_on foot -effect_p_value 5e3", 2, ("open", "12 edges", "(0, 0.5, 0)", "supports"), None),
)):
    note, errors, rows = run(str(i), ranks, options)
    # a pressure on the foot, which is held, is warned of
    said = "held nodes alone" in errors if "foot" in options else not errors
    check(all(w in note for w in words) and said, f"{options} on {ranks}: {note} {errors}")
    check(("p_volume" in rows[0]) == (volume is not None), f"{options}: columns {list(rows[0])}")
    if volume:
        first, last = float(rows[0]["p_volume"]), float(rows[-1]["p_volume"])
        check(abs(first - volume) < 1e-9 * volume, f"{options}: {first} m^3 at rest")
        check(last > first + 1e-6 if volume == 1 else last < first - 1e-6, f"{options}: {first} to {last} m^3 under pressure")
    if volume == 26 and i == 4:
        check(abs(float(rows[-1]["p_volume"]) - float(rows[-1]["volume"])) < 1e-9, f"{rows[-1]['volume']} m^3 of the body")

# Inside a cavity of CR and DG, whose facets do not meet at their edges, it does the work p dV, and forces and moments cancel: nothing is
# left for the clamp.
for element in ("cr", "dg"):
    for ranks in (1, 2):
        options = f"-effect_p_on inside -effect_p_value 2e4 -body_a_element {element}"
        rows = run(f"work{element}{ranks}", ranks, options + " -time newmark -ts_dt 1e-3 -ts_max_time 0.03 -ksp_rtol 1e-10")[2]
        work, growth = float(rows[-1]["load_work"]), float(rows[-1]["p_volume"]) - 1
        check(growth > 0.02 and abs(work / (2e4 * growth) - 1) < 1e-3, f"{options} on {ranks}: work {work} J, the cavity grew by {growth} m^3")
        rows = run(f"sum{element}{ranks}", ranks, options + " -time static -ksp_rtol 1e-11 -snes_rtol 1e-10")[2]
        check(all(abs(float(rows[-1][f"clamp_reaction_{c}"])) < 1e-4 for c in "xyz"), f"{options} on {ranks}: reactions {rows[-1]}")

# What fails names the open surface; a closed one is not blamed.
_, errors, _ = run("fails", 1, "-effect_p_on top -effect_p_value 1e9 -time static -static_steps 1 -snes_max_it 3 -static_min_increment 0.4")
check("open surface" in errors.replace("\n", " ") and "error" in errors, f"an open pressure that fails: {errors}")
_, errors, _ = run("other", 1, "-effect_p_on inside -effect_p_value 1e9 -time static -static_steps 1 -snes_max_it 3 -static_min_increment 0.4")
check("open surface" not in errors and "error" in errors, f"a closed pressure that fails: {errors}")

# A column under a follower pressure on its end: Newmark's energy grows, and the load is named beside the integrator.
done = subprocess.run(
    [os.environ["SB_SUPPLE"], *("-bodies a -body_a_material stable_neohookean -body_a_young 1e5 -body_a_poisson 0.3 -body_a_density 1000 -body_a_scale 1 "
     "-body_a_mesh box:0.3,0.3,3:1 -body_a_displacement 0.01*z*z;0;0 -effects push,clamp -effect_push_type pressure -effect_push_value 5e4 "
     "-effect_push_on zmax -effect_clamp_type fixed -effect_clamp_on zmin -ts_dt 0.05 -ts_max_time 1.6 -time newmark").split(),
     "-output_dir", str(OUT / "beck")], capture_output=True, text=True, check=False)
balance = [line for line in done.stderr.splitlines() if "energy balance" in line or "integrator gave" in line]
check(len(balance) == 1 and "push" in balance[0], f"an energy balance with an open pressure: {balance} {done.stderr[-300:]}")

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
