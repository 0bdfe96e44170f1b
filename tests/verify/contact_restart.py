"""A run that is taken up from a checkpoint in the middle of contact with friction is the run that was not interrupted.

An instrument that drags along tissue, and a block that is dragged over another: nodes and pairs that stick, and some that slide, when the
checkpoint is written. Every row of history.csv is compared, the sums since the start and the account of energies among them. Also: an
overlap that is being taken back; bodies that overlap and are being separated; an impact with nodes at faces; faces of CR that keep their energy while their penalty changes; a checkpoint that has lost what it says.
"""
import csv
import shutil
import sys

import h5py

from output_common import MPI, OUT, SUPPLE
import subprocess

BOX = "-body_{0}_material {1} -body_{0}_young {2} -body_{0}_poisson 0.3 -body_{0}_density 1000 "
TOOL = ("-bodies a -body_a_mesh box:0.1,0.06,0.04:3 " + BOX.format("a", "corotated", "2e4") + "-effects bed,tool "
        "-effect_bed_type fixed -effect_bed_on zmin -effect_tool_type contact -effect_tool_response projected -effect_tool_on zmax -effect_tool_friction 0.2 "
        "-effect_tool_obstacle capsule:0.04,0.031,0.055,0.04,0.031,0.155,0.015 "
        "-effect_tool_displacement 0.02*ramp(t/0.2-0.5);0;-0.008*ramp(t/0.1) -effect_tool_angle 20*t "
        "-effect_tool_axis_point 0.04,0.031,0.05 -ts_dt 0.02 -ts_max_time {end} -effect_tool_response ")
BLOCKS = ("-bodies a,b -body_a_mesh box:0.2,0.1,0.05:2 -body_b_mesh box:0.08,0.06,0.05:2 -body_b_translate 0.06,0.02,0.05 "
          + BOX.format("a", "linear", "1e5") + BOX.format("b", "linear", "2e5") + "-sets bottom,top "
          "-set_bottom_at plane:0,0,1,0 -set_top_at plane:0,0,1,0.1 -effects hold,push,meet -effect_hold_type fixed "
          "-effect_hold_on bottom -effect_push_type prescribed_displacement -effect_push_on top "
          "-effect_push_displacement 0.003*ramp(t/0.1-0.5);0;-0.002*ramp(t/0.05) -effect_meet_type contact "
          "-effect_meet_friction 0.4 -ts_dt 0.01 -ts_max_time {end}")
# 1 mm in the floor when it begins; the friction is that of a slope
DEEP = ("-bodies a -body_a_mesh box:0.1,0.1,0.05:2 " + BOX.format("a", "corotated", "1e5") + "-effects gravity,floor "
        "-effect_gravity_vector 1,0,-9 -effect_floor_type contact -effect_floor_response projected -effect_floor_obstacle plane:0,0,1,0.001 "
        "-effect_floor_friction 0.3 -ts_dt 0.005 -ts_max_time {end} -effect_floor_response ")
# a tenth of each other when they begin, obliquely; they intersect until 0.31 s
PARTED = ("-bodies a,b -body_a_mesh box:0.1,0.1,0.1:2 -body_b_mesh box:0.1,0.1,0.1:1 -body_b_rotate 0,0,1,5 -body_b_translate 0.09,0.013,0.007 "
          + BOX.format("a", "stable_neohookean", "1e6") + BOX.format("b", "stable_neohookean", "1e6")
          + "-effects meet -effect_meet_type contact -ts_dt 0.01 -ts_max_time {end}")
# a block on its corner hits a floor at 100 m/s, nodes at faces; half of it is squeezed when the checkpoint is written
CORNER = ("-bodies a -body_a_mesh box:0.04,0.04,0.04:2 -body_a_element cr -body_a_rotate 1,-1,0,54.7356 "
          "-body_a_translate 0,0,0 -body_a_velocity 3,0,-100 " + BOX.format("a", "stable_neohookean", "1e9")
          + "-effects floor -effect_floor_type contact -effect_floor_response projected -effect_floor_obstacle plane:0,0,1,0 "
          "-effect_floor_friction 0.2 -ts_dt 1e-5 -ts_max_time {end} -effect_floor_response ")
