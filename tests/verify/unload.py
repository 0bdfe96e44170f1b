"""Shapes without loads: known rest shapes are loaded by a run, and found again from the loaded shapes: a cantilever under its own weight, of P1 and of P2, and an octant of a thick
sphere under pressure. What cannot be unloaded is an error that says why; scripts/unload prints rounds and lines that the program takes.

@cpu 60
"""
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy

from output_common import OUT, SUPPLE

sys.path.insert(0, str(Path("python").resolve()))
import supple
from supple import RunError
from supple.run import Surface

OUT.mkdir(parents=True, exist_ok=True)

BAR = """
-bodies bar
-body_bar_mesh {mesh}
-body_bar_element {element}
-body_bar_material isochoric_neohookean
-body_bar_young {young}
-body_bar_poisson 0.45
-body_bar_density 1000
-effects gravity,clamp
-effect_gravity_vector 0,0,-9.81
-effect_clamp_type fixed
-effect_clamp_on xmin
-time static
-solver direct
"""
SPHERE = """
-bodies sphere
-body_sphere_mesh {mesh}
-body_sphere_element p2
-body_sphere_material isochoric_neohookean
-body_sphere_young 1e5
-body_sphere_poisson 0.45
-effects x,y,z,push
-effect_x_type fixed
-effect_x_on xmin
-effect_x_components x
-effect_y_type fixed
-effect_y_on ymin
-effect_y_components y
-effect_z_type fixed
-effect_z_on zmin
-effect_z_components z
-effect_push_type pressure
-effect_push_on inside
-effect_push_value 8e3
-time static
-static_steps 2
-solver direct
"""


def check(condition, text):
    if not condition:
        sys.exit(text)


def refused(function, *words):
    try:
        function()
    except RunError as e:
        check(all(word in str(e) for word in words), f"'{e}' does not name {words}")
        return
    sys.exit(f"no error that names {words}")


def mesh_of(words, path):
    """A mesh file of supple-mesh, and its vertices and tets."""
    done = subprocess.run([SUPPLE + "-mesh", *words, str(path), "-quiet"], capture_output=True, text=True)
    check(done.returncode == 0, f"{words}: {done.stderr}")
    with h5py.File(path, "r") as file:
        return file["mesh/x"][()], file["mesh/cells"][()]


def loaded(name, scene, rest, **keywords):
    """A scenario whose mesh is the shape at the end of a run from the mesh `rest`, groups and all, and the largest displacement."""
    path = OUT / f"{name}_known.opts"
    path.write_text(scene.format(mesh=rest, **keywords))
    run = supple.start(path, OUT / f"{name}_known", output_fields="displacement", output_precision="double", snes_rtol=1e-10)
    given = OUT / f"{name}_given.h5"
    shutil.copy(rest, given)
    with h5py.File(given, "r+") as file:
        x = file["mesh/x"]
        # the vertices of a mesh are the first points of a run, in their order
        check(numpy.array_equal(run.mesh().x[:len(x)], x[()]), f"{name}: vertices of the run")
        most = numpy.linalg.norm(run.positions(-1)[:len(x)] - x[()], axis=1).max()
        x[...] = run.positions(-1)[:len(x)]
    run.close()
    path = OUT / f"{name}.opts"
    path.write_text(scene.format(mesh=given, **keywords))
    return path, most


def check_cantilever():
    for element, young in ("p1", 4e5), ("p2", 8e5):
        rest = OUT / f"bar_{element}_rest.h5"
        x, cells = mesh_of(["convert", "box:0.4,0.1,0.1:8,2,2"], rest)
        scene, most = loaded(f"bar_{element}", BAR, rest, element=element, young=young)
        check(most > 0.04, f"{element}: the bar bends by {most} m only")
        found = supple.unload(scene, OUT / f"bar_{element}_unload", tolerance=1e-7)
        with h5py.File(found.meshes["bar"], "r") as file:
            off = numpy.linalg.norm(file["mesh/x"][()] - x, axis=1).max()
            check(len(file["groups/name"]) == 6, "groups of the mesh at rest")
        print(f"cantilever, {element}: moves {most:.4g} m; {len(found.rounds)} rounds; {off:.3g} m from the known rest shape")
        check(off < 1e-6 * found.size and found.distances[-1] < 1e-7 < found.distances[0], f"{element}: {off} m off, {found.distances}")
        check(abs(found.volumes["bar"][0] / 0.004 - 1) < 1e-6, f"{found.volumes}")


def sphere(path):
    """Vertices and tets of an octant of a thick sphere, 6 to 10 cm: three cubes, one for each face of a cube that meets in (1, 1, 1), are bent to it and joined."""
    n, r = 3, (0.06, 0.10)
    x, cells = mesh_of(["convert", f"box:1,1,1:{n}"], path)
    shells = []
    for turn in range(3):
        u = numpy.roll(numpy.column_stack([x[:, 0], x[:, 1], numpy.ones(len(x))]), turn, axis=1)
        shells.append(u / numpy.linalg.norm(u, axis=1)[:, None] * (r[0] + (r[1] - r[0]) * x[:, 2:3]))
    points = numpy.concatenate(shells)
    _, first, number = numpy.unique(numpy.round(points, 9), axis=0, return_index=True, return_inverse=True)
    return points[first], number.reshape(-1)[numpy.concatenate([cells + k * len(x) for k in range(3)])]


