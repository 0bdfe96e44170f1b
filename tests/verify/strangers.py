"""Files from others: options that would run programs, .petscrc, the environment, links and pipes in a run's folder, HDF5 files whose numbers are elsewhere, formulas that are commands.

@cpu 200
"""
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy

from output_common import MPI, OUT, SUPPLE, scenario

sys.path.insert(0, str(Path("python").resolve()))
import supple
from supple.run import RunError

SHORT = ["-ts_max_time", "0.02", "-quiet"]


def check(condition, text):
    if not condition:
        sys.exit(text)


def run(folder, *more, ranks=1, file=None, fails=False, environment=None):
    """Of the small bar, in OUT; what it says."""
    done = subprocess.run([*MPI, str(ranks), SUPPLE, str(file or scenario()), "-output_dir", str(OUT / folder), *map(str, more)], capture_output=True,
                          text=True, cwd=OUT, env=os.environ | (environment or {}), timeout=500)
    check((done.returncode != 0) == fails, f"{folder} {more}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def error(folder, *more, **options):
    lines = [line for line in run(folder, *more, fails=True, **options).splitlines() if line.startswith("supple: error:")]
    check(len(lines) == 1, f"{folder}: {lines}")
    return lines[0]


def names(text, *words):
    check(all(word in text for word in words), f"'{text}' does not name {words}")


def check_options():
    """Options of files that run programs are refused in every way to write them, by files in files, too."""
    library = OUT / "library.so"
    library.write_text("no library")
    bar = scenario().read_text()
    for name, text in (("plain.opts", f"-dll_append {library}"), ("capitals.opts", f"-DLL_Append {library}"), ("first.opts", f"-dll_prepend {library}"),
                       ("prefix.opts", f"-prefix_push dll_\n-append {library}\n-prefix_pop"), ("debugger.opts", "-start_in_debugger gdb"),
                       ("crash.opts", "-on_error_attach_debugger gdb"), ("film.opts", "-draw_save a.mp4"), ("python.opts", "-ksp_python_type evil.ksp")):
        (OUT / name).write_text(bar + text + "\n")
        names(error("refused", file=OUT / name).replace("DLL_A", "dll_a"), name, "-dll_append" if name == "prefix.opts" else text.split()[0].lower())
    (OUT / "inner.opts").write_text(f"-dll_append {library}\n")
    (OUT / "outer.opts").write_text(bar + f"-options_file {OUT / 'inner.opts'}\n")
    names(error("refused", file=OUT / "outer.opts"), "-dll_append")
    names(error("refused", "-options_file", OUT / "inner.opts", ranks=2), "inner.opts", "-dll_append")
    (OUT / "nested.yml").write_text(f"dll:\n  append: {library}\n")
    names(error("refused", "-options_file", OUT / "nested.yml"), "nested.yml", "-dll_append")
    check(not (OUT / "refused").exists(), "a scenario that is refused left a folder")

    (OUT / "itself.opts").write_text(f"-options_file {OUT / 'itself.opts'}\n")
    names(error("refused", file=OUT / "itself.opts"), "itself.opts", "names itself")

    # a pipe as scenario is an error at once
    os.mkfifo(OUT / "pipe.opts")
    names(error("refused", file=OUT / "pipe.opts"), "pipe.opts", "regular")


def check_environment():
    """.petscrc of the working folder is not read; the environment counts, and is listed."""
    bad = "-body_bar_young 1e3\n"
    for name in (".petscrc", "petscrc"):
        (OUT / name).write_text(bad)
    run("plain", *SHORT)
    for name in (".petscrc", "petscrc"):
        (OUT / name).unlink()
    about = json.loads((OUT / "plain/run.json").read_text())
    check(about["bodies"][0]["young"] == 5e4, "a .petscrc changed the material")
    check(about["options_of_environment"] == "" and "skip_petscrc" not in about["options"], "options of the environment")
    check("skip_petscrc" not in (OUT / "plain/scenario.opts").read_text(), "scenario.opts has options that nobody gave")
    text = run("environment", "-ts_max_time", "0.02", "-body_bar_poisson", "0.2", ranks=2, environment={"PETSC_OPTIONS": "-body_bar_density 500 -body_bar_poisson 0.1"})
    names(text, "environment", "-body_bar_density 500")
    about = json.loads((OUT / "environment/run.json").read_text())
    check(about["options_of_environment"] == "-body_bar_density 500" and about["bodies"][0]["density"] == 500, f"{about['options_of_environment']}")


def check_links():
    """Nothing outside the folder is written through links that lie in it."""
    victim = OUT / "victim.txt"
    marks = [".supple_tries_to_write", "run.json", "run.json.tmp", "scenario.opts", "scenario.opts.tmp", "history.csv", "history.csv.tmp", "fields.h5", "fields.xmf",
             "fields.xmf.tmp", "fields.vtkhdf.tmp", "checkpoint.tmp", "checkpoint_000002.h5", "ledger.csv"]
    for ranks in (1, 2):
        victim.write_text("mine")
        folder = OUT / f"links{ranks}"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for name in marks:
            (folder / name).symlink_to(victim)
        run(folder.name, *SHORT, "-checkpoint_every_steps", "1", "-output_overwrite", "yes", ranks=ranks)
        check(victim.read_text() == "mine", f"the run wrote through a link, on {ranks} ranks")
        check(len(supple.Run(folder)) == 3 and not (folder / "fields.h5").is_symlink(), "the results are incomplete")
    folder = OUT / "locked"
    folder.mkdir()
    for make in ((folder / ".supple_running").symlink_to, (folder / ".supple_running").hardlink_to):
        make(victim)
        names(error("locked", *SHORT), ".supple_running", "link")
        check(victim.read_text() == "mine", "the lock was written through a link")
        (folder / ".supple_running").unlink()
    run("locked", *SHORT)
    check(not (folder / ".supple_running").exists(), "the lock stays")

    # a pipe as live.txt, and one without an end: said, not waited for
    for name in ("pipe", "zero"):
        folder = OUT / f"live_{name}"
        folder.mkdir()
        os.mkfifo(folder / "live.txt") if name == "pipe" else (folder / "live.txt").symlink_to("/dev/zero")
        more = ["-effects", "gravity,hold,pull", "-effect_pull_type", "traction", "-effect_pull_on", "xmax", "-effect_pull_vector", "live", "-live_pace", "0"]
        names(run(folder.name, *SHORT, *more, "-effect_pull_on", "xmax"), "live.txt", "regular")
    with open(OUT / "long.txt", "w") as file:
        file.truncate(1 << 30)
    os.mkfifo(OUT / "pipe.txt")
    for name in ("pipe.txt", "long.txt", "/dev/zero"):
        where = OUT / name
        names(error("no", *SHORT, "-body_bar_copies", where), "-body_bar_copies", name)
        names(error("no", *SHORT, "-effects", "gravity,hold,pull", "-effect_pull_type", "prescribed_displacement", "-effect_pull_on", "xmax",
                    "-effect_pull_displacement", f"table:{where};0;0"), "-effect_pull_displacement", name)
        names(error("no", *SHORT, "-body_bar_mesh", f"{where}" if name[0] == "/" else where), name)


def spoil(path, name, how):
    """Replaces an array of an HDF5 file by one whose numbers are elsewhere."""
    with h5py.File(path, "r+") as file:
        shape, kind = file[name].shape, file[name].dtype
        del file[name]
        if how == "external storage":
            numpy.zeros(shape, dtype=kind).tofile(OUT / "raw.bin")
            file.create_dataset(name, shape, kind, external=[(str(OUT / "raw.bin"), 0, int(numpy.prod(shape)) * kind.itemsize)])
        elif how == "virtual":
            with h5py.File(OUT / "source.h5", "w") as source:
                source["a"] = numpy.zeros(shape, dtype=kind)
            layout = h5py.VirtualLayout(shape, kind)
            layout[:] = h5py.VirtualSource(OUT / "source.h5", "a", shape)
            file.create_virtual_dataset(name, layout)
        elif how == "external link":
            with h5py.File(OUT / "source.h5", "w") as source:
                source["a"] = numpy.zeros(shape, dtype=kind)
            file[name] = h5py.ExternalLink(str(OUT / "source.h5"), "/a")
        else:
            file["elsewhere"] = numpy.zeros(shape, dtype=kind)
            file[name] = h5py.SoftLink("/elsewhere")


def check_h5():
    run("good", *SHORT, "-checkpoint_every_steps", "1")
    mesh = OUT / "mesh.h5"
    tool = Path(SUPPLE).with_name("supple-mesh")
    done = subprocess.run([str(tool), "convert", str(OUT / "good/fields.h5"), str(mesh)], capture_output=True, text=True)
    check(done.returncode == 0, done.stdout + done.stderr)
    for how in ("external storage", "virtual", "external link", "soft link"):
        said = "link" if "link" in how else "other files"
        folder = OUT / "bad"
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(OUT / "good", folder)
        frame = "/step/0000/000002"
        spoil(folder / "fields.h5", f"{frame}/displacement", how)
        names(error("state", *SHORT, "-body_bar_state", folder), "-body_bar_state", "displacement", said)
        names(error("bad", "-ts_max_time", "0.03", "-quiet", "-restart", "latest", ranks=2), "fields.h5", "displacement", said)
        try:
            supple.Run(folder).positions(-1)
            sys.exit(f"{how} was read by the Python package")
        except RunError as e:
            names(str(e), "fields.h5", "displacement", said)
        shutil.copyfile(OUT / "good/checkpoint_000002.h5", folder / "checkpoint_000002.h5")
        spoil(folder / "checkpoint_000002.h5", "u", how)
        names(error("state", *SHORT, "-restart", folder / "checkpoint_000002.h5"), "checkpoint_000002.h5", "/u", said)
        spoiled = OUT / "spoiled.h5"
        shutil.copyfile(mesh, spoiled)
        spoil(spoiled, "/mesh/x", how)
        for ranks in (1, 2):
            names(error("state", *SHORT, "-body_bar_mesh", spoiled, ranks=ranks), "spoiled.h5", "/mesh/x", said)


def check_formulas():
    """A scenario whose formula is a command of Python is drawn by no command: an error."""
    folder = OUT / "command"
    shutil.copytree(OUT / "good", folder)
    hacked = OUT / "hacked"
    command = f"[c for c in ().__class__.__base__.__subclasses__() if c.__name__=='Popen'][0](['touch','{hacked}'])"
    for text in (f"-effect_floor_displacement {command};0;0", f"-effect_floor_angle \"{command}\""):
        (folder / "scenario.opts").write_text(f"-bodies bar\n-effects floor\n-effect_floor_type contact\n-effect_floor_obstacle sphere:0,0,0,1\n{text}\n")
        try:
            supple.obstacles(supple.Run(folder))[0].pose(0)
            sys.exit("a command passes for a formula")
        except RunError as e:
            names(str(e), "-effect_floor_", "column 1")
    check(not hacked.exists(), "a formula of a scenario ran a command")


if __name__ == "__main__":
    shutil.rmtree(OUT, ignore_errors=True)
    scenario()
    check_options()
    check_environment()
    check_links()
    check_h5()
    check_formulas()
