"""Weights of contact pairs: what pairs share counts once (-effect_NAME_weights once), and contact pressure as a field.

A cube falls ridge first beside the parallel ridge of another one, both of a mesh that is its own mirror image: nothing pushes along the
ridges. Where each pair counts, a vertex above the side of two triangles is on a ridge of energy, from which rounding decides to which side it
slides. The same on 1 to 4 ranks to 1e-9. Two blocks whose meshes do not match are pressed, sides held: the strain energy beyond that of a
uniform stress halves with the mesh, the width of the barrier in proportion to it. The contact pressure is exact with `projected`.
"""
import csv
import math
import shutil
import subprocess
import sys

import h5py
import numpy

from output_common import MPI, OUT, SUPPLE

RIDGES = ("-bodies a,b " + "".join(f"-body_{k}_mesh box:0.1,0.1,0.1:4 -body_{k}_rotate 0,1,0,45 -body_{k}_material corotated -body_{k}_young 2e4 "
                                   "-body_{0}_poisson 0.4 ".format(k) for k in "ab")
          + "-body_b_translate 0.002,0,0.16 -sets low -set_low_at box:-1,-1,-1,1,1,0 -effects gravity,low,meet -effect_low_type fixed "
          "-effect_low_on low -effect_meet_type contact -effect_meet_verify yes -time euler_implicit -ts_dt 0.005 -ts_max_time 0.1 "
          "-output_fields none -snes_rtol 1e-12 -snes_stol 0 -ksp_rtol 1e-12 ")
PATCH = ("-bodies a,b -body_a_mesh box:1,1,0.5:{0} -body_a_young 1e6 -body_a_poisson 0.2 -body_b_mesh box:1,1,0.6:{1} -body_b_translate 0,0,0.5 "
         "-body_b_young 2e6 -body_b_poisson 0.4 " + "".join(f"-body_{k}_material linear -body_{k}_density 1000 " for k in "ab")
         + "-effects bottom,x,y,press,meet -effect_bottom_type fixed -effect_bottom_on a.zmin -effect_bottom_components z "
         "-effect_x_type fixed -effect_x_on a.xmin,a.xmax,b.xmin,b.xmax -effect_x_components x "
         "-effect_y_type fixed -effect_y_on a.ymin,a.ymax,b.ymin,b.ymax -effect_y_components y "
         "-effect_press_type traction -effect_press_on b.zmax -effect_press_vector 0;0;-1e4 -effect_meet_type contact -time static "
         "-output_precision double -output_fields contact_pressure,contact_force -snes_rtol 1e-12 -ksp_rtol 1e-12 ")
# p^2 / 2 sum V / M, M = E (1 - nu) / ((1 + nu) (1 - 2 nu)), J
UNIFORM = 0.5e8 * (0.5 * 1.2 * 0.6 / (1e6 * 0.8) + 0.6 * 1.4 * 0.2 / (2e6 * 0.6))


def run(name, options, ranks=1):
    shutil.rmtree(OUT / name, ignore_errors=True)
    command = [*MPI, str(ranks), SUPPLE, *options.split(), "-quiet", "-reproducible", "-output_dir", str(OUT / name)]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode:
        sys.exit(f"{name}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    with open(OUT / name / "history.csv", newline="") as f:
        names, _, *rows = csv.reader(f)
    return {key: numpy.array([float(row[k]) for row in rows]) for k, key in enumerate(names)}


def check(good, text):
    if not good:
        sys.exit(text)


def check_ridges():
    one = run("ridges-1", RIDGES + "-effect_meet_weights once")
    size = abs(one["momentum_x"]).max()
    check(size > 0.05 and one["meet_normal_force"][-1] > 5, f"ridges: momentum {size} kg m/s: they do not touch")
    for ranks in 1, 2, 3, 4:
        found = one if ranks == 1 else run(f"ridges-{ranks}", RIDGES + "-effect_meet_weights once", ranks)
        along = abs(found["momentum_y"]).max()
        off = max(abs(found[key] - one[key]).max() for key in ("momentum_x", "momentum_y", "momentum_z"))
        print(f"  ridges, {ranks} ranks: momentum along them {along / size:.1e} of that across, {off:.1e} kg m/s from one rank")
        check(along < 1e-9 * size and off < 1e-9, f"ridges on {ranks} ranks: momentum {along} kg m/s along them, {off} kg m/s from one rank")
    each = run("ridges-each", RIDGES + "-effect_meet_weights each")
    print(f"  ridges, each pair: {abs(each['momentum_y']).max() / size:.1e}")


def pressures(name):
    """Of the vertices in contact; their force, N. One whose weight in a pair is rounding is not."""
    with h5py.File(OUT / name / "fields.h5") as f:
        steps = f["step/0000"]
        last = steps[sorted(steps)[-1]]
        pressure, force = last["contact_pressure"][:].ravel(), last["contact_force"][:, 2]
    return pressure[abs(force) > 1e-9 * abs(force).max()], abs(force).sum() / 2


def check_patch():
    excess = []
    for k, (cells, width) in enumerate((((4, 3), 1.5e-3), ((8, 6), 7.5e-4), ((16, 12), 3.75e-4))):
        found = run(f"patch-{k}", PATCH.format(*cells) + f"-effect_meet_weights once -effect_meet_barrier_width {width}")
        pressure, force = pressures(f"patch-{k}")
        excess.append(found["strain"][-1] / UNIFORM - 1)
        off = math.sqrt(((pressure / 1e4 - 1) ** 2).mean())
        print(f"  patch, {cells[0]} and {cells[1]} cells: {excess[-1]:.2e} of the energy too much, contact pressure {off:.3f} off")
        check(abs(force - 1e4) < 1e-2, f"patch-{k}: the contact bears {force} N")
        check(off < 0.2, f"patch-{k}: contact pressure {off:.3g} off")
    for k in 0, 1:
        check(excess[k + 1] < 0.55 * excess[k], f"patch: the error of the energy falls from {excess[k]:.3g} to {excess[k + 1]:.3g} only")
    run("patch-exact", PATCH.format(4, 3) + "-effect_meet_response projected")
    pressure, _ = pressures("patch-exact")
    off = abs(pressure / 1e4 - 1).max()
    print(f"  patch, projected: contact pressure {off:.1e} off")
    check(len(pressure) == 81 + 36 and off < 1e-7, f"patch-exact: contact pressure {off:.3g} off at {len(pressure)} vertices")


def check_error():
    """Other responses have no such weights."""
    command = [*MPI, "1", SUPPLE, *PATCH.format(2, 2).split(), "-effect_meet_response", "projected", "-effect_meet_weights", "once",
               "-quiet", "-output_dir", str(OUT / "error")]
    result = subprocess.run(command, capture_output=True, text=True)
    check(result.returncode and "-effect_meet_weights" in result.stdout + result.stderr, f"error: {result.stdout}{result.stderr}")


check_ridges()
check_patch()
check_error()
