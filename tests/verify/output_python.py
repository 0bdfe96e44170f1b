"""The package python/supple against the files that it reads; a sweep and a convergence study whose results are known; scripts/plot; the notebook of the guide.

"""
import json
import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy

from output_common import OUT, history, run, scenario

sys.path.insert(0, str(Path("python").resolve()))
import supple

# A linear bar at rest: displacements are proportional to 1 / young.
STATIC = {"time": "static", "output_fields": "displacement", "ksp_rtol": "1e-10"}


def check(condition, text):
    if not condition:
        sys.exit(text)


def refused(function, *words):
    try:
        function()
    except supple.RunError as e:
        check(all(word in str(e) for word in words), f"'{e}' does not name {words}")
        return
    sys.exit(f"no error that names {words}")


def check_run():
    run(2, "run", "-ts_max_time", "0.05", "-quiet")
    it = supple.Run(OUT / "run")
    names, rows = history("run")
    check(list(it.history.dtype.names) == names and numpy.array_equal(it.history["strain"], rows[:, names.index("strain")]), "history")
    check(it.units["strain"] == "J" and it.info["status"] == "completed" and it.bodies == ["bar"], "units, run.json, bodies")
    check(numpy.allclose(it.times, it.history["time"]) and list(it.steps) == list(range(6)) and len(it) == 6, "frames")
    check(numpy.allclose(it.up(), [0, 0, 1]) and not it.is_static, "up")
    moved = numpy.abs(it.positions(-1) - it.field("position", -1)).max()
    check(1e-3 < numpy.abs(it.positions(-1) - it.mesh().x).max() and moved < 1e-6, f"positions differ by {moved}")
    length, unit = it.values("velocity")
    parts = [it.values(f"velocity_{c}")[0] for c in "xyz"]
    check(unit == "m/s" and numpy.allclose(length**2, sum(part**2 for part in parts)), "components of a vector")
    xx = it.values("stress_xx")[0]
    check(numpy.array_equal(xx, it.field("stress")[:, 0].astype(float)), "components of a tensor")

    # the surface is that of the box, closed and seen from outside
    surface, x = it.mesh().surface, it.mesh().x
    corners = x[surface.points][surface.triangles]
    normals = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    check(abs(numpy.linalg.norm(normals, axis=1).sum() - 0.18) < 1e-12, "area of the surface")
    check(abs((corners.mean(axis=1) * normals).sum() / 3 - 0.004) < 1e-12, "volume inside the surface")
    check(numpy.allclose(surface.at_points(x[:, 0]), x[surface.points][:, 0]), "values at the surface's points")
    refused(lambda: it.field("von_mizes"), "von_mizes", "von_mises")
    refused(lambda: it.frame(99), "99", "6")
    refused(lambda: supple.Run(OUT / "nowhere"), "nowhere")


