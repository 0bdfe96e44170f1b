"""Each class of errors and warnings in docs/guides/when_it_fails.md, shown by an invalid scenario: a row of CASES.

A row is: class of the guide; "error" or "warning"; arguments of the program; what the message must contain: options, values, files, line numbers, bodies, never its wording.
An error ends the run with exit code 1 and one line `supple: error:` that names all of it, and no trace; a warning leaves the exit code 0, or 1 where the row says so. Every class of the
guide has a row, and every row a class.

@cpu 300
"""
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py

TOP = Path(__file__).resolve().parents[2]
OUT = Path(os.environ["SB_OUT"]).resolve()
SUPPLE = str((TOP / os.environ["SB_SUPPLE"]).resolve())
MPI = os.environ["SB_MPI"].split()
DATA = str(TOP / "tests/data")

# A bar that is constrained at one end and pulled at the other; a cube without anything.
BAR = """-bodies bar
-body_bar_mesh box:0.4,0.1,0.1:6,2,2
-body_bar_material corotated
-body_bar_young 5e4
-body_bar_poisson 0.4
-sets left
-set_left_at plane:1,0,0,0
-effects gravity,hold,pull
-effect_hold_type fixed
-effect_hold_on left
-effect_pull_type traction
-effect_pull_on xmax
-effect_pull_vector 0;10*sin(2*pi*t);0
-ts_dt 0.01
-ts_max_time 0.02
-output_fields none
-quiet
"""
CUBE = """-bodies a
-body_a_mesh box:0.1,0.1,0.1:1
-body_a_material linear
-body_a_young 1e5
-body_a_poisson 0.3
-time static
-output_fields none
-quiet
"""
OPEN = "solid lid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid lid\n"
# A tet of unit edges whose triangles are turned inwards, as an obstacle below the bar.
INWARDS = "OFF\n4 4 6\n0 0 -1\n1 0 -1\n0 1 -1\n0 0 -0.5\n3 0 1 2\n3 0 3 1\n3 1 3 2\n3 0 2 3\n"
# The same in mm, turned outwards.
FAR = "OFF\n4 4 6\n0 0 -1000\n1000 0 -1000\n0 1000 -1000\n0 0 -500\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"
FILES = {"bar.opts": BAR, "cube.opts": CUBE, "lid.stl": OPEN, "inwards.off": INWARDS, "far.off": FAR, "table.txt": "0 0\n1 2\n1 3\n", "empty.msh": ""}

HELD = "-effects hold -effect_hold_type fixed -effect_hold_on xmin"
DRIVEN = HELD.replace("hold ", "hold,end ", 1) + " -effect_end_type prescribed_displacement -effect_end_on xmax -effect_end_displacement"
ARC = "-bodies a -body_a_mesh box:1,1,1:1 -body_a_material stvk -body_a_young 1 -body_a_poisson 0 -body_a_density 1 -effects hold,push " \
    "-effect_hold_type fixed -effect_hold_on zmin -effect_push_type gravity -time static -static_control arc_length -output_fields none -quiet"
LIMIT = "-bodies a -body_a_mesh box:1,1,1:2 -body_a_material stvk -body_a_young 1 -body_a_poisson 0 -effects low,press,x,y -effect_low_type fixed " \
    "-effect_low_on zmin -effect_low_components z -effect_x_type fixed -effect_x_on xmin -effect_x_components x -effect_y_type fixed -effect_y_on ymin " \
    "-effect_y_components y -effect_press_on zmax -time static -static_steps 10 -output_fields none -quiet"
# A block that falls into the groove between two half-spaces.
GROOVE = ("cube.opts -body_a_mesh box:0.1,0.1,0.1:2 -body_a_density 1000 -effects gravity,floor,wall -effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0 "
          "-effect_wall_type contact -effect_wall_obstacle plane:0.6,0,0.8,0 -time euler_implicit -time_max_halvings 0")
SNAP = f"{TOP}/scenarios/snap.opts -body_bar_mesh box:0.2,0.004,0.005:40,1,2 -output_fields none -quiet"

