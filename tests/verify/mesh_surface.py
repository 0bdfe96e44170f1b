"""supple-mesh surface: the boundary of tets as .stl, .obj and .ply, which tet fills again to the same volume.

Triangles are read here, and looked at: closed, seen from outside, their areas; of one region, body or surface; of the last frame of a run; with curved edges.
"""
import subprocess
from pathlib import Path

import h5py
import numpy

from output_common import OUT, SUPPLE
from scene_common import check, finish, near, start

TOOL = str(Path(SUPPLE).with_name("supple-mesh"))
CUBES = str(Path(__file__).resolve().parent.parent / "data" / "two_cubes_41.msh")


def tool(*words, code=0):
    result = subprocess.run([TOOL, *map(str, words)], capture_output=True, text=True, cwd=OUT)
    text = result.stdout + result.stderr
    check(result.returncode == code, f"supple-mesh {words}: exit code {result.returncode}: {text}")
    if code:
        check(len(result.stderr.splitlines()) == 1, f"more than one line: {text}")
    return text


def read(name):
    """Corners of the triangles of a file, [n][3][3], and the vertices of each, by position in an .stl."""
    data = (OUT / name).read_bytes()
    if name.endswith(".stl"):
        check(len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"), f"{name}: {len(data)} bytes")
        rows = numpy.frombuffer(data[84:], dtype=numpy.dtype([("normal", "<f4", 3), ("x", "<f4", (3, 3)), ("none", "<u2")]))
        x = rows["x"].astype(float)
        normal = numpy.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        near(abs(rows["normal"] - normal / numpy.linalg.norm(normal, axis=1)[:, None]).max(), 0, 1e-6, f"{name}: normals")
        _, number = numpy.unique(x.reshape(-1, 3), axis=0, return_inverse=True)
        return x, number.reshape(-1, 3)
    if name.endswith(".ply"):
        head, _, body = data.partition(b"end_header\n")
        n, m = (int(line.split()[-1]) for line in head.decode().splitlines() if line.startswith("element"))
        x = numpy.frombuffer(body[:24 * n], dtype="<f8").reshape(n, 3)
        triangles = numpy.frombuffer(body[24 * n:], dtype=numpy.dtype([("n", "u1"), ("v", "<i4", 3)]))
        check(len(triangles) == m and (triangles["n"] == 3).all(), f"{name}: {len(triangles)} triangles")
        return x[triangles["v"]], triangles["v"]
    lines = [line.split() for line in data.decode().splitlines()]
    x = numpy.array([[float(word) for word in line[1:]] for line in lines if line[0] == "v"])
    v = numpy.array([[int(word) - 1 for word in line[1:]] for line in lines if line[0] == "f"])
    return x[v], v


def measure(name):
    """Area, and volume by Gauss's theorem; every edge once in each direction."""
    x, v = read(name)
    edges = {(int(t[k]), int(t[(k + 1) % 3])) for t in v for k in range(3)}
    check(len(edges) == 3 * len(v) and all((b, a) in edges for a, b in edges), f"{name} is not closed and of one orientation")
    area = numpy.linalg.norm(numpy.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1).sum() / 2
    return area, numpy.einsum("ij,ij->i", x[:, 0], numpy.cross(x[:, 1], x[:, 2])).sum() / 6


def volume(mesh):
    return float(next(line.split()[1] for line in tool("info", mesh).splitlines() if line.split()[:1] == ["volume"]))


# the surface of two cubes, and back
for end, tolerance in (("stl", 1e-6), ("obj", 1e-12), ("ply", 1e-12)):
    text = tool("surface", CUBES, f"whole.{end}", "-scale", "0.3", "-rotate", "1,2,3,40", "-translate", "0.1,0.2,0.3")
    check("around 0.054 m^3" in text, text)
    area, inside = measure(f"whole.{end}")
    near(area, 0.9, 0.9 * tolerance, f".{end}: area, m^2")
    near(inside, 0.054, 0.054 * tolerance, f".{end}: volume, m^3")
    tool("tet", f"whole.{end}", "back.h5", "-surface", "keep")
    near(volume("back.h5"), 0.054, 0.054 * tolerance + 1e-8, f".{end}, filled again: volume, m^3")
tool("surface", CUBES, "groups.obj")
tool("tet", "groups.obj", "groups.h5", "-surface", "keep")
text = " ".join(tool("info", "groups.h5").split())
check("both_ends 8 triangles, 2 m^2" in text and "wall 4 triangles, 1 m^2" in text, f"groups of an .obj: {text}")

# one region, with its side towards the other one, and one surface; a blank is an underscore
tool("surface", CUBES, "left.ply", "-group", "left")
area, inside = measure("left.ply")
near(area, 6, 1e-12, "one region: area, m^2")
near(inside, 1, 1e-12, "one region: volume, m^3")
check("around" not in tool("surface", CUBES, "ends.ply", "-group", "both_ends"), "a volume of an open surface")
x, _ = read("ends.ply")
normal = numpy.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
near((normal[:, 0] * numpy.sign(x[:, 0, 0] - 1)).sum() / 2, 2, 1e-12, "a surface of two sides: area seen from outside, m^2")

# a box of a run, pulled to 1.2 of its length, with the body beside it left out
start("pull", "-bodies a,b -body_a_mesh box:1,1,1:2 -body_b_mesh box:1,1,1:1 -body_b_translate 3,0,0 -body_a_material linear -body_a_young 1e5 -body_a_poisson 0 "
      "-body_b_material linear -body_b_young 1e5 -body_b_poisson 0 -effects hold,pull,rest -effect_hold_type fixed -effect_hold_on a.xmin -effect_rest_type fixed -effect_rest_on b "
      "-effect_pull_type prescribed_displacement -effect_pull_on a.xmax -effect_pull_components x -effect_pull_displacement 0.2;0;0 -time static -quiet -output_precision double", 2)
for step, expected in (("0", 1), ("-1", 1.2)):
    tool("surface", "pull/fields.h5", "a.ply", "-group", "a", "-step", step)
    near(measure("a.ply")[1], expected, 1e-7, f"body a at step {step}: volume, m^3")

# one tet with the node of an edge off its middle: sixteen triangles, and the volume that three quarters of two facets sweep
tool("convert", str(Path(CUBES).with_name("one_tet.msh")), "tet.h5")
tool("surface", "tet.h5", "straight.ply")
with h5py.File(OUT / "tet.h5", "r+") as file:
    ends = sorted(int(i) for i in file["mesh/cells"][0][:2])
    at = file["mesh/x"][()][ends]
    file["mesh/curved_edges"], file["mesh/edge_offsets"] = numpy.array([ends], dtype="int32"), numpy.array([[0.0, -0.1, -0.1]])
    file.attrs["supple_mesh"] = numpy.int32(2)
check("four flat triangles" in tool("surface", "tet.h5", "curved.ply"), "curved edges: no note")
x, v = read("curved.ply")
check(len(v) == 16, f"curved edges: {len(v)} triangles")
near(abs(x.reshape(-1, 3) - at.mean(axis=0) - [0, -0.1, -0.1]).sum(axis=1).min(), 0, 1e-15, "the node of the curved edge, m")
flat, _ = read("straight.ply")
both = numpy.array([all((abs(t - end).sum(axis=1) < 1e-12).any() for end in at) for t in flat])
swept = (numpy.cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0])[both] / 2 @ [0, -0.1, -0.1]).sum() / 3 * 0.75
near(measure("curved.ply")[1] - measure("straight.ply")[1], swept, 1e-15, "volume by the curved edge, m^3")
check(abs(swept) > 1e-3, "the edge is not curved")

# what cannot be done, in one line each
for words, said in (((CUBES, "a.gif"), ("a.gif", ".stl, .obj")), ((CUBES, "a.stl", "-group", "nix"), ("-group nix", "left", "wall")), (("whole.stl", "b.stl"), ("whole.stl", "already")),
                    ((CUBES, "/proc/a.stl"), ("/proc/a.stl",)), (("nix.msh", "a.stl"), ("nix.msh",)), ((CUBES, "a.stl", "-size", "1"), ("-size", "surface"))):
    text = tool("surface", *words, code=1)
    for word in said:
        check(word in text, f"{words}: no '{word}' in: {text}")
check("-group" in tool("info", CUBES, "-group", "left", code=1), "-group of another command")
check("single precision" in tool("surface", "box:0.1,0.1,0.1:1", "far.stl", "-translate", "1000.03,0,0"), "rounding of an .stl far away")
check(not (OUT / "a.stl").exists() and not (OUT / "a.stl.part").exists(), "a file was left")
finish()
