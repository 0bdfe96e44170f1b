"""Parts that touch but do not join, in a mesh that ranks read by slabs: the same warning, or error, as on one rank."""
import itertools
import os
import random
import re
import subprocess
import sys
from pathlib import Path

OUT = Path(os.environ["SB_OUT"])
SUPPLE = os.environ["SB_SUPPLE"]
TOOL = str(Path(SUPPLE).with_name("supple-mesh"))
N = 3
passed = failed = 0


def check(what: str, good: bool, text: str) -> None:
    global passed, failed
    passed, failed = passed + good, failed + (not good)
    if not good:
        print(f"FAILED {what}: {text}")


def mesh(name: str, mirrored: bool, doubled: bool) -> Path:
    """Two blocks of N^3 cubes of six tets; in the right one diagonals may be mirrored, and the side between them may have vertices of its own."""
    number: dict[tuple, int] = {}
    tets = []
    for right in (0, 1):
        for cube in itertools.product(range(N), repeat=3):
            for axes in itertools.permutations(range(3)):
                corner, tet = [0, 0, 0], []
                for axis in (None, *axes):
                    if axis is not None:
                        corner[axis] = 1
                    at = [c + d for c, d in zip(cube, corner)]
                    if right and mirrored:
                        at[1] = N - at[1]
                    at[0] += N * right
                    key = (*at, right if doubled and at[0] == N else 0)
                    tet.append(number.setdefault(key, len(number) + 1))
                tets.append(tet)
    random.Random(3).shuffle(tets)
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(number))]
    lines += [f"{i} {x / N} {y / N} {z / N}" for (x, y, z, _), i in number.items()]
    lines += ["$EndNodes", "$Elements", str(len(tets))] + [f"{i} 4 2 1 1 {a} {b} {c} {d}" for i, (a, b, c, d) in enumerate(tets, 1)] + ["$EndElements", ""]
    path = OUT / f"{name}.msh"
    path.write_text("\n".join(lines))
    subprocess.run([TOOL, "convert", path, path.with_suffix(".h5")], check=True, capture_output=True)
    return path.with_suffix(".h5")


def run(path: Path, ranks: int, element: str) -> tuple[int, list[str]]:
    done = subprocess.run([*os.environ["SB_MPI"].split(), str(ranks), SUPPLE, "-bodies", "a", "-body_a_mesh", str(path), "-body_a_element", element,
                           "-body_a_material", "corotated", "-body_a_young", "1e5", "-body_a_poisson", "0.3", "-body_a_density", "1000",
                           "-mesh_reading", "slabs", "-ts_dt", "0.01", "-ts_max_time", "0.01", "-output_dir", str(OUT / "run"), "-output_overwrite"],
                          capture_output=True, text=True, check=False)
    return done.returncode, [line for line in done.stderr.splitlines() if re.match("supple: (error|warning): .*(facets|falls apart)", line)]


for name, mirrored, doubled, pairs in (("whole", False, False, 0), ("crossing", True, False, 4 * N * N), ("doubled", False, True, 2 * N * N)):
    path = mesh(name, mirrored, doubled)
    for element in ("p1", "cr"):
        results = [run(path, ranks, element) for ranks in (1, 2, 5)]
        code, lines = results[0]
        check(f"{name} {element}: another result on more ranks", all(r == results[0] for r in results), str(results))
        if not pairs:
            check(f"{name} {element}", code == 0 and not lines, str(results[0]))
        else:
            # one body of two parts by vertices already, where they are doubled
            apart = element == "cr" and not doubled
            good = len(lines) == 1 and f"without joining: {pairs} " in lines[0] and ("into 2 parts" in lines[0]) == apart and (code == 1) == apart
            check(f"{name} {element}", good, str(results[0]))
            check(f"{name} {element}: advice", ("supple-mesh repair" in lines[0]) == doubled, str(lines))

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