CASES = [
    ("O1", "error", "bar.opts -body_bar_yuong 3", ["-body_bar_yuong", "-body_bar_young"]),
    ("O1", "error", "bar.opts -output out/x", ["-output "]),
    ("O1", "error", "bar.opts -effcts gravity", ["-effcts", "-effects"]),
    ("O1", "error", "bar.opts -time_budget 1", ["-time_budget"]),
    ("O1", "error", "bar.opts -young 1", ["-young", "-body_NAME_young"]),
    ("O1", "error", "bar.opts -ts_dtt 0.01", ["-ts_dtt", "-ts_dt"]),
    ("O2", "error", "", ["-bodies"]),
    ("O2", "error", "bar.opts -bodies bar,rod", ["-body_rod_mesh"]),
    ("O2", "error", "bar.opts -effects", ["-effects"]),
    ("O3", "error", "bar.opts -body_bar_young -5", ["-body_bar_young", "-5 Pa", "(0, inf)"]),
    ("O3", "error", "bar.opts -body_bar_young 5e4Pa", ["-body_bar_young", "5e4Pa", "(0, inf) Pa"]),
    ("O3", "error", "bar.opts -body_bar_translate 1,2", ["-body_bar_translate", "1,2", "3"]),
    ("O3", "error", "bar.opts -time newmrk", ["-time", "newmrk", "newmark"]),
    ("O4", "error", "bar.opts -effect_pull_vector 0;0;2*s", ["-effect_pull_vector", "2*s", "'s'"]),
    ("O4", "error", "bar.opts -effect_pull_vector 0;0;table:table.txt", ["-effect_pull_vector", "table.txt", "line 3"]),
    ("O5", "error", "bar.opts -effects gravty", ["gravty", "gravity"]),
    ("O5", "error", "bar.opts -effect_pull_on xmx", ["'xmx'", "xmax"]),
    ("O5", "error", "bar.opts -body_bar_material corotatd", ["-body_bar_material", "corotatd", "corotated"]),
    ("O5", "error", "bar.opts -output_fields displacment", ["-output_fields", "displacment", "displacement"]),
    ("O6", "error", "bar.opts -accuracy 0.1 -step_time_budget 1", ["-accuracy", "-step_time_budget"]),
    ("O6", "error", f"{ARC} -body_a_tangent exact_spd", ["-static_control", "-body_a_tangent"]),
    ("O6", "error", "bar.opts -effects floor -effect_floor_type contact -effect_floor_response projected -effect_floor_obstacle plane:0,0,1,-1 -time euler_explicit -ts_dt 1e-5",
     ["floor", "-time"]),
    ("O6", "error", "bar.opts -pc_type bddc", ["-pc_type bddc"]),
    ("O6", "error", "RANKS 2 bar.opts -body_bar_element cr -solver pressure -pressure_ksp_type cg", ["-pressure_ksp_type cg"]),
    ("O7", "warning", "bar.opts -static_steps 3", ["-static_steps"]),
    ("O7", "warning", "bar.opts -effect_pull_from 0.02", ["pull", "-effect_pull_from", "0.02"]),
    ("O7", "warning", "bar.opts -effect_pull_until 0", ["pull", "-effect_pull_until"]),
    ("O7", "warning", "bar.opts -output_dir restarted -output_overwrite yes -body_bar_state saved/checkpoint_000002.h5 -body_bar_velocity 0,0,1", ["-body_bar_state", "saved/checkpoint_000002.h5"]),
    ("O7", "warning", "bar.opts -ksp_nothing 1e-3", ["-ksp_nothing", "1e-3"]),
    ("O8", "error", "bar.opts -mg_levels_ksp_rtol 3", ["-mg_levels_ksp_rtol 3", "[0, 1)"]),
    ("O8", "error", "bar.opts -sub_pc_factor_mat_solver_type nosuch", ["-sub_pc_factor_mat_solver_type nosuch", "petsc"]),
    ("O8", "error", "bar.opts -snes_type vinewtonrsls", ["-snes_type vinewtonrsls", "newtonls"]),
    ("O8", "warning", "bar.opts -snes_atol 1e9", ["-snes_atol 1e+09 N"]),
    ("F1", "error", "nix.opts", ["nix.opts"]),
    ("F1", "error", "bar.opts -body_bar_mesh nix.msh", ["-body_bar_mesh", "nix.msh"]),
    ("F2", "error", f"cube.opts -body_a_mesh {DATA}/bad_number.msh {HELD}", ["bad_number.msh", "line 9", "1,5"]),
    ("F2", "error", f"cube.opts -body_a_mesh {DATA}/bad_truncated_bin.msh {HELD}", ["bad_truncated_bin.msh", "byte 1996"]),
    ("F2", "error", f"cube.opts -body_a_mesh lost.h5 -body_a_element p2 {HELD}", ["lost.h5", "/mesh/curved_edges", "1 and 6", "row 1"]),
    ("F3", "error", f"cube.opts -body_a_mesh {DATA}/bad_hexes.msh {HELD}", ["bad_hexes.msh", " 1 "]),
    ("F3", "error", f"cube.opts -body_a_mesh {DATA}/bad_surface.msh {HELD}", ["bad_surface.msh", " 2 "]),
    ("F4", "error", "bar.opts -output_dir table.txt/out", ["-output_dir", "table.txt/out"]),
    ("F5", "error", "bar.opts -output_dir none -restart latest", ["-restart", "none"]),
    ("F5", "error", "bar.opts -output_dir saved -restart saved/checkpoint_000002.h5 -body_bar_mesh box:0.4,0.1,0.1:4", ["saved/checkpoint_000002.h5"]),
    ("F5", "error", "bar.opts -output_dir restarted -restart saved", ["-restart saved", "-output_dir saved", "latest"]),
    ("F5", "error", "bar.opts -output_dir restarted -body_bar_state saved,7777", ["-body_bar_state saved,7777", "7777", " 2"]),
    ("F5", "error", "bar.opts -output_dir restarted -body_bar_state table.txt", ["-body_bar_state table.txt", "folder"]),
    ("F5", "error", "bar.opts -output_dir restarted -body_bar_state short.h5", ["-body_bar_state short.h5"]),
    ("F6", "warning", "bar.opts -output_dir cut -restart latest", ["cut/checkpoint_000002.h5"]),
    ("F7", "warning", "bar.opts -output_dir restarted -output_overwrite yes -body_bar_state saved/checkpoint_000002.h5 -body_bar_element p2", ["-body_bar_state", "saved/checkpoint_000002.h5", "saved,2"]),
    ("F8", "warning", "bar.opts -output_dir gone -restart latest -output_fields displacement", ["gone/fields.h5", "step 2"]),
    ("M1", "error", f"cube.opts -body_a_mesh {DATA}/bad_flat.msh {HELD}", ["bad_flat.msh", " 1 ", "1.67e-15 m^3"]),
    ("M1", "error", f"cube.opts -body_a_mesh {DATA}/bad_twins.msh {HELD}", ["bad_twins.msh", " 1 ", " 2 "]),
    ("M2", "error", f"cube.opts -body_a_mesh lid.stl {HELD}", ["lid.stl", " 3 ", " 1 ", "(1, 0, 0)"]),
    ("M3", "error", f"cube.opts -body_a_mesh {DATA}/bead.obj -body_a_tet_size 1e-7 {HELD}", ["bead.obj", "1e-07 m", "tet_size"]),
    ("M4", "warning", "bar.opts -effects gravity,stop -effect_stop_type contact -effect_stop_response projected -effect_stop_obstacle mesh:inwards.off", ["inwards.off"]),
    ("M5", "error", f"cube.opts -body_a_mesh {DATA}/two_cubes_41.msh -body_a_scale 1.7e308 {HELD}", ["two_cubes_41.msh", "-body_a_scale", "1.7e+308"]),
    ("M5", "warning", "bar.opts -effects gravity,stop -effect_stop_type contact -effect_stop_obstacle mesh:far.off", ["-effect_stop_obstacle_scale", "far.off"]),
    ("M6", "warning", f"cube.opts -body_a_mesh box:0.1,0.1,0.1:3 -remesh_quality 0.99 -static_steps 2 {HELD}", ["'a'", " 1:"]),
    ("S1", "error", "bar.opts -set_left_at plane:1,0,0,9", ["'left'", "0.4"]),
    ("S1", "error", "bar.opts -sets left,tip -set_tip_at box:0.39,0.04,0.04,0.41,0.06,0.06 -effect_pull_on tip", ["-effect_pull_on", "tip"]),
    ("S2", "error", "cube.opts -effects gravity", ["-time static"]),
    ("S2", "error", "cube.opts -effects push,hold -effect_push_type gravity -effect_push_vector 1,0,0 -effect_hold_type fixed -effect_hold_on zmin "
     "-effect_hold_components z", [" a ", "(1.00, 0.00, 0.00)"]),
    ("S3", "error", "bar.opts -effects hold,again -effect_again_type fixed -effect_again_on left", ["-effect_again_on"]),
    ("S4", "error", "cube.opts -bodies a,b -body_a_mesh box:1,1,1:9 -body_b_mesh box:0.1,0.1,0.1:1 -body_b_translate 0.45,0.45,0.45 -body_b_material linear "
     "-body_b_young 1e5 -body_b_poisson 0.3 -effects meet -effect_meet_type contact -time euler_implicit -ts_dt 1e-3 -ts_max_time 1e-3",
     ["body b", "body a", "-body_b_translate"]),
    ("S5", "warning", "cube.opts -effects hold,poke -effect_hold_type fixed -effect_hold_on zmin -effect_poke_type contact -effect_poke_response penalty "
     "-effect_poke_obstacle sphere:0.03,0.05,0.103,0.005", ["poke", "0.01 m wide", "0.002 m", "of a "]),
    ("R1", "error", "bar.opts -effect_pull_vector 0;0;1e9 -snes_max_it 2 -time_max_halvings 2", ["0.0025 s"]),
    # PETSc's own integrator stops without a message
    ("R1", "error", "bar.opts -effect_pull_vector 0;0;1e9 -snes_max_it 2 -time alpha2", ["-ts_dt", "genalpha"]),
    # there is no load beyond 0.0152 s
    ("R1", "error", "bar.opts -effect_pull_vector 0;0;sqrt(0.0152-t)", ["-effect_pull_vector", "0.02 s"]),
    # the inverted cube, which carries the load too, is not accepted
    ("R2", "error", f"{LIMIT} -effect_press_type traction -effect_press_vector 0;0;-0.2", ["0.962"]),
    ("R2", "error", f"{LIMIT} -effect_press_type traction -effect_press_vector 0;0;-0.2 -body_a_element p2 -static_steps 1", ["0.96"]),
    ("R2", "error", f"{LIMIT} -effect_press_type pressure -effect_press_follower no -effect_press_value 0.2 -body_a_element cr", ["0.96"]),
    ("R2", "error", f"{LIMIT} -effect_press_type pressure -effect_press_value 0.2", ["0.962"]),
    # a symmetric state that buckles before its limit load
    *(("R2", "error", f"{LIMIT} -effect_x_on zmin -effect_y_on zmin -effect_press_type traction -effect_press_vector 0;0;-0.25 -body_a_element {more}",
       ["the load factor reached 0.", "a limit load", "-static_control arc_length"]) for more in ("p2 -solver cg_gamg -static_steps 1", "cr -solver cg_gamg", "p1 -pc_type cholesky -mat_cholmod_factor supernodal")),
    ("R3", "warning", "bar.opts -solver cg_jacobi -ksp_max_it 2", ["cg_jacobi", "-solver"]),
    ("R4", "warning", "bar.opts -time euler_explicit -ts_dt 0.005 -ts_max_time 0.01", ["-ts_dt", "0.005 s"]),
    ("R4", "error", "bar.opts -time euler_explicit -ts_dt 0.01 -ts_max_time 10", ["0.01 s", "t = 0.24"]),
    ("R5", "warning", f"cube.opts {DRIVEN} -0.12;0;0", ["6 ", "-0.2"]),
    ("R6", "warning", "bar.opts -snes_type ksponly -time_predictor velocity -body_bar_tangent warped", ["-snes_type", "-time_predictor", "exact_spd"]),
    ("R7", "warning", f"cube.opts -body_a_mesh box:0.4,0.1,0.1:6 -body_a_element cr -solver cg_two_level {HELD.replace('hold ', 'hold,gravity ', 1)}", ["-solver"]),
    ("R8", "warning", f"{SNAP} -effect_symmetry_components x", ["0.5", " 1 "]),
    ("R9", "warning", f"{SNAP} -static_max_steps 2", ["-static_max_steps", "2"]),
    ("R10", "warning", "RANKS 2 bar.opts -solver rotated -pc_rotated_interface 1", ["-solver rotated", "-pc_rotated_interface", "1"]),
    ("R11", "warning", "bar.opts -effect_pull_vector 0;0;1e9 -snes_max_it 2 -time_max_halvings 2 -remesh_failed yes", ["-remesh_failed"]),
    ("R12", "warning", "cube.opts -body_a_mesh box:0.4,0.1,0.1:1 -body_a_material stvk -body_a_young 1e6 -body_a_density 1000 -body_a_velocity 30*y,-30*x,20*x "
     "-time newmark -ts_dt 0.02 -ts_max_time 0.5", ["-ts_dt", "genalpha"]),
    # cycling friction at the beginning of contact took 900 useless Newton iterations
    ("R13", "warning", "cube.opts -bodies a,b -body_a_mesh box:0.1,0.1,0.05:3 -body_b_mesh box:0.06,0.06,0.05:2 -body_a_material stable_neohookean -body_b_material stable_neohookean "
     "-body_b_young 1e5 -body_b_poisson 0.3 -body_b_translate 0.02,0.013,0.052 -effects hold,push,meet -effect_hold_type fixed -effect_hold_on a.zmin "
     "-effect_push_type prescribed_displacement -effect_push_on b.zmax -effect_push_displacement 0;0;-0.012*t -effect_meet_type contact -effect_meet_friction 0.3 "
     "-static_steps 4", ["meet", "-static_steps"]),
    ("R14", "error", "cube.opts -bodies a,b -body_a_mesh box:0.1,0.1,0.1:1 -body_b_mesh box:0.1,0.1,0.1:1 -body_default_material stable_neohookean -body_default_young 1e5 "
     "-body_default_poisson 0.3 -body_default_density 1000 -body_b_translate 0.02,0.03,0.11 -body_b_velocity 0,0,-20 -effects meet -effect_meet_type contact "
     "-effect_meet_response augmented -effect_meet_stiffness 1e-5 -time euler_implicit -ts_dt 0.001 -ts_max_time 0.005 -time_max_halvings 0",
     ["meet", "of a with b", "barrier", "-effect_meet_multiplier_tolerance", "-ts_dt"]),
    ("R15", "warning", "cube.opts -body_a_mesh box:1,0.05,0.04:10,1,1 -body_a_element p2 -body_a_material corotated -body_a_young 1e6 -body_a_poisson 0 -effects hold,push "
     "-effect_hold_type fixed -effect_hold_on xmin -effect_push_type traction -effect_push_on xmax -effect_push_total -0.79,0,0", ["1 negative eigenvalue", "-static_unstable"]),
    ("R16", "error", f"{GROOVE} -body_a_material linear -body_a_young 1e5 -body_a_velocity -0.75,0.18,-1 -body_a_translate 0.05,0,0.06 -ts_dt 0.01 -ts_max_time 0.2 "
     "-effect_floor_response augmented -effect_wall_response augmented -effect_floor_friction 0.3 -effect_wall_friction 5 -effect_floor_friction_kinetic 0.3",
     ["effect floor", "a node of a at (", "-effect_floor_response barrier"]),
    ("R17", "warning", f"{GROOVE} -body_a_mesh box:0.1,0.1,0.1:3 -body_a_material corotated -body_a_young 1e6 -body_a_rotate 1,1,0,30 -body_a_translate 0.02,0,0.04 "
     "-body_a_velocity -1,0.5,-1 -ts_dt 0.005 -ts_max_time 0.05 -effect_floor_response projected -effect_wall_response projected -effect_floor_friction 0.5 "
     "-effect_wall_friction 0.7 -effect_floor_friction_kinetic 0.1 -effect_wall_friction_kinetic 0.1", ["effect wall", "a node of a at (", "0.069", "-effect_wall_response barrier"]),
    ("P1", "error", "bar.opts -pc_type lu -pc_factor_mat_solver_type mkl_pardiso", ["mkl_pardiso", "-solver"]),
]
FAILS_TOO = {"R11"}  # a warning before an error

