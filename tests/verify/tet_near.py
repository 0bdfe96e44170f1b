"""Finer tets near places, -body_NAME_tet_near and supple-mesh tet -near.

Mean edges inside and far away, growth between, quality against tets of one size, volume; a body that is rotated and translated; 1 and 3 ranks; bad places.
"""
import re
import subprocess
from pathlib import Path

import h5py
import numpy

from output_common import OUT, SUPPLE
from scene_common import check, finish, near, start

TOOL = str(Path(SUPPLE).with_name("supple-mesh"))
PAIRS = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]
HOT = numpy.array([0.5, 0.5, 1.0])


def tool(*words, code=0):
    result = subprocess.run([TOOL, *map(str, words)], capture_output=True, text=True, cwd=OUT)
    check(result.returncode == code, f"{words}: exit code {result.returncode}: {result.stdout}{result.stderr}")
    return result.stdout + result.stderr


def edges(mesh):
    """Middles and lengths of the edges, m."""
    with h5py.File(OUT / mesh) as file:
        x, cells = file["mesh/x"][()], file["mesh/cells"][()]
    pairs = numpy.unique(numpy.sort(cells[:, PAIRS].reshape(-1, 2), axis=1), axis=0)
    return x[pairs].mean(axis=1), numpy.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1)


def quality(mesh):
    text = tool("info", mesh)
    return (float(re.search(r"volume +(\S+) m", text)[1]), float(re.search(r"degrees: (\S+) to", text)[1]),
            float(re.search(r"up to (\S+) \(1 in", text)[1]), int(re.search(r"tets +([\d,]+)", text)[1].replace(",", "")))


def sizes(mesh, distance, size, other, what):
    """Mean edges at the place, where they grow, and far away: those of gmsh are 1.1 to 1.3 of the size, also where that is one for all."""
    x, length = edges(mesh)
    d = distance(x)
    for low, high in ((-1, 0), (0.1, 0.25), (0.5, 9)):
        band = (d > low) & (d <= high)
        wanted = numpy.minimum(other, size + 0.25 * numpy.maximum(0, d[band])).mean()
        print(f"{what}: {band.sum()} edges {low} to {high} m away, {length[band].mean():.4g} m, wanted {wanted:.4g} m")
        check(band.sum() > 20 and wanted < length[band].mean() < 1.4 * wanted, f"{what}: edges {low} to {high} m away: {length[band].mean()}, wanted {wanted}")


# a cube with its surface, of one size and with a place on its top
tool("surface", "box:1,1,1:4", "cube.ply")
tool("tet", "cube.ply", "even.h5", "-size", 0.2, "-surface", "remesh")
text = tool("tet", "cube.ply", "hot.h5", "-size", 0.2, "-near", "sphere:0.5,0.5,1,0.15,0.04")
check("finer near places" in text, text)
sizes("hot.h5", lambda x: numpy.linalg.norm(x - HOT, axis=1) - 0.15, 0.04, 0.2, "sphere")
even, hot = quality("even.h5"), quality("hot.h5")
print(f"of one size: {even}; finer near a place: {hot}")
near(hot[0], 1, 1e-9, "volume, m^3")
check(hot[1] > 0.8 * even[1] and hot[2] < 1.25 * even[2], f"quality {hot} against {even}")
check(2 * even[3] < hot[3] < 20 * even[3], f"{hot[3]} tets, {even[3]} of one size")

# two places, one of them a box within the body; the least size counts
tool("tet", "cube.ply", "two.h5", "-size", 0.2, "-near", "sphere:0,0,0,0.1,0.05; box:0.4,0.2,0.4,0.6,0.8,0.6,0.06")
x, length = edges("two.h5")
for place, size, inside in (("sphere", 0.05, numpy.linalg.norm(x, axis=1) < 0.1), ("box", 0.06, (abs(x - 0.5) < [0.1, 0.3, 0.1]).all(axis=1))):
    check(0.95 * size < length[inside].mean() < 1.5 * size, f"two places, {place}: {length[inside].mean()} m, wanted {size} m")

# where the body is placed: turned by 90 degrees about y and moved, the place is on its side x = 3
tool("tet", "cube.ply", "turned.h5", "-size", 0.2, "-rotate", "0,1,0,90", "-translate", "2,0,5", "-near", "box:3,0.3,4.3,3,0.7,4.7,0.05")
sizes("turned.h5", lambda x: numpy.sqrt((numpy.maximum(0, abs(x - [3, 0.5, 4.5]) - [0, 0.2, 0.2]) ** 2).sum(axis=1)) - 0.05, 0.0625, 0.2, "turned")

# a run: the same tets on 1 and 3 ranks, and those of the tool
SCENE = (f"-bodies a -body_a_mesh {OUT}/cube.ply -body_a_tet_size 0.25 -body_a_tet_near sphere:0.5,0.5,1,0.1,0.08 -body_a_young 1e5 -body_a_poisson 0.3 -body_a_material linear "
         "-effects hold,gravity -effect_gravity_vector 0,0,-9.81 -effect_hold_type fixed -effect_hold_on low -sets low -set_low_at plane:0,0,1,0 -time static -quiet ")
frames = []
for ranks in (1, 3):
    start(f"run{ranks}", SCENE + "-output_precision double -ksp_rtol 1e-12", ranks)
    with h5py.File(OUT / f"run{ranks}" / "fields.h5") as file:
        frames.append((file["mesh/x"][()], file["mesh/cells"][()]))
check(all((a == b).all() for a, b in zip(*frames)), "the mesh depends on the number of ranks")
tool("tet", "cube.ply", "same.h5", "-size", 0.25, "-near", "sphere:0.5,0.5,1,0.1,0.08")
with h5py.File(OUT / "same.h5") as file:
    check((file["mesh/x"][()] == frames[0][0]).all(), "the tool makes other tets")

BAD = (("sphere:0,0,0,1", "sphere:x,y,z,r,size"), ("ball:0,0,0,1,1", "box:x0,y0,z0"), ("sphere:0,0,0,0.1,0", "the size 0"), ("sphere:0,0,0,-1,0.1", "the radius -1"),
       ("box:1,0,0,0,1,1,0.1", "first corner"), ("sphere:0,0,0,0.1,0.5", "not below the 0.25 m"), ("sphere:3,0,0,0.1,0.1", "outside of the body"),
       (";".join(["sphere:0,0,0,0.1,0.1"] * 9), "more than 8"), ("sphere:0,0,0,0.5,1e-4", "give a size"))
for place, said in BAD:
    text = tool("tet", "cube.ply", "never.h5", "-size", 0.25, "-near", place, code=1)
    check(said in text and "-near" in text or said == "give a size" and said in text, f"{place}: no '{said}' in: {text}")
    check(len(text.splitlines()) == 1, f"{place}: {text}")
text = tool("tet", "cube.ply", "never.h5", "-tetrahedralizer", "tetgen", "-near", "sphere:0,0,0,0.1,0.1", code=1)
check("one size only" in text, text)
text = start("bad", SCENE + "-body_a_tet_near sphere:3,0,0,0.1,0.1", 1, code=1)
check("-body_a_tet_near" in text and "outside of the body" in text, text)
finish()
