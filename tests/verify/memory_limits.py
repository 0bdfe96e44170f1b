"""Limits of memory (ulimit -v, -d): too little for any run, and too little for this one, is one line of error, never a wait.

@cpu 120
"""
import os
import resource
import subprocess
import sys
from pathlib import Path

OUT = Path(os.environ["SB_OUT"])
SUPPLE = os.environ["SB_SUPPLE"]
passed = failed = 0


def run(name: str, limit: int, megabytes: int, cells: int) -> tuple[int, list[str]]:
    """Exit code and error lines of a static bar under a limit of memory."""

    def curb() -> None:
        resource.setrlimit(limit, (megabytes << 20, megabytes << 20))
        resource.setrlimit(resource.RLIMIT_CPU, (30, 30))

    done = subprocess.run(
        [SUPPLE, "-bodies", "bar", "-body_bar_mesh", f"box:0.4,0.1,0.1:{cells}", "-body_bar_material", "linear", "-body_bar_young",
         "1e6", "-body_bar_poisson", "0.3", "-body_bar_density", "1000", "-effects", "gravity,clamp", "-effect_clamp_type", "fixed",
         "-effect_clamp_on", "xmin", "-time", "static", "-solver", "direct", "-output_dir", str(OUT / name)],
        capture_output=True, text=True, check=False, preexec_fn=curb)
    return done.returncode, [line for line in done.stderr.splitlines() if line.strip()]


# name, limit, MiB, cells across, what the line names; "": it runs. 470 MiB are enough for MPI, not for OpenBLAS' buffer as well.
for name, limit, megabytes, cells, words in (
    ("space_200", resource.RLIMIT_AS, 200, 2, ("-v 204800",)),
    ("space_390", resource.RLIMIT_AS, 390, 2, ("-v 399360",)),
    ("space_470", resource.RLIMIT_AS, 470, 2, ("-v 481280",)),
    ("data_150", resource.RLIMIT_DATA, 150, 2, ("-d 153600",)),
    ("enough", resource.RLIMIT_AS, 1024, 2, ()),
    ("enough_data", resource.RLIMIT_DATA, 512, 2, ()),
    ("large_scene", resource.RLIMIT_AS, 600, 40, ("out of memory",)),
):
    code, lines = run(name, limit, megabytes, cells)
    good = code == 0 and not lines if not words else code == 1 and len(lines) == 1 and all(w in lines[0] for w in words)
    passed, failed = passed + good, failed + (not good)
    if not good:
        print(f"FAILED: {name}: exit code {code}, {lines[:5]}")

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