passed = failed = 0


def check(text, good):
    global passed, failed
    passed, failed = passed + bool(good), failed + (not good)
    if not good:
        print(f"failed: {text}")


def run(arguments):
    words, ranks = arguments.split(), 1
    if words[:1] == ["RANKS"]:
        ranks, words = int(words[1]), words[2:]
    start = [*MPI, str(ranks)] if ranks > 1 else []
    done = subprocess.run([*start, SUPPLE, *words], cwd=OUT, env={**os.environ, "PETSC_OPTIONS": ""}, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace")
    return done.returncode, done.stdout + done.stderr


def main():
    for name, text in FILES.items():
        (OUT / name).write_text(text)
    # a cube with one curved edge that no tet has
    for name, edge in (("lost.h5", [1, 6]),):
        subprocess.run([Path(SUPPLE).with_name("supple-mesh"), "convert", "box:1,1,1:1", name, "-quiet"], cwd=OUT, check=True)
        with h5py.File(OUT / name, "r+") as f:
            f["mesh/curved_edges"], f["mesh/edge_offsets"] = [edge], [[0.9, 0, 0]]
            f.attrs["supple_mesh"] = 2
    # checkpoints of two steps, with the newer one truncated, and without their frames
    for folder in ("saved", "cut", "gone"):
        code, text = run(f"bar.opts -output_dir {folder} -checkpoint_every_steps 1 -output_fields displacement")
        check(f"checkpoints: {text}", code == 0)
    last = OUT / "cut/checkpoint_000002.h5"
    last.write_bytes(last.read_bytes()[:1000])
    (OUT / "gone/fields.h5").unlink()
    # a state with fewer velocities than displacements
    shutil.copy(OUT / "saved/checkpoint_000002.h5", OUT / "short.h5")
    with h5py.File(OUT / "short.h5", "r+") as f:
        v = f["v"][:-1]
        del f["v"]
        f["v"] = v

    for name, kind, arguments, named in CASES:
        if name == "R8" and "mumps" not in os.environ["SB_PACKAGES"].split():  # which counts the eigenvalues
            continue
        code, text = run(arguments)
        lines = [line for line in text.split("\n") if line.startswith(f"supple: {kind}: ")]
        say = f"{name}: supple {arguments}: "
        check(f"{say}exit code {code}", code == (kind == "error" or name in FAILS_TOO))
        check(f"{say}a trace", "PETSC ERROR" not in text)
        check(f"{say}words of a library", "CHOLMOD" not in text)
        if kind == "error":
            check(f"{say}{len(lines)} error lines", len(lines) == 1)
        check(f"{say}names not all of {named}: {text[-600:]}", any(all(word in line for word in named) for line in lines))

    guide = (TOP / "docs/guides/when_it_fails.md").read_text()
    told, shown = set(re.findall(r"^\| ([A-Z]\d+) \|", guide, re.M)), {case[0] for case in CASES}
    check(f"no scenario for {sorted(told - shown)}", not told - shown)
    check(f"not in the guide: {sorted(shown - told)}", not shown - told)
    print(f"{passed} passed, {failed} failed")
    sys.exit(failed > 0)


main()
