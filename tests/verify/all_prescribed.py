"""Scenes in which every unknown, or every one at vertices, is prescribed: each solver that may have nothing to do ends the run, static and in time.

@cpu 100
"""
import os
import subprocess
import sys
from pathlib import Path

OUT = Path(os.environ["SB_OUT"])
SUPPLE = os.environ["SB_SUPPLE"]
SCENE = "-bodies a -body_a_mesh box:1,1,1:2 -body_a_material linear -body_a_young 1e5 -body_a_poisson 0.49 -body_a_density 1000 -effects hold,move " \
    "-effect_hold_type fixed -effect_move_type gravity -quiet"
TIMES = {"static": "-time static", "time": "-time euler_implicit -ts_dt 0.01 -ts_max_time 0.02"}
CASES = [(element, solver) for element in ("p1", "p2", "cr", "dg") for solver in ("cg_gamg", "cg_hypre", "cg_two_level", "direct")]
CASES += [("p2", "cg_p_multigrid"), *((element, "pressure") for element in ("p2", "cr", "dg")), ("p1", "rotated"), ("p1", "sor"), ("p1", "auto")]
passed = failed = 0

for element, solver in CASES:
    for kind, time in TIMES.items():
        # all nodes; or those of the surface, with faces and edges inside that are free
        for held in ("a", "xmin,xmax,ymin,ymax,zmin,zmax"):
            ranks = 1 + (held == "a")
            if held != "a" and solver not in ("cg_gamg", "pressure"):
                continue
            command = ["scripts/mpi", str(ranks), SUPPLE, *SCENE.split(), *time.split(), "-body_a_element", element, "-solver", solver, "-effect_hold_on", held,
                       "-output_dir", str(OUT / "run")]
            if held != "a":
                command[command.index("box:1,1,1:2")] = "box:1,1,1:1"
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)
            text = done.stdout + done.stderr
            good = done.returncode == 0 and "PETSC ERROR" not in text
            passed, failed = passed + good, failed + (not good)
            if not good:
                print(f"FAIL {element} {solver} {kind} {held}, {ranks} ranks: {text[:600]}")

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
