"""Response `barrier` with invalid scenes: each stops with the reason and the position, or gives the correct motion.

Overlap, coincident bodies, widths larger than edges and plates thinner than the motion of a step are in contact_start.opts and barrier_speed.opts.
@ranks 1 2
@cpu 60
"""
import csv
import os
import subprocess
import sys
from pathlib import Path

SUPPLE, OUT = os.environ["SB_SUPPLE"], Path(os.environ["SB_OUT"])
MPI = [*os.environ["SB_MPI"].split(), os.environ["SB_RANKS"]]
BLOCK = "-bodies block -body_block_mesh box:0.1,0.1,0.1:3 -body_block_material stable_neohookean -body_block_young 1e5 -body_block_poisson 0.3 -body_block_density 1000"
HELD = "-effects hold,plate -effect_hold_type fixed -effect_hold_on zmin"
PLATE = "-effect_plate_type contact -effect_plate_response barrier -effect_plate_verify yes"
ABOVE = "-effect_plate_obstacle box:-0.1,-0.1,0.11,0.2,0.2,0.13"
TIME = "-time euler_implicit -ts_dt 0.01 -ts_max_time 0.1"
found = []


def run(name, *options):
    """Last line of its output, and the history by column; None for its code: it reached its end."""
    out = OUT / name
    result = subprocess.run([*MPI, SUPPLE, *" ".join(options).split(), "-output_dir", str(out), "-quiet"], capture_output=True, text=True)
    rows = []
    if (out / "history.csv").exists():
        with open(out / "history.csv", newline="") as f:
            names, _, *rows = csv.reader(f)
        rows = [dict(zip(names, map(float, row))) for row in rows]
    return result.returncode, result.stdout + result.stderr, rows


def expect(name, what, fine):
    if not fine:
        found.append(f"{name}: {what}")


# a motion without solution: the run stops with time, pair and position, and its output is complete up to there
for name, path, begin, end in (("jumps", "0;0;-0.2*min(max(1e6*(t-0.045),0),1)", 0.04, 0.045), ("leaves", "0;0;-2*t", 0.03, 0.055)):
    code, text, rows = run(name, BLOCK, HELD, PLATE, ABOVE, f"-effect_plate_displacement {path}", TIME)
    expect(name, f"no error: {text}", code != 0)
    for word in ("t = 0.0", "effect plate", "block", "the obstacle", "apart at ("):
        expect(name, f"'{word}' is not in: {text}", word in text)
    expect(name, f"the history ends at {rows[-1]['time'] if rows else None} s", rows and begin - 1e-9 < rows[-1]["time"] < end + 1e-5)

# the same motion with a free block, which is pushed along
code, text, rows = run("free", BLOCK, "-effects plate", PLATE, ABOVE, "-effect_plate_displacement 0;0;-0.4*t", TIME)
expect("free", text, code == 0 and rows[-1]["centre_z"] < 0.05 - 0.4 * 0.1 + 0.02)

# an obstacle with an open surface
(OUT / "open.off").write_text("OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 -1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n")
code, text, _ = run("open", BLOCK, "-effects plate", PLATE, f"-effect_plate_obstacle mesh:{OUT / 'open.off'}", TIME)
expect("open", text, code != 0 and "open.off" in text and "edge" in text)

# bodies whose surfaces that may touch are open there, of each one side: the upper one hangs over the border
two = BLOCK.replace("-bodies block", "-bodies block,high") + (" -body_high_mesh box:0.1,0.1,0.1:3 -body_high_material stable_neohookean -body_high_young 1e5 -body_high_poisson 0.3"
                                                              " -body_high_density 1000 -body_high_translate 0.07,0.03,0.105 -body_high_velocity 0,0,-1")
code, text, rows = run("border", two, "-sets base,top,under -set_base_at plane:0,0,1,0 -set_top_at plane:0,0,1,0.1 -set_under_at plane:0,0,1,0.105",
                       "-effects hold,gravity,meet -effect_hold_type fixed -effect_hold_on base -effect_meet_type contact -effect_meet_response barrier",
                       "-effect_meet_on top,under -effect_meet_verify yes", TIME)
expect("border", text, code == 0 and rows[-1]["inverted"] == 0 and max(row["meet_contacts"] for row in rows) > 0)

# friction without a normal force does nothing: a block falls beside a wall that it does not touch
code, text, rows = run("wall", BLOCK, "-effects gravity,plate", PLATE, "-effect_plate_obstacle plane:1,0,0,-1e-3 -effect_plate_friction 10", TIME)
fallen = 9.81 * 0.1 * 0.11 / 2  # as implicit Euler has it
expect("wall", f"{text} {rows[-1:]}", code == 0 and abs(rows[-1]["centre_z"] - (0.05 - fallen)) < 1e-9 and rows[-1]["plate_friction_loss"] == 0)

# no support either: a static block above a floor is free
code, text, _ = run("above", BLOCK, "-effects gravity,plate", PLATE, "-effect_plate_obstacle plane:0,0,1,-0.01 -effect_plate_friction 1 -time static")
expect("above", text, code != 0 and "block" in text)

for line in found:
    print("FAILED", line)
print(f"{int(not found)} passed, {int(bool(found))} failed")
sys.exit(bool(found))
