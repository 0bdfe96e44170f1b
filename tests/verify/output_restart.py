"""A run that is taken up from a checkpoint, on another number of ranks, is the run that was not interrupted.

Displacement, velocity and acceleration of the last frame and every row of history.csv are compared, for every element and
for all of them in one scene. Also: damaged checkpoints, the newest one that is whole, checkpoints that do not fit the run,
a folder with a long path.
"""
import re
import shutil
import sys

import h5py
import numpy

from output_common import ELEMENTS, OUT, frames, history, run

WHOLE = ["-output_precision", "double", "-quiet", "-checkpoint_every_steps", "10", "-checkpoint_keep", "3"]
# The solves to rounding, so that different sums of different rank counts do not grow.
WHOLE += ["-ksp_rtol", "1e-13", "-body_bar_material", "corotated", "-snes_rtol", "1e-12"]


def last_frame(folder):
    time, group = frames(folder)[-1]
    with h5py.File(OUT / folder / "fields.h5", "r") as f:
        return time, {name: f[group][name][()] for name in ("displacement", "velocity", "acceleration")}


def compare(a, b, tolerance, rows_tolerance):
    (t, left), (s, right) = last_frame(a), last_frame(b)
    if t != s:
        sys.exit(f"{a} ends at {t}, {b} at {s}")
    for name in left:
        worst = numpy.abs(left[name] - right[name]).max() / numpy.abs(left[name]).max()
        if not worst <= (10 * tolerance if name == "acceleration" else tolerance):  # a difference of velocities: 1.0e-10 with dg on 3 ranks
            sys.exit(f"{name} differs by {worst:.3g} between {a} and {b}")
    (names, p), (others, q) = history(a), history(b)
    if names != others or p.shape != q.shape or not numpy.array_equal(p[:, 0], numpy.arange(len(p))):
        sys.exit(f"{b}: history.csv has {q.shape} numbers, that of {a} has {p.shape}; steps {q[:, 0]}")
    for k, name in enumerate(names):
        if name in ("newton", "linear", "min_J"):
            continue
        kind = "strain" if name in ("kinetic", "load_work", "prescribed_work", "damping_loss", "integrator_loss", "total") else name[:-1]
        scale = max(numpy.abs(p[:, i]).max() for i, n in enumerate(names) if n == name or n == kind or n[:-1] == kind)
        worst = numpy.abs(p[:, k] - q[:, k]).max()
        if not worst <= rows_tolerance * scale:
            sys.exit(f"history column {name} differs by {worst:.3g} of {scale:.3g} between {a} and {b}")


def check_reproduction(name, several, *options):
    """Uninterrupted on 2 ranks; stopped at step 10 and taken up on several numbers of ranks."""
    run(2, f"whole-{name}", *WHOLE, *options)
    run(2, f"half-{name}", *WHOLE, *options, "-ts_max_time", "0.1")
    for ranks in several:
        folder = f"parts-{name}-{ranks}"
        shutil.rmtree(OUT / folder, ignore_errors=True)
        shutil.copytree(OUT / f"half-{name}", OUT / folder)
        text = run(ranks, folder, *WHOLE[:2], *WHOLE[3:], *options, "-restart", "latest", "-progress", "false")
        if "checkpoint_000010.h5: step 10, t = 0.1 s" not in text:
            sys.exit(f"{folder}: the restart does not say from where\n{text}")
        # a few hundred roundings of forces up to 1e4 times the smallest ones
        compare(f"whole-{name}", folder, 1e-10, 1e-9)
    print(f"{name}: taken up on {several} ranks as if not interrupted")


def expect(pattern, *more, folder="damaged"):
    text = run(2, folder, *WHOLE, *more, fails=True)
    lines = [line for line in text.splitlines() if "error:" in line]
    if len(lines) != 1 or not re.search(pattern, lines[0]):
        sys.exit(f"{more}: expected one line with '{pattern}'\n{text}")


def truncate(path, part):
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * part)])


def check_damage():
    folder = OUT / "damaged"
    shutil.rmtree(folder, ignore_errors=True)
    run(2, "damaged", *WHOLE)
    kept = sorted(path.name for path in folder.glob("checkpoint_*"))
    if kept != ["checkpoint_000010.h5", "checkpoint_000020.h5"]:
        sys.exit(f"checkpoints {kept}")
    for path in folder.glob("checkpoint_*"):
        shutil.copy(path, OUT / path.name)
    # one number changed in the middle of a vector
    with h5py.File(folder / "checkpoint_000020.h5", "r+") as f:
        f["v"][17, 1] += 1e-9
    expect(r"cannot restart from \S+000020.h5: it is truncated, damaged or not a checkpoint", "-restart", folder / "checkpoint_000020.h5")
    text = run(2, "damaged", *WHOLE[:2], *WHOLE[3:], "-restart", "latest", "-ts_max_time", "0.15")
    if not re.search(r"warning: \S+000020.h5 is truncated or damaged", text) or "000010.h5: step 10" not in text:
        sys.exit(f"latest did not fall back to step 10\n{text}")
    if sorted(path.name for path in folder.glob("checkpoint_*"))[-1] != "checkpoint_000015.h5":
        sys.exit(f"after the restart there is {sorted(folder.glob('checkpoint_*'))}")
    for part in (0, 0.5, 0.999):
        shutil.copy(OUT / "checkpoint_000020.h5", folder / "cut.h5")
        truncate(folder / "cut.h5", part)
        expect("cut.h5: it is truncated, damaged or not a checkpoint", "-restart", folder / "cut.h5")
    expect("nowhere.h5: there is no such file", "-restart", "nowhere.h5")
    expect("there is no checkpoint in", "-restart", "latest", folder="empty")
    print("damaged checkpoints are refused, the newest whole one is found")


