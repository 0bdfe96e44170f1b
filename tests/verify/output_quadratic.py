"""Bodies of p2 with all their nodes, opened by VTK: linear tets, eight for each of the mesh, or with -output_quadratic quadratic ones. Nodes at edges show a quadratic displacement exactly, on any number of
ranks and beside bodies of other elements; restarts go on with the same; a body of another run begins with such frames, with their energy; python/supple and supple-mesh read them; probes stand at these nodes.

"""
import re
import subprocess
import sys
import types
from pathlib import Path

import h5py
import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOHDF import vtkHDFReader

from output_common import MPI, OUT, SUPPLE

sys.path.insert(0, str(Path("python").resolve()))
import supple

# Bending by prescribed displacements: u = (x z, 0, -x^2 / 2) with nu = 0 and the linear law is in equilibrium under body forces that p2 need not know, as every node is prescribed.
SCENE = ["-bodies", "bar", "-body_bar_mesh", "box:0.2,0.1,0.1:2", "-body_bar_material", "linear", "-body_bar_young", "1e4", "-body_bar_poisson", "0", "-body_bar_density", "1000", "-body_bar_element", "p2",
         "-effects", "bend", "-effect_bend_type", "prescribed_displacement", "-effect_bend_on", "bar", "-effect_bend_displacement", "t*x*z;0;-0.5*t*x^2", "-ts_dt", "0.1", "-ts_max_time", "0.3",
         "-output_fields", "position,displacement,stress,reaction,sets", "-output_quadratic", "yes", "-output_precision", "double", "-checkpoint_every_steps", "1", "-quiet"]
CUT = ["-output_quadratic", "no"]
TOOL = str(Path(SUPPLE).with_name("supple-mesh"))


def run(ranks, folder, *more, fails=""):
    done = subprocess.run([*MPI, str(ranks), SUPPLE, *SCENE, "-output_dir", str(OUT / folder), *more], capture_output=True, text=True)
    if bool(done.returncode) != bool(fails) or fails not in done.stderr:
        sys.exit(f"{folder}: exit code {done.returncode}\n{done.stdout}{done.stderr}")


def check(condition, text):
    if not condition:
        sys.exit(text)


def bent(x, t):
    return t * numpy.stack([x[:, 0] * x[:, 2], 0 * x[:, 0], -0.5 * x[:, 0] ** 2], axis=1)


def opened(folder):
    """The last frame, as VTK has it."""
    reader = vtkHDFReader()
    reader.SetFileName(str(OUT / folder / "fields.vtkhdf"))
    reader.UpdateInformation()
    reader.SetStep(3)
    reader.Update()
    grid = reader.GetOutput()
    return grid if grid.IsA("vtkUnstructuredGrid") else grid.GetPartition(0)


def volumes(x, cells):
    return numpy.linalg.det(x[cells[:, 1:]] - x[cells[:, :1]]) / 6


def first_row(folder):
    lines = (OUT / folder / "history.csv").read_text().splitlines()
    return dict(zip(lines[0].split(","), map(float, lines[2].split(","))))


def last_row(folder):
    lines = (OUT / folder / "history.csv").read_text().splitlines()
    return dict(zip(lines[0].split(","), map(float, lines[-1].split(","))))


for ranks in (1, 3):
    run(ranks, f"on{ranks}")
    grid = opened(f"on{ranks}")
    cells = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 10)
    check(grid.GetNumberOfCells() == len(cells) and grid.GetCellType(0) == 24, "no quadratic tets")
    u, x = vtk_to_numpy(grid.GetPointData().GetArray("displacement")), vtk_to_numpy(grid.GetPoints().GetData())
    rest = x - u
    check(numpy.abs(u - bent(rest, 0.3)).max() < 1e-15, f"displacement of the nodes: {numpy.abs(u - bent(rest, 0.3)).max()}")
    middle = (rest[cells[:, [0, 1, 2, 0, 1, 2]]] + rest[cells[:, [1, 2, 0, 3, 3, 3]]]) / 2
    check(numpy.abs(rest[cells[:, 4:]] - middle).max() < 1e-15, "middle nodes are not where VTK has them")
    check(vtk_to_numpy(grid.GetPointData().GetArray("reaction")).shape == u.shape, "reactions")
    with h5py.File(OUT / f"on{ranks}" / "fields.h5") as file:
        check((file["mesh/cells10"][:, :4] == file["mesh/cells"][:]).all() and file["mesh/set_bar"][:].all() and "Tetrahedron_10" in (OUT / f"on{ranks}" / "fields.xmf").read_text(), "cells10, sets")
        data = {name: file[f"mesh/{name}"][:] for name in ("x", "cells", "cells10")}
    if ranks == 1:
        first = data
    check(all((data[name] == first[name]).all() for name in data), "the file depends on the number of ranks")

