"""One thread per rank: what a run costs in CPU time does not depend on the threads that libraries are allowed.

A static bar whose solver factors with CHOLMOD, with and without a limit of the OpenMP library's own, and on two ranks beside one. Idle threads that
spin cost several times the CPU time of the run.
"""
import os
import re
import resource
import subprocess
import sys

from output_common import MPI, OUT, SUPPLE

SCENARIO = """
-bodies bar
-body_bar_mesh box:0.4,0.1,0.1:20
-body_bar_material linear
-body_bar_young 1e5
-body_bar_poisson 0.3
-body_bar_density 1000
-effects gravity,hold
-effect_gravity_vector 0,0,-9.81
-effect_hold_type fixed
-effect_hold_on xmin
-time static
-solver cg_two_level
"""


def cpu_of(ranks, **environment):
    """CPU seconds of one run, its launcher and its ranks together, and what it printed."""
    path = OUT / "bar.opts"
    path.write_text(SCENARIO)
    env = {key: value for key, value in os.environ.items() if not key.startswith("OMP_")} | environment
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    result = subprocess.run(MPI + [str(ranks), SUPPLE, str(path), "-output_dir", str(OUT / f"bar{ranks}")],
                            capture_output=True, text=True, env=env)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if result.returncode:
        sys.exit(f"{ranks} ranks: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    return after.ru_utime - before.ru_utime, result.stdout


def main():
    OUT.mkdir(parents=True, exist_ok=True)
    free, text = cpu_of(1)
    limited, _ = cpu_of(1, OMP_THREAD_LIMIT="1")
    two, _ = cpu_of(2)
    checks = [
        (f"the first line says one thread: {text.splitlines()[0]}", re.search("one thread each", text)),
        # without the control of threads: 8 times as much on four cores; the half is for the noise of a busy machine
        (f"{free:.2f} CPU s, with a limit of one thread {limited:.2f}", free < 1.5 * limited + 0.3),
        # two ranks wait for each other by asking again and again, and the launcher takes some tenths of a second
        (f"{two:.2f} CPU s on two ranks, {free:.2f} on one", two < 3 * free + 1.5),
    ]
    for what, passed in checks:
        if not passed:
            print(f"failed: {what}")
    failed = sum(not passed for _, passed in checks)
    print(f"{len(checks) - failed} passed, {failed} failed")
    sys.exit(failed > 0)


main()