# pressed to a fifth of its height, and half-way back when the checkpoint is written
PRESSED = ("-bodies a -body_a_mesh box:0.05,0.05,0.05:2 -body_a_element cr " + BOX.format("a", "stable_neohookean", "1e4")
           + "-effects high,low -effect_high_type contact -effect_high_obstacle plane:0,0,-1,-0.0501 -effect_high_displacement "
           "0;0;-0.04*min(1,t/0.1)+0.04*max(0,min(1,(t-0.12)/0.1)) -effect_low_type contact -effect_low_obstacle plane:0,0,1,-0.0001 "
           "-time newmark -ts_dt 0.004 -ts_max_time {end} -snes_rtol 1e-10")
# a bar of CR that swings up again: at the checkpoint, step 24, its faces have just lost their pressure
SWING = ("-bodies a -body_a_mesh box:0.4,0.1,0.1:1 -body_a_element cr -body_a_material stable_neohookean -body_a_young 3e4 -body_a_poisson 0.45 "
         "-body_a_density 1000 -effects gravity,clamp -effect_gravity_vector 0,0,-9.81 -effect_clamp_type fixed -effect_clamp_on xmin "
         "-time newmark -ts_dt 0.01 -ts_max_time {end}")
CUBE = ("-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_element cr -body_a_material stable_neohookean -body_a_young 1e4 -body_a_poisson 0.45 "
        "-body_a_density 1000 -effects low,high -effect_low_type fixed -effect_low_on zmin -effect_high_type prescribed_displacement -effect_high_on zmax "
        "-effect_high_displacement ")
COMMON = ("-time euler_implicit -snes_rtol 1e-12 -ksp_rtol 1e-12 -quiet -output_fields none -checkpoint_keep 1 "
          "-checkpoint_every_steps 10 ")
UNLIKE = ("newton", "linear", "rejected")  # what solving took is not compared


