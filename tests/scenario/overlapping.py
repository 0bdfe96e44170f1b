"""Bodies that overlap without a contact between them: one warning at the start, or at the end, with names, depth and place. None for
bodies that touch, share a face up to rounding, or have contact, unless that has not parted them by the end."""
import os
import re
import subprocess
import sys
from pathlib import Path

OUT = Path(os.environ["SB_OUT"])
passed = failed = 0
SCENE = ("-bodies a,b -body_default_material corotated -body_default_young 1e5 -body_default_poisson 0.3 -body_default_density 1000 "
         "-body_a_mesh box:0.1,0.1,0.1:3 -body_b_mesh box:0.1,0.1,0.1:2 -effects gravity -ts_dt 0.01 -ts_max_time 0.02")
MEET = "-effects gravity,meet -effect_meet_type contact"

# options, ranks, when it overlaps and how deep; "": never
for i, (options, ranks, when, depth) in enumerate((
    ("-body_b_translate 0.05,0,0", 1, "start", 0.05),
    ("-body_b_translate 0.05,0,0", 3, "start", 0.05),
    ("-body_b_translate 0,0,0", 2, "start", 0.05),
    ("-body_b_translate 0.05,0,0 -body_a_element dg -body_b_element p2", 2, "start", 0.05),
    ("-body_b_translate 0.09,0.09,0.09", 1, "start", 0.01),
    ("-body_b_translate 0.12,0,0 -body_b_displacement -0.07;0;0", 2, "start", 0.05),
    ("-body_b_translate 0.05,0,0 -body_b_displacement 0.07;0;0", 1, "", 0),
    ("-body_b_translate 0.12,0,0 -body_b_velocity -4;0;0", 2, "end", 0.04),
    ("-body_b_translate 0.1,0,0", 2, "", 0),
    ("-body_b_translate 0.0999999,0,0", 1, "", 0),
    ("-body_b_translate 0.1,0.05,0.02", 1, "", 0),
    ("-body_b_rotate 0,0,1,45 -body_b_translate 0.16,0.08,0", 1, "", 0),
    # bars of five tets that cross without a vertex or centroid in each other: halfway, one through the other, at 45 degrees; one on the other
    ("-body_a_mesh box:1,0.1,0.1:1,1,1 -body_b_mesh box:0.1,1,0.1:1,1,1 -body_b_translate 0.85,-0.05,0.05", 1, "start", 0.05),
    ("-body_a_mesh box:1,0.1,0.1:1,1,1 -body_b_mesh box:0.1,1,0.1:1,1,1 -body_b_translate 0.85,-0.05,0.05", 3, "start", 0.05),
    ("-body_a_mesh box:1,0.02,0.02:1,1,1 -body_b_mesh box:0.1,1,0.1:1,1,1 -body_b_translate 0.8,-0.05,-0.04", 2, "start", 0.043),
    ("-body_a_mesh box:1,0.1,0.1:1,1,1 -body_b_mesh box:1,0.1,0.1:1,1,1 -body_b_rotate 0,0,1,45 -body_b_translate 0.8,-0.1,0.06", 2, "start", 0.04),
    ("-body_a_mesh box:1,0.1,0.1:1,1,1 -body_b_mesh box:0.1,1,0.1:1,1,1 -body_b_translate 0.8,-0.05,0.1", 2, "", 0),
    (f"-body_b_translate 0.05,0,0 {MEET}", 1, "", 0),
    (f"-body_b_translate 0.05,0,0 {MEET} -effect_meet_on a,b", 1, "", 0),
    (f"-body_b_translate 0.05,0,0 {MEET} -effect_meet_obstacle plane:0,0,1,-1", 1, "start", 0.05),
)):
    done = subprocess.run([*os.environ["SB_MPI"].split(), str(ranks), os.environ["SB_SUPPLE"], *SCENE.split(), *options.split(),
                           "-output_dir", str(OUT / str(i))], capture_output=True, text=True, check=False)
    found = re.findall(r"at the (start|end) the bodies 'a' and 'b' overlap, (\S+) m deep at \(", done.stderr)
    good = done.returncode == 0 and [f[0] for f in found] == ([when] if when else [])
    if good and when:
        good = abs(float(found[0][1]) - depth) <= 0.1 * depth
    passed, failed = passed + good, failed + (not good)
    if not good:
        print(f"FAILED: {options} on {ranks}: {done.returncode}, {found}, expected {when} {depth}: {done.stderr[-600:]}")

# an overlap that contact has not parted when the run ends is said then
for apart, said in ("0.05", True), ("0.11", False):
    done = subprocess.run([*os.environ["SB_MPI"].split(), "2", os.environ["SB_SUPPLE"], *SCENE.split(), *MEET.split(), "-body_b_translate", f"{apart},0,0",
                           "-output_dir", str(OUT / f"left{apart}")], capture_output=True, text=True, check=False)
    good = done.returncode == 0 and said == bool(re.search("effect meet: .* at the end", done.stderr))
    passed, failed = passed + good, failed + (not good)
    if not good:
        print(f"FAILED: {apart}: {done.returncode}, {done.stderr[-600:]}")

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
