"""Blocks that lie in a corner between two walls, along the axes and oblique: the surface of CR and DG, whose contact is with means, against P1 and P2.

A block under gravity touches both walls with a whole side each, nu 0.3 and 0.49. The walls bear the two components of its weight, without friction. Turned
together with walls and gravity it has the same energy. Its vertices are within 1.8e-4 m (0.18 % of its size) of walls that it touches exactly in the mean, and
with barriers outside of them, and CR and DG within 1.1 of its width, as P1; the corners of P2 within 2. docs/reports/contact.md has the figures.
"""
import math

import h5py
import numpy

from scene_common import OUT, check, finish, history, near, start

COMMON = "-quiet -output_fields position -output_precision double -snes_rtol 1e-10 -ksp_rtol 1e-12 "
WIDTH = 2e-4  # m, of barriers
PULL = {"floor": ((0, 0, 1), 9.0), "wall": ((1, 0, 0), 4.0)}  # normal at rest, weight against it in N


def turned(v, degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return numpy.array([c * v[0] + s * v[2], v[1], c * v[2] - s * v[0]])


def listed(v):
    return ",".join(f"{x:.17g}" for x in v)


def lie(element, nu, response, degrees, ranks=1):
    """Strain energy, J, and for each wall the smallest and the largest distance of the vertices of its side, m."""
    options = (f"-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_element {element} -body_a_rotate 0,1,0,{degrees} -body_a_material stable_neohookean -body_a_young 2e4 "
               f"-body_a_poisson {nu} -body_a_density 1000 -time static -sets end -set_end_at plane:0,1,0,0 -effects gravity,end,floor,wall "
               f"-effect_gravity_vector {listed(turned((-4, 0, -9), degrees))} -effect_end_type fixed -effect_end_on end -effect_end_components y ")
    for name, (normal, _) in PULL.items():
        options += f"-effect_{name}_type contact -effect_{name}_obstacle plane:{listed(turned(normal, degrees))},0 -effect_{name}_response {response} "
        options += f"-effect_{name}_barrier_width {WIDTH} " if response == "barrier" else ""
    folder = f"{element}_{response}_{degrees}"
    start(folder, COMMON + options, ranks)
    what, end, gaps = f"{element}, nu {nu}, {response}, {degrees} degrees", {k: v[-1] for k, v in history(folder).items()}, {}
    with h5py.File(OUT / folder / "fields.h5") as file:
        rest, steps = file["mesh/x"][:], file["step/0000"]
        x = steps[sorted(steps)[-1]]["position"][:]
    for name, (normal, weight) in PULL.items():
        n = turned(normal, degrees)
        force = numpy.array([end[f"{name}_force_{k}"] for k in "xyz"])
        near(numpy.linalg.norm(force - weight * n), 0, 1e-7 * weight, f"{what}: force of the {name}, less its part of the weight, N")
        gap = (x @ n)[abs(rest @ n) < 1e-12]
        gaps[name] = gap.min(), gap.max()
        check(len(gap) == (49 if element == "p2" else 16), f"{what}: {len(gap)} vertices at the {name}")
    return end["strain"], gaps, what


for nu in (0.3, 0.49):
    for response in ("projected", "barrier"):
        energy = {}
        for element in ("p1", "p2", "cr", "dg"):
            energy[element], _, _ = lie(element, nu, response, 0)
            oblique, gaps, what = lie(element, nu, response, 30, 3 if element == "cr" else 1)
            near(oblique / energy[element], 1, 1e-7, f"{what}: strain energy, over that along the axes")
            for name, (least, most) in gaps.items():
                print(f"{what}, {name}: vertices at {1e3 * least:.4f} to {1e3 * most:.4f} mm, {oblique:.6f} J")
                if response == "barrier":
                    check(0 < least and most < (2 if element == "p2" else 1.1) * WIDTH, f"{what}: vertices at {least:g} to {most:g} m from the {name}")
                else:
                    check(-1.8e-4 < least and most < 1.8e-4, f"{what}: vertices at {least:g} to {most:g} m from the {name}")
        near(energy["cr"] / energy["p2"], 1, 0.01 if response == "projected" else 0.1, f"nu {nu}, {response}: strain energy of CR over that of P2")
finish()
