"""What a run says of a scene that it computes, but hardly as it was meant: two supports that differ at one node, parts of
a mesh that touch but do not join, tets too long for an element, loads on held nodes; and a group whose name has letters beyond ASCII."""
import os
import subprocess
import sys
from pathlib import Path

OUT, SUPPLE, MPI = Path(os.environ["SB_OUT"]), os.environ["SB_SUPPLE"], os.environ["SB_MPI"].split()
BODY = "-bodies b -body_b_material corotated -body_b_young 1e5 -body_b_poisson 0.3 -output_overwrite yes".split()
BOX = ["-body_b_mesh", "box:0.1,0.1,0.1:2", "-time", "static"]
# two pyramids on one square, whose diagonals cross; one of the nodes is in a group
MESH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
1
0 5 "Spitze_Körper"
$EndPhysicalNames
$Nodes
6
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
5 .5 .5 1
6 .5 .5 -1
$EndNodes
$Elements
5
1 4 2 1 1 1 2 3 5
2 4 2 1 1 1 3 4 5
3 4 2 1 1 1 2 4 6
4 4 2 1 1 2 3 4 6
5 15 2 5 1 5
$EndElements
"""
failed = 0


def case(name, words, ranks=1, said=(), error=False):
    global failed
    done = subprocess.run([*MPI, str(ranks), SUPPLE, *BODY, *words, "-output_dir", str(OUT / "run")], capture_output=True, text=True, cwd=OUT)
    lines = [line for line in done.stderr.split("\n") if line.startswith("supple: ")]
    good = bool(done.returncode) == error and len(lines) == bool(said) and all(word in lines[0] for word in said)
    failed += not good
    if not good:
        print(f"{name}: exit code {done.returncode}, {lines}, not {said}\n{done.stderr[-500:]}")


def supports(first, second, moved, **more):
    case(moved, [*BOX, "-effects", f"{first},{second}", "-effect_f1_type", "fixed", "-effect_f1_on", "zmin", "-effect_f2_type", "prescribed_displacement",
                 "-effect_f2_on", "xmin", "-effect_f2_displacement", moved], **more)


for n in (1, 2):
    supports("f1", "f2", "0.001;0;0", ranks=n, said=("f1 and f2", "(0, ", "0 and 0.001 m", "direction x", "f1 counts"))
supports("f2", "f1", "0.001;0;0", said=("f2 and f1", "0.001 and 0 m", "f2 counts"))
supports("f1", "f2", "0;z*t;0")  # nothing where they meet
supports("f1", "f2", "0;0;0.001*t", said=("f1 and f2", "direction z"))


def load(kind, on, said, ranks=1, components="xyz"):
    case(f"{kind} on {on}", [*BOX, "-effects", "hold,push", "-effect_hold_type", "fixed", "-effect_hold_on", "zmin", "-effect_hold_components", components, "-effect_push_type",
                             *kind.split(), *on.split()], ranks=ranks, said=said)


# loads on held nodes alone; one of them is free, or free in the direction of the load
HELD = ("effect push", "held nodes alone")
for n in (1, 3):
    load("traction -effect_push_on", "zmin -effect_push_total 1,0,0", HELD, ranks=n)
load("pressure -effect_push_value 5 -effect_push_on", "zmin", HELD)
load("point_force -effect_push_vector 0;0;1 -effect_push_on", "zmin", HELD)
load("spring -effect_push_stiffness 1 -effect_push_length 0.1 -effect_push_points", "0.05,0.05,0;ground:0,0,-0.2", ())  # measures
load("traction -effect_push_on", "xmin -effect_push_total 0,0,-1", ())
load("foundation -effect_push_stiffness 1e3 -effect_push_on", "zmin", ())

# an obstacle that is driven onto nodes that a support holds
for n in (1, 2):
    case("held", ["-bodies", "b", *BOX[:2], "-sets", "held", "-set_held_at", "box:-1,-1,0.09,0.06,1,1", "-effects", "clamp,tool", "-effect_clamp_type", "fixed", "-effect_clamp_on",
                  "held", "-effect_tool_type", "contact", "-effect_tool_obstacle", "sphere:0.055,0.05,0.131,0.03", "-effect_tool_displacement", "0;0;-t", "-ts_dt", "0.01",
                  "-ts_max_time", "0.02", "-time_max_halvings", "0"], ranks=n, said=("effect tool: the obstacle and b", "a support holds, which cannot give way"), error=True)

# a body that goes farther than its size in a step and meets another one; one that meets nothing, and one in shorter steps
for n, speed, dt, said in ((1, "20", "0.01", ("warning", "t = 0 s: b would go 0.2 m", "1.2 times its size of 0.173 m", "-ts_dt below 0.0087")), (2, "-20", "0.01", ()), (1, "20", "0.005", ())):
    case(f"way {speed} {dt}", ["-bodies", "b,c", *BOX[:2], "-body_c_mesh", "box:0.1,0.1,0.1:2", "-body_c_material", "corotated", "-body_c_young", "1e5", "-body_c_poisson", "0.4", "-body_c_density", "1000",
                               "-body_c_translate", "0.03,0.02,0.188", "-body_b_velocity", f"0,0,{speed}", "-effects", "meet", "-effect_meet_type", "contact",
                               "-ts_dt", dt, "-ts_max_time", dt], ranks=n, said=said)

# cr and dg bend wrongly with tets of shapes that no test covers
for n, element, cells, said in (
    (1, "cr", "1,2,2", ("body b", "cr", "24 of 24 tets", "long")),
    (2, "dg", "2,2,20", ("body b", "dg", "480 of 480 tets", "flat")),
    (1, "cr", "5,2,2", ("body b", "long")),
    (1, "cr", "14,2,2", ()),
    (1, "p2", "1,2,2", ()),
):
    case(f"{element} {cells}", ["-body_b_mesh", f"box:1,0.1,0.1:{cells}", "-body_b_element", element, "-time", "static", "-effects", "f",
                                "-effect_f_type", "fixed", "-effect_f_on", "xmin"], ranks=n, said=said)

# a stiff block that lands with friction ends in few iterations, where the solver has to change, which is said
for n, box, solver in ((1, "0.12,0.12,0.12:3", "cholmod"), (2, "0.25,0.25,0.02:2", "auto")):
    case(f"stiff {solver}", ["-body_b_mesh", f"box:{box}", "-body_b_translate", "0,0,0.005", "-body_b_young", "6e9", "-body_b_poisson", "0.4", "-effects", "gravity,c",
                             "-effect_c_type", "contact", "-effect_c_response", "projected", "-effect_c_obstacle", "plane:0,0,1,0", "-effect_c_friction", "0.5", "-solver", solver,
                             "-ts_dt", "0.02", "-ts_max_time", "0.06"], ranks=n, said=("warning", "constraints of contact"))
    names, _, *rows = (line.split(",") for line in (OUT / "run/history.csv").read_text().splitlines())
    linear = sum(int(row[names.index("linear")]) for row in rows)
    failed += linear > 1000
    print(f"stiff {solver}: {linear} linear iterations")

# an obstacle between the nodes of a facet, which do not feel it; one that is thinner than a facet near it; and those
# that nodes feel, or that are far
def poke(obstacle, said=(), ranks=1, element="p1", response="projected", more=()):
    case(f"{obstacle} {element}", [*BOX, "-body_b_element", element, "-effects", "f,poke", "-effect_f_type", "fixed", "-effect_f_on", "zmin", "-effect_poke_type", "contact",
                                   "-effect_poke_on", "zmax", "-effect_poke_obstacle", obstacle, "-effect_poke_response", response, *more], ranks=ranks, said=said)


for n, element, response in ((1, "p1", "projected"), (2, "p1", "penalty"), (3, "cr", "multiplier"), (1, "dg", "projected"), (2, "p2", "augmented")):
    poke("sphere:0.03,0.035,0.103,0.005", ("warning", "poke", "0.01 m wide", "0.002 m inside", "of b", "barrier"), n, element, response)
poke("box:0.028,0.033,0.098,0.032,0.037,0.2", ("0.004 m wide", "inside"))
poke("sphere:0.03,0.035,0.148,0.05", ("0.1 m wide", "inside"))  # large, but no node is there yet
poke("capsule:0.03,0.035,0.15,0.03,0.035,0.104,0.003", ("0.006 m wide", "near it", "0.05 to"), 2)
poke("capsule:0.03,0.035,0.25,0.03,0.035,0.2,0.003")
poke("sphere:0.05,0.05,0.148,0.05")
poke("box:0,0.03,0.098,0.1,0.2,0.2")
poke("plane:0,0,-1,-0.098")

(OUT / "crossed.msh").write_text(MESH)
SUPPORT = ["-body_b_scale", "0.1", "-effects", "f", "-effect_f_type", "fixed", "-effect_f_on", "Spitze_Körper", "-ts_dt", "0.001", "-ts_max_time", "0.001"]
case("p1", ["-body_b_mesh", "crossed.msh", *SUPPORT], said=("warning", "crossed.msh", ": 4 ", "0) m"))
case("cr", ["-body_b_mesh", "crossed.msh", "-body_b_element", "cr", *SUPPORT], said=("error", "crossed.msh", "2 parts", ": 4 "), error=True)
print(f"{31 - failed} passed, {failed} failed")
sys.exit(failed > 0)