def check_growing():
    """A run that goes on is read again: what was read stays, and a frame that comes while the file is read, behind the end that this had, is met by reading once more."""
    folder = OUT / "growing"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(OUT / "run", folder)
    table, fields = (OUT / "run" / "history.csv").read_text(), (OUT / "run" / "fields.h5").read_bytes()
    lines = table.splitlines(keepends=True)
    (folder / "history.csv").write_text("".join(lines[:4]) + lines[4][:20])
    it = supple.Run(folder)
    mesh, first = it.mesh(-1), it.history.copy()
    (folder / "history.csv").write_text(table)
    it.refresh()
    check(len(first) == 2 and numpy.array_equal(it.history, supple.Run(OUT / "run").history), "rows that have come")
    check(it.mesh(-1) is mesh, "the mesh is read again")

    # the end of the file stands at byte 40: that of a file that lacks its last frame
    cut = fields[:40] + (len(fields) // 2).to_bytes(8, "little") + fields[48:]
    (folder / "fields.h5").write_bytes(cut)
    refused(it.refresh, "fields.h5")

    # a hundred of frames whose group has not come to the disk
    (folder / "fields.h5").write_bytes(fields)
    with h5py.File(folder / "fields.h5", "r+") as file:
        file["/step/1"] = h5py.SoftLink("/nowhere")
    refused(it.refresh, "fields.h5")
    sleep, supple.run.time.sleep = supple.run.time.sleep, lambda _: (folder / "fields.h5").write_bytes(fields)
    it.refresh()
    supple.run.time.sleep = sleep
    check(len(it) == 6 and numpy.allclose(it.positions(-1), supple.Run(OUT / "run").positions(-1)), "the frame that came meanwhile")


def check_sweep():
    table = supple.sweep(scenario(), OUT / "sweep", ranks=2, columns=["max_displacement"], young=[2e5, 4e5], poisson=[0.3, 0.6], **STATIC)
    soft, wrong, stiff, _ = table
    check(list(table["status"][[0, 2]]) == ["completed"] * 2 and (soft["young"], stiff["young"]) == (2e5, 4e5), f"{table}")
    ratio = soft["max_displacement"] / stiff["max_displacement"]
    check(abs(ratio - 2) < 1e-6, f"twice as stiff, and {ratio} times the displacement")
    check("poisson" in wrong["status"] and math.isnan(table["max_displacement"][1]), f"a run that fails: {wrong}")
    refused(lambda: supple.start(scenario(), OUT / "wrong", yuong=1e4), "yuong", "young")


def check_convergence():
    for p, sizes in ((2, (1, 0.5, 0.25)), (1.3, (0.3, 1, 0.7))):
        found = supple.richardson(sizes, [5 - 3 * h**p for h in sizes])
        check(numpy.allclose(found, (p, 5)), f"order {p} and limit 5: {found}")
    check(math.isnan(supple.richardson((1, 2, 3), (1, 2, 1))[0]), "an order where there is none")
    meshes = [f"box:0.1,0.1,0.1:{n},{n},{n}" for n in (3, 6, 12)]
    study = supple.convergence(scenario(), "strain", [0.1 / 3, 0.1 / 6, 0.1 / 12], OUT / "converge", mesh=meshes, **STATIC)
    # the energy of P1 under a given load grows towards its limit, at most with the square of the size
    check(0.8 < study.order < 2.2 and (numpy.diff(study.values) > 0).all() and study.limit > study.values[-1], f"{study}")
    print(study)
    return study


def check_no_convergence():
    """Differences that grow have no order, no limit and no error; values that agree have no error."""
    study = supple.Convergence("strain", (1, 0.5, 0.25), (1.0, 1.1, 1.5))
    check(not study.converges and math.isnan(study.limit) and numpy.isnan(study.errors).all(), f"{study}")
    check("no convergence seen" in str(study) and "nan" not in str(study), f"{study}")
    same = supple.Convergence("strain", (1, 0.5, 0.25), (1.0, 2.0, 2.0))
    check(same.converges and same.limit == 2 and "same value" in str(same), f"{same}")
    folders = []
    for k, value in enumerate(study.values):
        folders.append(OUT / f"grow{k}")
        folders[-1].mkdir(exist_ok=True)
        (folders[-1] / "run.json").write_text("{}")
        (folders[-1] / "history.csv").write_text(f"step,time,strain\n#1,s,J\n0,0,{value}\n")
    told = plot(*folders, "--converge", "-x", "1,0.5,0.25", "-y", "strain", "-o", OUT / "grow.svg")
    text = (OUT / "grow.svg").read_text()
    check("no convergence seen" in told and ">strain (J)<" in text and "no convergence seen" in text and "error" not in text, told)


def check_start():
    """Runs in a loop leave one folder of results; workers compute side by side and give the same table."""
    for _ in range(3):
        supple.start(scenario(), OUT / "loop", **STATIC)
    check(not list((OUT / "loop").glob("before_*")), "folders of earlier runs")
    supple.start(scenario(), OUT / "loop", output_overwrite=False, **STATIC)
    check(len(list((OUT / "loop").glob("before_*"))) == 1, "results that were to be kept")
    tables = [supple.sweep(scenario(), OUT / f"workers{n}", columns=["strain"], workers=n, young=[1e5, 2e5, 3e5], **STATIC) for n in (1, 3)]
    check(numpy.array_equal(tables[0]["strain"], tables[1]["strain"]) and list(tables[1]["young"]) == [1e5, 2e5, 3e5], f"{tables[1]}")
    refused(lambda: supple.sweep(scenario(), OUT / "none", workers=0, young=[1e5]), "workers=0")
    seen, shown = [], supple.study.bar
    supple.study.bar = lambda done, total: seen.append((done, total))
    supple.sweep(scenario(), OUT / "workers3", columns=["strain"], workers=2, young=[1e5, 2e5, 3e5], **STATIC)
    supple.study.bar = shown
    check(seen[-3:] == [(1, 3), (2, 3), (3, 3)], f"bars {seen}")


def check_needed():
    """What other packages are needed for is said, with their names."""
    it, imported = supple.Run(OUT / "run"), supple.run.importlib.import_module
    for missing, call in (("meshio", it.to_meshio), ("pyvista", it.to_pyvista), ("meshio", it.to_pyvista)):
        def without(name, missing=missing):
            if name == missing:
                raise ImportError(f"No module named '{name}'")
            return math
        supple.run.importlib.import_module = without
        refused(call, f"package {missing}", "pip install")
        supple.run.importlib.import_module = imported


def plot(*args, fails=False):
    done = subprocess.run([sys.executable, "scripts/plot", *map(str, args)], capture_output=True, text=True)
    check((done.returncode != 0) == fails, f"plot {args}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    check(not fails or "Traceback" not in done.stderr, done.stderr)
    return done.stdout + done.stderr


def check_plot(study):
    plot(OUT / "run")
    text = (OUT / "run" / "plot.svg").read_text()
    check(all(f">{word}<" in text for word in ("time (s)", "kinetic, strain (J)", "kinetic", "strain")), "labels of the diagram")
    check(re.search(r"fill: #ffffff", text) and re.search(r"fill: #1a1a1a", text), "dark text on white")
    plot(OUT / "run", "-y", "max_displacement", "-y", "strain", "-o", OUT / "two.svg")
    text = (OUT / "two.svg").read_text()
    check(all(f">{words}<" in text for words in ("max displacement (m)", "strain (J)", "max displacement, strain")), "quantities of two units")
    plot(OUT / "run", "-y", "kinetic + strain", "-o", OUT / "sum.svg")
    check(">kinetic + strain (J)<" in (OUT / "sum.svg").read_text(), "unit of a sum")
    plot(OUT / "run", "-y", "kinetic + strain", "-o", OUT / "sum.png")
    check((OUT / "sum.png").stat().st_size > 5000, "a formula of columns")
    runs = [OUT / "converge" / f"{k:04d}" for k in range(3)]
    told = plot(*runs, "--converge", "-x", ",".join(map(str, study.sizes)), "-y", "strain", "-o", OUT / "converge.svg")
    check(f"order {study.order:.3g}" in told, told)
    check("'strian' is neither" in plot(OUT / "run", "-y", "strian", fails=True), "unknown column")


def check_installed():
    """pip puts it elsewhere, with the version of the program."""
    done = subprocess.run([sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation", "--disable-pip-version-check",
                           "--target", str(OUT / "site"), "./python"], capture_output=True, text=True)
    check(done.returncode == 0, f"pip: {done.stdout}{done.stderr}")
    code = ("import importlib.metadata, supple; assert 'site' in supple.__file__; "
            f"print(importlib.metadata.version('supple'), len(supple.Run({str(OUT / 'run')!r})))")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=OUT, env=os.environ | {"PYTHONPATH": str(OUT / "site")})
    version = supple.Run(OUT / "run").info["version"]
    check(done.stdout.split() == [version, "6"], f"installed: {done.stdout}{done.stderr}, version {version}")


def check_notebook():
    """The cells of docs/guides/study.ipynb, one after the other."""
    os.environ["SB_OUT"] = str(OUT / "notebook")
    names = {}
    for cell in json.loads(Path("docs/guides/study.ipynb").read_text())["cells"]:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), "study.ipynb", "exec"), names)
    check(len(names["table"]) == 4 and (names["table"]["status"] == "completed").all(), "the sweep of the notebook")
    check((OUT / "notebook" / "curves.svg").exists(), "the diagram of the notebook")