# linear tets: each of the mesh is eight, which fill it and have its values; the mesh that is in the file is that of ten nodes
for ranks in (1, 2, 3, 4):
    run(ranks, f"cut{ranks}", *CUT)
    with h5py.File(OUT / f"cut{ranks}" / "fields.h5") as file:
        cut = {name: file[f"mesh/{name}"][:] for name in file["mesh"]} | {name: data[:] for name, data in file["step/0000/000003"].items()}
    check(all((cut[name] == first[name]).all() for name in ("x", "cells10")), f"{ranks} ranks: other points or nodes of tets")
    if ranks == 1:
        one = cut
    check(all((cut[name] == one[name]).all() for name in cut if name != "reaction"), f"{ranks} ranks: the file depends on their number")
    check(numpy.abs(cut["reaction"] - one["reaction"]).max() < 1e-12 * numpy.abs(one["reaction"]).max(), "reactions")
grid = opened("cut3")
cells = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4)
check(len(cells) == 8 * len(first["cells"]) and {grid.GetCellType(c) for c in range(len(cells))} == {10}, "no linear tets")
u, x = vtk_to_numpy(grid.GetPointData().GetArray("displacement")), vtk_to_numpy(grid.GetPoints().GetData())
check(numpy.abs(u - bent(x - u, 0.3)).max() < 1e-15 and len(u) == len(first["x"]), "displacement of the nodes")
parent = vtk_to_numpy(grid.GetCellData().GetArray("parent"))
check((parent == numpy.repeat(numpy.arange(len(first["cells"])), 8)).all(), "parents")
parts, wholes = volumes(one["x"], one["cells"]), volumes(first["x"], first["cells"])
check(parts.min() > 0 and numpy.abs(parts.reshape(-1, 8).sum(axis=1) / wholes - 1).max() < 1e-13, f"volumes of the eight: {parts.min()}")
check(numpy.isin(one["cells"].reshape(-1, 32), first["cells10"]).all() and all(set(a) == set(b) for a, b in zip(one["cells"].reshape(-1, 32), first["cells10"])), "a tet is not cut into parts of its own")
with h5py.File(OUT / "on1" / "fields.h5") as file:
    check((one["stress"] == numpy.repeat(file["step/0000/000003/stress"][:], 8, axis=0)).all(), "stresses of the eight")
    check(numpy.abs(one["reaction"] - file["step/0000/000003/reaction"][:]).max() < 1e-12 * numpy.abs(one["reaction"]).max(), "reactions at the nodes")
run(1, "apart", *CUT, "-output_discontinuous", "yes")
told = {}
for folder in ("on1", "cut3", "apart"):
    done = subprocess.run([TOOL, "info", str(OUT / folder / "fields.h5"), "-step", "3"], capture_output=True, text=True)
    told[folder] = re.findall(r"(?:vertices|tets|volume|curved tets:) +\S+", done.stdout)
check(len(told["on1"]) == 4 and told["on1"] == told["cut3"] == told["apart"], f"the mesh of step 3: {told}")

# python/supple gives other libraries what the file has
sys.modules["meshio"] = types.SimpleNamespace(Mesh=lambda x, cells, **data: cells[0][0])
check([supple.Run(OUT / folder).to_meshio() for folder in ("on3", "cut3")] == ["tetra10", "tetra"], "meshio")

# between bodies of other elements, whose tets are as they are; on any number of ranks
MORE = ["-bodies", "soft,bar,hard", "-sets", "bodies", "-set_bodies_at", "halfspace:1,0,0,1", "-effect_bend_on", "bodies"]
for k, (body, element) in enumerate((("soft", "cr"), ("hard", "p1"))):
    for option, value in (("mesh", "box:0.2,0.1,0.1:1"), ("translate", f"0,{2 * k - 1},0"), ("material", "linear"), ("young", "1e4"), ("poisson", "0"), ("density", "1000"), ("element", element)):
        MORE += [f"-body_{body}_{option}", value]
for name in ("no", "yes"):
    for ranks in (1, 2, 3):
        run(ranks, f"mix_{name}{ranks}", *CUT, *MORE, "-output_discontinuous", name)
        with h5py.File(OUT / f"mix_{name}{ranks}" / "fields.h5") as file:
            mix = {key: file[f"mesh/{key}"][:] for key in file["mesh"]} | {"u": file["step/0000/000003/displacement"][:]}
        if ranks == 1:
            alone = mix
        check(all((mix[key] == alone[key]).all() for key in mix), f"{ranks} ranks, {name}: the file depends on their number")
        ten = mix["cells10"]
        check(len(ten) == 12 + 96 + 12 and (ten[:, 4] >= 0).sum() == 96 and (ten[:12, 4:] == -1).all() and (ten[-12:, 4:] == -1).all(), "nodes of the tets of three bodies")
        check((numpy.bincount(mix["parent"]) == numpy.repeat([1, 8, 1], [12, 96, 12])).all() and (mix["body"] == numpy.repeat([0, 1, 2], [12, 768, 12])).all(), "tets of three bodies")
        own = numpy.unique(mix["cells"][mix["body"] == 1])
        check(numpy.abs(mix["u"][own] - bent(mix["x"][own], 0.3)).max() < 1e-15 and len(own) == (960 if name == "yes" else 225), "displacement beside other elements")
        others = mix["cells"][mix["body"] != 1]
        check((others[:12] == ten[:12, :4]).all() and len(mix["x"]) == len(own) + len(numpy.unique(others)), "points of the others")

