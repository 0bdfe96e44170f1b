"""Restitution of a cube that elastic waves cross less than ten times in a step: said once, by every response that has restitution; not of a stiff one.

@cpu 30
"""
import os
import subprocess
import sys
from pathlib import Path

OUT = Path(os.environ["SB_OUT"])
SUPPLE = os.environ["SB_SUPPLE"]
SCENE = """-bodies a -body_a_mesh box:0.1,0.1,0.1:2,2,2 -body_a_translate 0,0,0.01 -body_a_material linear -body_a_poisson 0.3 -body_a_density 1000
    -effects gravity,floor -effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0 -effect_floor_restitution 0.5 -time euler_implicit -ts_dt 0.005
    -ts_max_time 0.1 -quiet"""
passed = failed = 0

for response in ("projected", "multiplier", "barrier"):
    # 5 crossings in a step, and 50
    for young, wanted in (("1e7", 1), ("1e9", 0)):
        for ranks in (1, 2):
            command = ["scripts/mpi", str(ranks), SUPPLE, *SCENE.split(), "-body_a_young", young, "-effect_floor_response", response, "-output_dir", str(OUT / "run")]
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)
            said = done.stderr.count("restitution is for bodies that are stiff within a step")
            good = done.returncode == 0 and said == wanted and ("body a 5" in done.stderr) == (wanted > 0)
            passed, failed = passed + good, failed + (not good)
            if not good:
                print(f"FAIL {response}, {young} Pa, {ranks} ranks: said {said} times instead of {wanted}: {done.stderr}")

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