def write_msh(path, x, tets, groups):
    """gmsh 2.2 with triangles of groups {name: [n][3]}."""
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(groups)), *(f'2 {k} "{name}"' for k, name in enumerate(groups, 1)), "$EndPhysicalNames",
             "$Nodes", str(len(x)), *(f"{k} {a!r} {b!r} {c!r}" for k, (a, b, c) in enumerate(x.tolist(), 1)), "$EndNodes", "$Elements", str(len(tets) + sum(map(len, groups.values())))]
    k = 0
    for number, triangles in enumerate(groups.values(), 1):
        for t in triangles:
            k += 1
            lines.append(f"{k} 2 2 {number} {number} " + " ".join(str(v + 1) for v in t))
    for t in tets:
        k += 1
        lines.append(f"{k} 4 2 0 1 " + " ".join(str(v + 1) for v in t))
    path.write_text("\n".join([*lines, "$EndElements", ""]))


def check_sphere():
    x, tets = sphere(OUT / "cube.h5")
    triangles = Surface(tets, tets)
    faces = triangles.points[triangles.triangles]
    inside = numpy.linalg.norm(x, axis=1) < 0.0601
    groups = {f"{c}min": faces[(abs(x[faces][:, :, k]) < 1e-9).all(axis=1)] for k, c in enumerate("xyz")} | {"inside": faces[inside[faces].all(axis=1)]}
    write_msh(OUT / "sphere.msh", x, tets, groups)
    rest = OUT / "sphere_rest.h5"
    x, tets = mesh_of(["convert", str(OUT / "sphere.msh")], rest)
    scene, most = loaded("sphere", SPHERE, rest)
    found = supple.unload(scene, OUT / "sphere_unload", tolerance=1e-7)
    with h5py.File(found.meshes["sphere"], "r") as file:
        off = numpy.linalg.norm(file["mesh/x"][()] - x, axis=1).max()
    print(f"sphere: {len(tets)} tets, moves {most:.4g} m; {len(found.rounds)} rounds; {off:.3g} m from the known rest shape")
    check(most > 0.002 and off < 1e-6 * found.size, f"{off} m off, {found.distances}")
    check(found.volumes["sphere"][0] < found.volumes["sphere"][1], "a body with a Poisson's ratio below 1/2 is larger under pressure")


def check_refused():
    scene = OUT / "bar_p1.opts"
    refused(lambda: supple.unload(scene, OUT / "no", time="newmark", ts_dt=0.1), "newmark", "static")
    refused(lambda: supple.unload(scene, OUT / "no", bodies=["beam"]), "beam", "bar")
    refused(lambda: supple.unload(scene, OUT / "no", relaxation=3), "relaxation", "3")
    refused(lambda: supple.unload(scene, OUT / "no", rounds=2), "2 rounds", "tolerance")
    # loads that are far too large for the method
    soft = OUT / "soft.opts"
    soft.write_text(scene.read_text().replace("young 400000.0", "young 4e4"))
    refused(lambda: supple.unload(soft, OUT / "no"), "times as far", "smaller")
    # a set that is found by its place, here what hangs lowest in the given shape
    placed = OUT / "placed.opts"
    placed.write_text(scene.read_text().replace("gravity,clamp", "gravity,clamp,pull") + "-sets low\n-set_low_at halfspace:0,0,1,-0.02\n-effect_pull_type traction\n-effect_pull_on low\n-effect_pull_vector 0;0;-1\n")
    refused(lambda: supple.unload(placed, OUT / "no"), "low", "group")
    # a mesh with curved tets, and a pressure under which the given shape buckles
    bent = OUT / "bent.opts"
    bent.write_text(BAR.format(mesh=OUT / "bar_p2_known/fields.h5", element="p2", young=8e5) + "-body_bar_mesh_step -1\n")
    refused(lambda: supple.unload(bent, OUT / "no"), "curved")
    crushed = OUT / "crushed.opts"
    crushed.write_text(SPHERE.format(mesh=OUT / "sphere_given.h5").replace("_element p2", "_element p1").replace("push_value 8e3", "push_value -6e4") + "-static_min_increment 0.1\n")
    refused(lambda: supple.unload(crushed, OUT / "no", rounds=12), "first run", "load factor")


def check_script():
    done = subprocess.run([sys.executable, "scripts/unload", OUT / "bar_p1.opts", "--to", OUT / "script", "--tolerance", "1e-3", "-solver", "direct", "-static_steps", "1"], capture_output=True, text=True)
    check(done.returncode == 0 and "-body_bar_mesh" in done.stdout, done.stdout + done.stderr)
    lines = [line for line in done.stdout.splitlines() if line.startswith("-body_bar_")]
    run = subprocess.run([SUPPLE, str(OUT / "bar_p1.opts"), *" ".join(lines).split(), "-output_dir", str(OUT / "again"), "-output_overwrite", "-quiet"], capture_output=True, text=True)
    check(run.returncode == 0, run.stderr)
    done = subprocess.run([sys.executable, "scripts/unload", OUT / "bar_p1.opts", "--rounds", "1", "--to", OUT / "no"], capture_output=True, text=True)
    check(done.returncode == 1 and "scripts/unload: after 1 rounds" in done.stderr, done.stderr)


for part in (check_cantilever, check_sphere, check_refused, check_script):
    part()
print("shapes without loads: all fine")