it = supple.Run(OUT / "on3")
check(numpy.abs(it.data("displacement", -1) - bent(it.mesh().x, 0.3)).max() < 1e-15 and len(it.mesh().surface.points) < len(it.mesh().x), "python/supple")
check((it.mesh().cells10 == data["cells10"]).all() and "cells10" not in it.fields(), f"cells10 are among the fields {it.fields()}")
run(2, "on1", "-restart", "latest", "-ts_max_time", "0.4")
check(len(supple.Run(OUT / "on1")) == 5, "a restart does not go on with the frames")
run(1, "on1", "-restart", "latest", "-ts_max_time", "0.5", *CUT, fails="-output_quadratic")
run(3, "cut2", *CUT, "-restart", "latest", "-ts_max_time", "0.4")
check(len(supple.Run(OUT / "cut2")) == 5 and len(supple.Run(OUT / "cut2").data("displacement", 4)) == len(first["x"]), "a restart does not go on with linear tets")
run(1, "cut2", "-restart", "latest", "-ts_max_time", "0.5", fails="-output_quadratic")
# frames of vertices only, as they were before
with h5py.File(OUT / "cut4" / "fields.h5", "a") as file:
    del file["mesh/parent"], file["mesh/cells10"]
run(1, "cut4", *CUT, "-restart", "latest", "-ts_max_time", "0.5", fails="-output_quadratic")
run(1, "next", "-body_bar_state", str(OUT / "on3"), "-effect_bend_on", "xmin", "-ts_dt", "1e-9", "-ts_max_time", "1e-9", "-body_bar_element", "p2")
check(numpy.abs(supple.Run(OUT / "next").data("displacement", 0)[:, 2].min() + 0.5 * 0.3 * 0.2**2) < 1e-6, "a state from such frames")
# whose edges are bent: with the energy that it had
STILL = ["-effect_bend_on", "xmin", "-ts_dt", "1e-9", "-ts_max_time", "1e-9", *CUT]
for state, ranks in ((OUT / "cut1", 1), (OUT / "cut3", 3), (OUT / "apart", 1), (f"{OUT / 'mix_no2'},3", 2)):
    run(ranks, "on", *STILL, "-body_bar_state", str(state), "-output_overwrite", "yes")
    energy = first_row("on")["strain"] / last_row("cut3")["strain"] - 1
    check(abs(energy) < 1e-12, f"the strain energy of a state of {state} is off by {energy:.3g}")
# a damaged one is refused, before anything is taken at a number that it holds
(OUT / "damaged").mkdir(exist_ok=True)
for name, row, value in (("parent", 5, 2**31 - 1), ("parent", 5, -1), ("parent", None, None), ("cells10", 5, 2**31 - 1), ("cells10", 5, -1), ("cells10", None, None), ("cells", 5, None)):
    (OUT / "damaged/fields.h5").write_bytes((OUT / "cut1/fields.h5").read_bytes())
    with h5py.File(OUT / "damaged/fields.h5", "a") as file:
        array = file[f"mesh/{name}"][:]
        del file[f"mesh/{name}"]
        if value is not None:
            array.reshape(len(array), -1)[row, -1] = value
        if row is not None:
            file[f"mesh/{name}"] = array if value is not None else array[:row]
    run(1, "on", *STILL, "-body_bar_state", str(OUT / "damaged"), "-output_overwrite", "yes", fails="damaged")
# probes at the middle of an edge: the vertices are multiples of 0.05 m
PROBE = ["-probes", "middle", "-probe_middle_at", "0.126,0.05,0.026", "-probe_middle_fields", "displacement,position,stress"]
for ranks in (1, 3):
    run(ranks, f"probe{ranks}", *PROBE, "-output_fields", "displacement,nodal_stress")
    row = last_row(f"probe{ranks}")
    at = numpy.array([[0.125, 0.05, 0.025]])
    seen = numpy.array([row[f"middle_u{k}"] for k in "xyz"]), numpy.array([row[f"middle_position_{k}"] for k in "xyz"])
    check(numpy.abs(seen[0] - bent(at, 0.3)).max() < 1e-15 and numpy.abs(seen[1] - seen[0] - at).max() < 1e-15, f"a probe at an edge: {seen}")
    # stress: recovered at the node, as the field has it
    with h5py.File(OUT / f"probe{ranks}" / "fields.h5") as file:
        node = numpy.abs(file["mesh/x"][:] - at).sum(axis=1).argmin()
        stress = file["step/0000/000003/nodal_stress"][node]
    check(abs(row["middle_stress_xx"] / stress[0] - 1) < 1e-12, f"stress of a probe at an edge: {row['middle_stress_xx']}, {stress}")
run(1, "mixed", "-body_bar_element", "cr", fails="-output_quadratic")
run(1, "both", "-output_discontinuous", "yes", fails="-output_discontinuous")
print("quadratic tets are what VTK takes for them")