def check_fit():
    whole = OUT / "checkpoint_000020.h5"
    expect(r"made with '-body_bar_young 5e4', this run has '-body_bar_young 6e4'", "-restart", whole, "-body_bar_young", "6e4")
    expect(r"made with '-effects gravity,hold', this run has '-effects gravity,hold,more'",
           "-restart", whole, "-effects", "gravity,hold,more", "-effect_more_type", "gravity")
    expect("belongs to another mesh", "-restart", whole, "-body_bar_mesh", "box:0.4,0.1,0.1:8,2,3")
    expect(r"made with '-body_bar_element p1', this run has '-body_bar_element cr'", "-restart", whole, "-body_bar_element", "cr")
    expect("belongs to another mesh|made with", "-restart", whole, "-body_bar_translate", "0,0,1e-9")
    print("checkpoints of other runs are refused")


def check_shortened():
    """Steps that were halved become longer again as in the run that was not interrupted."""
    options = ["-snes_max_it", "3", "-ts_max_time", "0.05", "-effects", "gravity,hold,hit", "-effect_hit_type", "gravity",
               "-effect_hit_vector", "0,0,-1500", "-effect_hit_time", "exp(-(t/0.02)^2)"]
    run(2, "whole-short", *WHOLE, *options, "-checkpoint_every_steps", "1", "-checkpoint_keep", "1000")
    names, rows = history("whole-short")
    dt = rows[:, names.index("dt")]
    # one that was halved, where the next one is longer, and one before that
    longer = [k for k in range(2, len(dt) - 1) if dt[k] < 0.0099 and dt[k + 1] > 1.5 * dt[k]]
    if not longer:
        sys.exit(f"no step becomes longer again: {dt}")
    for step in (longer[0], longer[0] - 2):
        folder = f"parts-short-{step}"
        shutil.rmtree(OUT / folder, ignore_errors=True)
        shutil.copytree(OUT / "whole-short", OUT / folder)
        for path in (OUT / folder).glob("checkpoint_*"):
            if int(path.stem[-6:]) > step:
                path.unlink()
        run(1, folder, *WHOLE, *options, "-restart", "latest")
        compare("whole-short", folder, 1e-10, 1e-9)
    print(f"steps of {dt[longer[0]]:g} s are followed by {dt[longer[0] + 1]:g} s after a restart, too")


def check_frames():
    """A support that ends leaves the mesh in the file as it is; a frame that is damaged is in no index after a restart."""
    folder, options = "support", ["-effects", "gravity,hold,end", "-effect_end_type", "fixed", "-effect_end_on", "xmax", "-effect_end_until", "0.03"]
    shutil.rmtree(OUT / folder, ignore_errors=True)
    run(2, folder, *WHOLE, *options, "-ts_max_time", "0.1")
    with h5py.File(OUT / folder / "fields.h5", "r+") as f:
        if [name for name in f if name.startswith("mesh")] != ["mesh"]:
            sys.exit(f"{folder}: fields.h5 has {list(f)}")
        del f[frames(folder)[5][1]].attrs["time"]
    run(2, folder, *WHOLE, *options, "-restart", "latest", "-ts_max_time", "0.12")
    times = [round(time, 9) for time, _ in frames(folder)]
    if times != [round(0.01 * k, 9) for k in range(13) if k != 5]:
        sys.exit(f"{folder}: frames at {times}")


def check_long_path():
    """A folder whose path has more letters than Open MPI's lock files may have."""
    folder = "/".join(["long", *["x" * 100] * 3])
    for more in (["-ts_max_time", "0.1"], ["-restart", "latest"]):
        run(2, folder, *WHOLE, *more)
    if len(history(folder)[1]) != 21:
        sys.exit(f"{folder}: {len(history(folder)[1])} rows, not 21")


def main():
    check_reproduction("newmark", (1, 2, 3), "-time", "newmark")
    for time in ("genalpha", "euler_implicit"):
        check_reproduction(time, (3,), "-time", time)
    for element in ("cr", "dg", "mixed"):
        # dg with points of its own, so that frames of this kind go on, too
        check_reproduction(element, (3,), *ELEMENTS[element], *(["-output_discontinuous"] if element == "dg" else []))
    check_shortened()
    check_damage()
    check_fit()
    check_frames()
    check_long_path()


if __name__ == "__main__":
    main()