def check_many_bodies():
    """Names of more bodies than an attribute can hold, 64 KB: a run writes them, the package, a mesh and a state read them."""
    name = "names_of_thirty_one_letters"
    options = {"bodies": name, f"body_{name}_mesh": "box:0.1,0.1,0.1:1", f"body_{name}_material": "linear", f"body_{name}_young": "1e5",
               f"body_{name}_poisson": "0.3", f"body_{name}_copies": "grid:13,13,13,0.2,0.2,0.2", "ts_dt": "0.01", "ts_max_time": "0.01"}
    path = OUT / "many.opts"
    path.write_text("".join(f"-{key} {value}\n" for key, value in options.items()))
    it = supple.start(path, OUT / "many", ranks=2)
    check(len(it.bodies) == 2197 and it.bodies[0] == name + "1" and it.bodies[-1] == name + "2197", "names of many bodies")
    check("bodies" not in it.fields(), "names of bodies are no field")
    path.write_text(path.read_text() + f"-body_{name}_state {OUT / 'many'}\n")
    check(len(supple.start(path, OUT / "many_again", ranks=2).bodies) == 2197, "states of many bodies")


def main():
    check_run()
    check_many_bodies()
    check_growing()
    check_sweep()
    check_no_convergence()
    check_start()
    check_needed()
    check_plot(check_convergence())
    check_installed()
    check_notebook()


if __name__ == "__main__":
    main()