def run(ranks, folder, options, fails=False):
    command = [*MPI, str(ranks), SUPPLE, *(COMMON + options).split(), "-output_dir", str(OUT / folder)]
    result = subprocess.run(command, capture_output=True, text=True)
    if (result.returncode != 0) != fails:
        sys.exit(f"{folder}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    return result.stdout + result.stderr


def history(folder):
    with open(OUT / folder / "history.csv", newline="") as f:
        names, _, *rows = csv.reader(f)
    return names, [[float(x) for x in row] for row in rows]


def kind(name):
    """Columns that are measured by the largest of their kind: energies, and the components of a vector."""
    if name.endswith(("work", "loss")) or name in ("kinetic", "strain", "total"):
        return "energy"
    return name[:-2] if name[-2:] in ("_x", "_y", "_z") else name


def compare(a, b, tolerance):
    (names, p), (others, q) = history(a), history(b)
    if names != others or len(p) != len(q):
        sys.exit(f"{b}: {len(q)} rows of {len(others)} columns, in {a} {len(p)} of {len(names)}")
    size = {}
    for k, name in enumerate(names):
        size[kind(name)] = max(size.get(kind(name), 1e-7), *(abs(row[k]) for row in p))
    worst = {}
    for k, name in enumerate(names):
        off = max(abs(r[k] - s[k]) for r, s in zip(p, q)) / size[kind(name)]
        # directions of slip are turned after the last solve, within what friction is settled to: of reactions at the checkpoint
        if name in UNLIKE:
            continue
        account = kind(name) == "energy"
        worst[account] = max(worst.get(account, (0, "")), (off, name))
    print(f"  {b}: {worst[False][1]} is {worst[False][0]:.1e} off, {worst[True][1]} {worst[True][0]:.1e}")
    for account, (off, name) in worst.items():
        if off > (1e-4 if account else tolerance):
            sys.exit(f"{name} differs by {off:.3g} of its size between {a} and {b}")


def check(name, options, end, several, tolerance):
    run(1, f"whole-{name}", options.format(end=end))
    run(1, f"half-{name}", options.format(end=end / 2))
    for ranks in several:
        folder = f"parts-{name}-{ranks}"
        shutil.rmtree(OUT / folder, ignore_errors=True)
        shutil.copytree(OUT / f"half-{name}", OUT / folder)
        run(ranks, folder, options.format(end=end) + " -restart latest")
        compare(f"whole-{name}", folder, tolerance)


def check_elsewhere():
    """The first row of a history in another folder is the row of the checkpoint's step, with the forces of contact."""
    checkpoint = next((OUT / "half-tool-projected").glob("checkpoint_*.h5"))
    run(1, "elsewhere", TOOL.format(end=0.4) + f"projected -restart {checkpoint}")
    (names, whole), (_, rows) = history("whole-tool-projected"), history("elsewhere")
    force = names.index("tool_force_z")
    there = next(row for row in whole if row[0] == rows[0][0])
    if abs(rows[0][force] - there[force]) > 1e-6 * abs(there[force]) or not there[force]:
        sys.exit(f"tool_force_z is {rows[0][force]} in the first row after a restart, and was {there[force]}")


def check_damage():
    """Numbers of the state that were changed are noticed."""
    folder = OUT / "parts-damaged"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(OUT / "half-tool-projected", folder)
    path = next(folder.glob("checkpoint_*.h5"))
    with h5py.File(path, "r+") as f:
        state = f["state_tool"]
        if state.shape[0] < 2:
            sys.exit(f"{path}: {state.shape[0]} nodes in touch")
        state[0, 5] += 1
    text = run(1, "parts-damaged", TOOL.format(end=0.4) + "projected -restart " + str(path), fails=True)
    if "truncated, damaged or not a checkpoint" not in text:
        sys.exit(f"a damaged state is not noticed\n{text}")


def check_begun():
    """A cube pressed to half by load steps is held in time: its faces begin with the forces that they had. Only the gaps around
    edges are of load steps alone, and set off 7e-4 of the strain energy."""
    run(1, "pressed-static", CUBE + "0;0;-0.05*t -time static -static_steps 8")
    state = next((OUT / "pressed-static").glob("checkpoint_*.h5"))
    run(1, "pressed-held", CUBE + f"0;0;-0.05 -ts_dt 0.005 -ts_max_time 0.005 -body_a_state {state}")
    (names, p), (_, q) = history("pressed-static"), history("pressed-held")
    kinetic, strain = q[-1][names.index("kinetic")], p[-1][names.index("strain")]
    print(f"  held: {strain:.3f} J of strain, {kinetic:.1e} J of kinetic energy after a step")
    if not kinetic < 1e-3 * strain:
        sys.exit("a run that begins with a pressed body of CR throws it out of equilibrium")


def main():
    OUT.mkdir(parents=True, exist_ok=True)
    # solves go to 1e-12 of the first residual of a step, and friction settles to 1e-4 by steps that converge quadratically
    check("tool-projected", TOOL + "projected", 0.4, (1, 3), 1e-6)
    check("tool-penalty", TOOL + "penalty", 0.4, (2,), 1e-6)
    check("tool-multiplier", TOOL + "multiplier", 0.4, (1,), 1e-6)
    check("blocks", BLOCKS, 0.2, (1, 3), 1e-6)
    check("deep-projected", DEEP + "projected", 0.1, (2,), 1e-6)
    check("parted", PARTED, 0.6, (1, 3), 1e-5)
    check("corner-projected", CORNER + "projected", 4e-4, (2, 3), 1e-6)
    check("pressed", PRESSED, 0.32, (1, 2), 1e-6)
    check("swing", SWING, 0.48, (1, 3), 1e-6)
    check_begun()
    check_elsewhere()
    check_damage()
    print("contact is taken up as if not interrupted")


main()
