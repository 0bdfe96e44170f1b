"""Fits of laws to tests of materials: the closed forms of python/supple/laws.py beside the program's stresses and its warning of instability; constants that synthetic tests
give back; Treloar's rubber and the brain of the guide; the same of laws with fibres, and the strips of an adventitia of Gasser and others (2006); errors of tables; scripts/fit, whose options
the program runs; options of a scenario from its own force and probe.

@cpu 120
"""
import json
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy

from output_common import OUT, SUPPLE

sys.path.insert(0, str(Path("python").resolve()))
import supple
from supple import Run, RunError
from supple.fitting import Fit, Points, fit_law, read_points
from supple.fibres import FibreLaw, state
from supple.laws import Law

OUT.mkdir(parents=True, exist_ok=True)
POISSON = 0.499995  # K/mu = 1e5: the closed forms are those of its limit, to a part in 1e4 at these stretches

# A cube for each mode, whose state is uniform: stretches by planes that slide, shear by all of its surface.
CUBES = {"uniaxial": (1.5, ""), "compression": (0.8, ""), "equibiaxial": (1.3, "y"), "planar": (1.6, "y"), "shear": (0.7, "")}
SOFT = {"uniaxial": (1.06, ""), "compression": (0.95, ""), "equibiaxial": (1.04, "y"), "planar": (1.05, "y"), "shear": (0.1, "")}
LAWS = [
    (Law("isochoric_neohookean", mu=4e5), CUBES), (Law("neohookean", mu=4e5), CUBES), (Law("stable_neohookean", mu=4e5), CUBES),
    (Law("mooney_rivlin", c10=2e5, c01=5e4, c20=3e3, c11=500, c02=600, c30=40, c21=30, c12=20, c03=10), CUBES), (Law("yeoh", c1=2e5, c2=-2e3, c3=60), CUBES),
    (Law("gent", mu=4e5, jm=20), CUBES), (Law("arruda_boyce", mu=3e5, lambda_m=2.8), CUBES), (Law("ogden", mu=[0.63e6, 0.0012e6, -0.01e6], alpha=[1.3, 5, -2]), CUBES),
    (Law("ogden", mu=[-150.0], alpha=[-19.0]), SOFT)]


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


def run(folder, options):
    done = subprocess.run([SUPPLE, *options, "-time", "static", "-output_dir", str(OUT / folder), "-output_overwrite", "-solver", "direct", "-quiet"], capture_output=True, text=True)
    check(done.returncode == 0, f"{folder}: exit code {done.returncode}\n{' '.join(options)}\n{done.stdout}{done.stderr}")
    return Run(OUT / folder), done.stdout + done.stderr


def moved(name, on, letter, distance):
    return ["-effect_" + name + "_type", "prescribed_displacement", f"-effect_{name}_on", on, f"-effect_{name}_components", letter,
            f"-effect_{name}_displacement", ";".join(str(distance) if c == letter else "0" for c in "xyz")]


def cubes(law_lines, states):
    """Options of the cubes, all of the law of `law_lines`, which name the body `default`."""
    options, effects = [*law_lines], []
    for k, (mode, (x, held)) in enumerate(states.items()):
        options += [f"-body_{mode}_mesh", "box:1,1,1:2", f"-body_{mode}_translate", f"{3 * k},0,0"]
        if mode == "shear":
            on = ",".join(f"{mode}.{side}" for side in ("ymin", "ymax", "xmin", "xmax", "zmin", "zmax"))
            options += [f"-effect_{mode}_type", "prescribed_displacement", f"-effect_{mode}_on", on, f"-effect_{mode}_displacement", f"{x}*y;0;0"]
            effects.append(mode)
            continue
        for letter in "xyz":
            options += [f"-effect_{mode}{letter}_type", "fixed", f"-effect_{mode}{letter}_on", f"{mode}.{letter}min", f"-effect_{mode}{letter}_components", letter]
            effects.append(mode + letter)
        for letter in "x" + held:
            options += moved(f"{mode}{letter}move", f"{mode}.{letter}max", letter, 0 if (mode, letter) == ("planar", "y") else round(x - 1, 12))
            effects.append(f"{mode}{letter}move")
    return ["-bodies", ",".join(states), "-effects", ",".join(effects), "-static_steps", "4", "-snes_rtol", "1e-10", "-output_fields", "displacement,stress", *options]


def check_program():
    """The nominal stress of each law and mode: that of the program's Cauchy stress, P = J sigma F^-T."""
    for k, (law, states) in enumerate(LAWS):
        found, _ = run(f"law{k}", cubes(" ".join(law.option_lines("default", POISSON)).split(), states))
        mesh, stress = found.mesh(), found.field("stress").astype(float)
        place = mesh.x[mesh.cells].mean(axis=1)[:, 0] // 3
        for n, (mode, (x, _)) in enumerate(states.items()):
            cauchy = stress[place == n][:, 1 if mode == "shear" else 0]
            expected = float(law.nominal_stress(mode, [x])[0]) * (1 if mode == "shear" else x)
            check(len(cauchy) == 40 or len(cauchy) == 48, f"{len(cauchy)} tets of a cube")
            check(numpy.abs(cauchy - expected).max() < 2e-4 * abs(expected), f"{law.family.name} {mode} {x}: {cauchy.min()} to {cauchy.max()} by the program, {expected} by the closed form")
        found.close()


def check_published():
    """The numbers of docs/reference/materials.md; the shear modulus at rest is the slope of simple shear."""
    law = Law("ogden", mu=[0.63, 0.0012, -0.01], alpha=[1.3, 5, -2])
    for mode, x, stress in ("uniaxial", [1.39, 3.02, 6.4], [0.3399, 0.8854, 3.0933]), ("equibiaxial", [1.31, 3.43], [0.4663, 1.4738]), ("planar", [1.87, 4.96], [0.6426, 1.7785]):
        check(numpy.abs(law.nominal_stress(mode, x) - stress).max() < 6e-5, f"Ogden's table, {mode}: {law.nominal_stress(mode, x)}")
    for law, _ in LAWS:
        slope = float(law.nominal_stress("shear", [1e-6])[0]) / 1e-6
        check(abs(slope / law.shear_modulus - 1) < 1e-9, f"{law.family.name}: shear modulus {law.shear_modulus}, slope {slope}")


def check_stability():
    """The program's warning names the stretch where the range of the fit ends, within one of its 200 steps."""
    law = Law("yeoh", c1=3e5, c2=-2e4, c3=80)
    _, text = run("unstable", cubes(" ".join(law.option_lines("default")).split(), {"uniaxial": (1.01, "")}))
    for mode in ("uniaxial", "planar"):
        low, high = law.stable(mode, 0.3, 3.0)
        for word, value in ("beyond", high), ("below", low):
            named = re.search(rf"{mode} \w+ {word} the stretch ([\d.]+)", text)
            check(named and abs(math.log(float(named[1]) / value)) < math.log(3) / 200 + 0.005, f"{mode} {word}: {value}; the program says {text}")
    stable = Law("ogden", mu=[4e5, -1e4], alpha=[2, -2])
    check(stable.stable("equibiaxial", 0.3, 3) == (0.3, 3.0) and stable.rising("shear", 0, 2.6) == (0.0, 2.6), "a law that is stable everywhere")
    # a gent has no numbers beyond its limit of stretch, l^2 + 2/l - 3 = jm
    check(2.2 < Law("gent", mu=1, jm=3).stable("uniaxial", 0.3, 3)[1] < 2.26, "the limit of gent")


def synthetic(law, states=None):
    x = states or {"uniaxial": numpy.linspace(1.1, 2.5, 8), "compression": numpy.linspace(0.5, 0.9, 5), "equibiaxial": numpy.linspace(1.1, 2, 6),
                   "planar": numpy.linspace(1.1, 2.2, 6), "shear": numpy.linspace(0.1, 1, 5)}
    return Points(*map(numpy.concatenate, zip(*[([mode] * len(v), v, law.nominal_stress(mode, v)) for mode, v in x.items()])))


def check_recovered():
    """Points of a law give its constants back, by each kind of error."""
    nine = Law("mooney_rivlin", c10=2e5, c01=5e4, c20=3e3, c11=500, c02=600, c30=40, c21=30, c12=20, c03=10)
    cases = [(law, None) for law, states in LAWS if states is CUBES and law.family.name not in ("mooney_rivlin", "ogden")] + [
        (nine, 9), (Law("ogden", mu=[3e5, -2e4], alpha=[1.7, -2.5]), 2), (Law("ogden", mu=[0.63e6, 0.0012e6, -0.01e6], alpha=[1.3, 5, -2]), 3)]
    for n, (law, terms) in enumerate(cases):
        found = fit_law(synthetic(law), law.family.name, terms, ("relative", "mode", "absolute")[n % 3]).law
        for key, value in law.constants.items():
            a, b = numpy.sort(numpy.atleast_1d(value)), numpy.sort(numpy.atleast_1d(found.constants[key]))
            check(a.shape == b.shape and numpy.allclose(a, b, rtol=1e-3), f"{law.family.name} {key}: {b}, expected {a}")
    # weights: points of weight 0 do not count
    points = synthetic(Law("neohookean", mu=5.0))
    points.stress[3], points.weight[3] = 99.0, 0
    check(abs(fit_law(points, "neohookean").law.shear_modulus - 5) < 1e-9, "weights")
    # terms that are to be stable are, where the free ones are not
    brain = read_points(["docs/data/brain_corona_radiata.csv"], "kPa")
    free, stable = (fit_law(brain, "mooney_rivlin", 2, stable=s) for s in (False, True))
    whole = lambda found: all(row["stable"] == (row["low"], row["high"]) for row in found.ranges.values())
    check(min(stable.law.scale) >= 0 > min(free.law.scale) and whole(stable) and not whole(free), f"{free.law}; {stable.law}")


def check_examples():
    """Treloar's rubber: three terms of Ogden's law come closer than his own constants of 1972, and are like them. The brain: no neo-Hookean, one term of Ogden's law with a
    large negative exponent."""
    rubber = read_points(["docs/data/treloar.csv"], "MPa")
    check(len(rubber) == 53 and rubber.stress.max() == 6.3e6, "Treloar's points")
    own = Fit(Law("ogden", mu=[0.63e6, 0.0012e6, -0.01e6], alpha=[1.3, 5, -2]), rubber)
    found = {terms: fit_law(rubber, "ogden", terms) for terms in (1, 3)}
    neo = fit_law(rubber, "isochoric_neohookean")
    percent = lambda a: a.errors["all"]["percent"]
    check(own.errors["all"]["R2"] > 0.98 and percent(found[3]) < percent(own) < 8, f"Ogden: {percent(own)} % with his constants, {percent(found[3])} % fitted")
    check(percent(neo) > 3 * percent(found[3]) and percent(found[1]) > 3 * percent(found[3]), f"neo-Hookean {percent(neo)} %")
    alpha, published = numpy.sort(found[3].law.shape), numpy.array([-2, 1.3, 5])
    check(numpy.abs(alpha - published).max() < 0.6 and abs(found[3].law.shear_modulus / 0.4225e6 - 1) < 0.1, f"alpha {alpha}, shear modulus {found[3].law.shear_modulus}")
    # exponents of both tissues: those of the cortex are nearer to -19
    for name, low, high in ("corona_radiata", -24.5, -22.5), ("cortex", -21.5, -18):
        brain = read_points([f"docs/data/brain_{name}.csv"], "kPa")
        for errors in ("relative", "mode", "absolute"):
            one = fit_law(brain, "ogden", 1, errors)
            check(low < one.law.shape[0] < high and one.errors["all"]["R2"] > 0.97, f"{name}, {errors} errors: {one.law}")
        neo, one = fit_law(brain, "isochoric_neohookean"), fit_law(brain, "ogden", 1)
        check(percent(neo) > 2 * percent(one) and neo.errors["compression"]["of_largest"] > 0.25, f"{name}: neo-Hookean {neo.errors}")


WALL = {"mu": 7640.0, "k1": 996.6e3, "k2": 524.6, "angles": [49.98, -49.98]}  # Gasser, Ogden, Holzapfel 2006, the adventitia of an iliac artery
FIBRES = [FibreLaw("transversely_isotropic", mu=3e3, mu_fibre=5e3, young_fibre=90e3), FibreLaw("holzapfel_gasser_ogden", kappa=0.1, **(WALL | {"k2": 20})),
          FibreLaw("guccione", c=2e3, bf=8, bt=2, bfs=4), FibreLaw("holzapfel_ogden", a=590, b=8.023, a_f=18472, b_f=16.026, a_s=2481, b_s=11.12, a_fs=216, b_fs=11.436)]
SHEETS = [("uniaxial", 1.15, 0, None), ("uniaxial", 1.15, 30, None), ("uniaxial", 1.15, 90, None), ("compression", 0.9, 45, None), ("equibiaxial", 1.1, 20, None),
          ("planar", 1.1, 70, None), ("biaxial", 1.12, 90, 1.05), ("shear", 0.2, 60, None), ("shear_fn", 0.3, 0, None), ("shear_ns", 0.3, 0, None), ("shear_fs", 0.3, 0, None)]


def check_fibres_program():
    """The stress of each law with fibres: that of the program in cubes that are moved as the closed form has them; sides that bear no load bear none there."""
    bodies = [f"cube{n}" for n in range(len(SHEETS))]
    for m, law in enumerate(FIBRES):
        options, states = " ".join(law.option_lines("default", 0.3)).split() + ["-bodies", ",".join(bodies), "-effects", ",".join(bodies), "-body_default_mesh", "box:1,1,1:1"], []
        for body, (mode, x, angle, across) in zip(bodies, SHEETS):
            R, F, _ = state(law.family, law.constants, mode, numpy.array([x]), angle, None if across is None else numpy.array([across]))
            states.append((R, F[0]))
            rows = ["+".join(f"({g!r})*{c}" for g, c in zip(row, "xyz")) for row in (R @ F[0] @ R.T - numpy.eye(3)).tolist()]
            options += [f"-effect_{body}_type", "prescribed_displacement", f"-effect_{body}_on", body, f"-effect_{body}_displacement", ";".join(rows)]
        found, _ = run(f"fibres{m}", [*options, "-output_fields", "displacement,stress", "-output_precision", "double"])
        body, stress = found.mesh().body, found.field("stress").astype(float)
        for k, ((R, F), (mode, x, angle, across)) in enumerate(zip(states, SHEETS)):
            what = f"{law.family.name}, {mode} {x} at {angle} degrees"
            xx, xy, xz, yy, yz, zz = stress[body == k].mean(axis=0)
            t = R.T @ numpy.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R
            # P = (t - p) F^-T, the pressure p = t_nn; that of a shear has no share in its force
            P = (t - t[2, 2] * numpy.eye(3)) @ numpy.linalg.inv(F).T
            expected = float(law.nominal_stress(mode, numpy.array([x]), angle, None if across is None else numpy.array([across]))[0])
            value, size = P[0, 1] if mode.startswith("shear") else P[0, 0], abs(t).max()
            check(abs(value - expected) < 1e-8 * size, f"{what}: {value} by the program, {expected} by the closed form")
            if mode in ("uniaxial", "compression"):
                check(max(abs(t[0, 1]), abs(t[1, 1] - t[2, 2])) < 1e-8 * size, f"{what}: sides bear {t}")
        found.close()


def strips(law, angles, x=(1.02, 1.05, 1.1, 1.15, 1.2), biaxial=(), shears=False):
    """Points of a law: strips along angles, biaxial tests with so many times the strain across, six shears."""
    x, rows = numpy.array(x), []
    for angle in angles:
        rows += [("uniaxial", *pair, 1, angle, math.nan) for pair in zip(x, law.nominal_stress("uniaxial", x, angle))]
    for ratio in biaxial:
        along, across = 1 + (x - 1) * min(1, 1 / ratio), 1 + (x - 1) * min(1, ratio)
        for angle, a, b in (0, along, across), (90, across, along):
            rows += [("biaxial", p, s, 1, angle, q) for p, q, s in zip(a, b, law.nominal_stress("biaxial", a, angle, b))]
    g = numpy.linspace(0.1, 0.5, 5)
    for plane in ("fs", "fn", "sf", "sn", "nf", "ns") if shears else ():
        rows += [(f"shear_{plane}", *pair, 1, 0, math.nan) for pair in zip(g, law.nominal_stress(f"shear_{plane}", g))]
    return Points(*zip(*rows))


def check_adventitia():
    """The published strips of Gasser and others (2006), Cauchy stress in kPa of the circumferential one, and their constants from points of both strips."""
    for kappa, published in (0, [1.272, 2.730, 6.821]), (0.226, [1.421, 4.070, 48.245]):
        law, x = FibreLaw("holzapfel_gasser_ogden", kappa=kappa, **WALL), numpy.array([1.05, 1.1, 1.2])
        stress = x * law.nominal_stress("uniaxial", x) / 1e3
        check(numpy.abs(stress - published).max() < 6e-4, f"kappa {kappa}: {stress} kPa, published {published}")
        found = fit_law(strips(law, (0, 90)), "holzapfel_gasser_ogden")
        for key, value in law.constants.items():
            check(numpy.allclose(found.law.constants[key], value, rtol=1e-5, atol=1e-6), f"kappa {kappa}, {key}: {found.law.constants[key]}, expected {value}")
        check(not found.alike and {"uniaxial 0 deg", "uniaxial 90 deg"} < found.errors.keys() and found.ranges["uniaxial 90 deg"]["high"] > 1.3, f"{found.errors} {found.ranges}")
    # what is known is kept
    found = fit_law(strips(law, (0, 90)), "holzapfel_gasser_ogden", fixed={"angles": 45.0, "kappa": 0.226})
    check(found.law.constants["angles"] == [45, -45] and found.law.constants["kappa"] == 0.226 and found.errors["all"]["percent"] > 1, f"{found.law}")
    one = fit_law(strips(law, (0, 90)), "holzapfel_gasser_ogden", 1)
    check(one.law.constants["angles"] == [0] and one.errors["all"]["percent"] > 5, f"{one.law} {one.errors['all']}")


def check_fibres_recovered():
    """Points of the other laws give their constants back; constants that the tests do not tell are named."""
    for law, points in ((FIBRES[0], strips(FIBRES[0], (0, 45, 90))), (FIBRES[2], strips(FIBRES[2], (0, 45, 90))), (FIBRES[3], strips(FIBRES[3], (), shears=True)),
                        (FIBRES[3], strips(FIBRES[3], (0, 45, 90), biaxial=(0.5, 1, 2)))):
        found = fit_law(points, law.family.name)
        for key, value in law.constants.items():
            check(numpy.allclose(found.law.constants[key], value, rtol=1e-5), f"{law.family.name} {key}: {found.law.constants[key]}, expected {value}")
        check(not found.alike, f"{law.family.name}: {found.alike}")
    by_mode = fit_law(points, "guccione", errors="mode")
    check(by_mode.errors["all"]["R2"] > 0.9, f"guccione for points of holzapfel_ogden, errors of the mode: {by_mode.errors}")
    found = fit_law(strips(FIBRES[2], (), biaxial=(0.5, 1, 2)), "guccione")
    check(found.alike == [("bfs",)] and found.law.constants["bfs"] == found.law.constants["bt"], f"shear of a sheet that is pulled along its fibres: {found.alike}")
    # a law without fibres sees biaxial tests, and no angle
    neo = Law("isochoric_neohookean", mu=5e3)
    points = strips(neo, (0, 30), biaxial=(0.5, 2))
    check(abs(fit_law(points, "isochoric_neohookean").law.shear_modulus - 5e3) < 1e-6, "a neo-Hookean of biaxial tests")
    same = fit_law(points, "transversely_isotropic").law
    check(numpy.allclose([same.constants[key] for key in ("mu", "mu_fibre", "young_fibre")], [5e3, 5e3, 15e3], rtol=1e-6), f"{same}")


def check_fibres_stable():
    """Fibres of W4 = dW/dI4 in a neo-Hookean buckle in compression: shear of the logarithmic strain between fibre and sheet changes C = exp(2 H) by divided differences
    of f = exp(2 h), and the energy by mu/2 (f[1,1,2] + f[1,2,2]) + W4 f[1,1,2], which is zero at the stretch that is found."""
    law = FibreLaw("transversely_isotropic", mu=3.0, mu_fibre=3.0, young_fibre=90.0)
    x = numpy.linspace(0.5, 0.999, 10001)
    f1, f2, apart = x**2, 1 / x, 1.5 * numpy.log(x)
    f112, f122 = (2 * f1 - (f1 - f2) / apart) / apart, ((f1 - f2) / apart - 2 * f2) / apart
    root = x[numpy.nonzero(1.5 * (f112 + f122) + 81 / 4 * (x**2 - 1) * f112 < 0)[0][-1]]
    low, high = law.stable("uniaxial", 0.3, 3)
    step = 0.3 ** (1 / 50)
    check(low >= root > low * step and high == 3, f"stable from {low} to {high}; fibres buckle at {root}")
    iso = FibreLaw("transversely_isotropic", mu=3.0, mu_fibre=3.0, young_fibre=9.0)
    check(iso.stable("uniaxial", 0.3, 3, 30) == (0.3, 3.0) and iso.stable("shear", 0, 2.6) == (0.0, 2.6), "a neo-Hookean is stable everywhere")
    wall = FibreLaw("holzapfel_gasser_ogden", kappa=0.226, **WALL)
    check(wall.stable("uniaxial", 1 / 1.3, 1.3, 90) == (1 / 1.3, 1.3) and wall.rising("uniaxial", 1 / 1.3, 1.3, 90) == (1 / 1.3, 1.3), "the adventitia")


def table(text, name="bad.csv"):
    (OUT / name).write_text(text)
    return OUT / name


def check_tables():
    """Files of several modes and of one; what is wrong is named with its line."""
    several = read_points([table("# a remark\nstress, mode, shear, weight\n\n2, simple shear, 0.1, 1  # its stress\n3, pure-shear, 1.2, 0.5\n")], "kPa")
    check(several.modes == ["planar", "shear"] and several.stress.tolist() == [2e3, 3e3] and several.weight.tolist() == [1, 0.5], "columns by name")
    one = read_points([f"biaxial={table('1.1,5', 'a.csv')}", f"uniaxial={table('1.2,7,2', 'b.csv')}"])
    check(one.mode.tolist() == ["equibiaxial", "uniaxial"] and one.x.tolist() == [1.1, 1.2] and one.weight.tolist() == [1, 2], "files of one mode")
    head = "mode,stretch,stress\n"
    for text, *words in ((head + "uniaxal,1.1,2\n", "line 2", "uniaxal", "uniaxial"), (head + "uniaxial,0,2\n", "line 2", "0"), (head + "planar,-1,2\n", "line 2", "-1"),
                         (head + "uniaxial,1.1,two\n", "line 2", "two"), (head + "uniaxial,1.1\n", "line 2"), (head + "uniaxial,1.1,nan\n", "line 2", "nan"),
                         (head + "compression,1.1,2\n", "line 2", "1.1"), (head + "compression,0.9,2\n", "negative"), (head + "planar,1.2,3,1,9\n", "line 2"),
                         ("mode,strain,stress\n", "line 1", "stretch"), ("mode,stretch,stress,colour\n", "line 1", "colour"), (head, "no points"), ("", "no points"),
                         ("mode,stretch,stress,weight\nplanar,1.2,3,-1\n", "line 2", "-1")):
        refused(lambda: read_points([table(text)]), *words)
    turned = read_points([f"uniaxial:30={table('1.1,5', 'a.csv')}", table("mode,stretch,across,stress,angle\nbiaxial,1.1,1.2,3,90\nbiaxial,1.1,,3,\n", "c.csv")])
    check(turned.mode.tolist() == ["uniaxial", "biaxial", "equibiaxial"] and turned.angle.tolist() == [30, 90, 0] and turned.across[1] == 1.2, "angles and stretches across")
    check(list(turned.groups) == ["uniaxial 30 deg", "equibiaxial 0 deg", "biaxial 90 deg"], f"{list(turned.groups)}")
    for text, *words in (("mode,stretch,across,stress\nplanar,1.1,1.2,3\n", "line 2", "planar"), ("mode,stretch,across,stress\nbiaxial,1.1,-1,3\n", "line 2", "-1"),
                         ("mode,stretch,stress,angle\nplanar,1.1,3,north\n", "line 2", "north")):
        refused(lambda: read_points([table(text)]), *words)
    strip = Points(["uniaxial"] * 9, numpy.linspace(1.05, 1.2, 9), numpy.linspace(1, 9, 9))
    refused(lambda: fit_law(strip, "guccione", fixed={"bx": 2}), "bx", "bfs")
    refused(lambda: fit_law(strip, "guccione", 2), "2 terms")
    refused(lambda: fit_law(strip, "yeoh", fixed={"c1": 2}), "yeoh", "guccione")
    refused(lambda: fit_law(strip[:3], "guccione"), "4 constants", "3 points")
    refused(lambda: FibreLaw("guccione", c=2), "bf")
    refused(lambda: FibreLaw("gucione", c=2), "guccione")
    refused(lambda: read_points([OUT / "nowhere.csv"]), "nowhere.csv")
    refused(lambda: read_points([f"plane={table('1.1,5')}"]), "plane")
    two = Points(["uniaxial"] * 4, [1, 1.1, 1.2, 1.2], [0, 1, 2, 2.1])
    refused(lambda: fit_law(two, "ogden", 3), "6 constants", "2 points")
    refused(lambda: fit_law(two, "yeoh", 4), "4")
    refused(lambda: fit_law(two, "odgen"), "ogden")
    refused(lambda: fit_law(two, "gent", 2), "gent")
    refused(lambda: fit_law(Points(["uniaxial"] * 2, [1.1, 1.2], [-1, -2]), "yeoh", 1), "shear modulus")
    refused(lambda: fit_law(Points(["uniaxial"] * 2, [1.1, 1.2], [0, 2]), "yeoh", 1), "relative")


def script(*words, code=0):
    done = subprocess.run([sys.executable, "scripts/fit", *map(str, words)], capture_output=True, text=True)
    check(done.returncode == code, f"scripts/fit {words}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout if not code else done.stderr


def check_script():
    """The options that it prints are run by the program, which finds the stress of the tests; a picture, JSON, laws beside each other."""
    text = script("docs/data/treloar.csv", "--unit", "MPa", "--law", "ogden", "--terms", 3, "--body", "default", "--poisson", POISSON, "--picture", OUT / "fit.png")
    lines = [line for line in text.splitlines() if line.startswith("-body_default_")]
    check(len(lines) == 4 and (OUT / "fit.png").stat().st_size > 5000, text)
    found, said = run("fitted", cubes(" ".join(lines).split(), {"uniaxial": (2.17, "")}))
    stress = found.field("stress")[:, 0].mean() / 2.17
    found.close()
    check(abs(stress / 0.58e6 - 1) < 0.1 and "unstable" not in said, f"nominal stress at the stretch 2.17: {stress} Pa by the fitted law, 0.58 MPa by the test; {said}")
    it = json.loads(script("docs/data/treloar.csv", "--unit", "MPa", "--law", "ogden", "--terms", 3, "--body", "default", "--json"))
    check(it["options"][1:3] == lines[1:3] and it["errors"]["all"]["points"] == 53 and f"{it['shear_modulus'] / 1e6:.4g} MPa" in text, "JSON")
    text = script("docs/data/brain_cortex.csv", "--unit", "kPa", "--law", "neohookean,ogden:1")
    check(len(text.splitlines()) == 3 and "compression" in text, text)
    done = subprocess.run([sys.executable, "scripts/fit", f"uniaxial={table('1.1,5', 'a.csv')}", "--law", "mooney_rivlin", "--terms", "1"], capture_output=True, text=True)
    check(done.returncode == 0 and "warning" in done.stderr and "uniaxial" in done.stderr, f"one mode alone: {done.stderr}")
    # strips of an artery: the lines are read by the program, and the constants are those of the points
    law, files = FibreLaw("holzapfel_gasser_ogden", kappa=0.226, **WALL), []
    for angle in (0, 90):
        x = numpy.linspace(1.02, 1.2, 7)
        files.append(f"uniaxial:{angle}={table(chr(10).join(f'{a!r},{s!r}' for a, s in zip(x.tolist(), (law.nominal_stress('uniaxial', x, angle) / 1e3).tolist())), f'strip{angle}.csv')}")
    text = script(*files, "--unit", "kPa", "--law", "holzapfel_gasser_ogden", "--body", "cube", "--poisson", 0.3, "--picture", OUT / "strips.png")
    lines = [line for line in text.splitlines() if line.startswith("-body_cube_")]
    check(len(lines) == 9 and "49.98,-49.98" in text and "uniaxial 90 deg" in text and (OUT / "strips.png").stat().st_size > 5000, text)
    run("wall", ["-bodies", "cube", "-body_cube_mesh", "box:1,1,1:1", "-effects", "hold", "-effect_hold_type", "fixed", "-effect_hold_on", "cube.xmin", *" ".join(lines).split()])
    it = json.loads(script(*files, "--unit", "kPa", "--law", "holzapfel_gasser_ogden", "--fix", "angles=49.98,kappa=0.226", "--json"))
    check(abs(it["constants"]["k2"] - 524.6) < 0.1 and not it["alike"], f"{it['constants']}")
    check("angles" in script(*files, "--law", "yeoh", "--fix", "angles=3", code=1), "a constant of a law without fibres")
    check("LAW:TERMS" in script("docs/data/treloar.csv", "--law", "yeoh,gent", "--terms", 2, code=1), "terms of several laws")
    check("nowhere.csv" in script("nowhere.csv", "--law", "gent", code=1), "a file that is missing")


BLOCK = """
-bodies block
-body_block_mesh box:1,1,1:2
-body_block_material neohookean
-body_block_young 3e4
-body_block_poisson 0.3
-body_block_element p2
-effects base,plate
-effect_base_type fixed
-effect_base_on zmin
-effect_plate_type prescribed_displacement
-effect_plate_on zmax
-effect_plate_displacement 0;0;-0.2*t
-probes side
-probe_side_at 1,0.5,0.5
-time static
-static_steps 4
-solver direct
-snes_rtol 1e-9
"""


def check_identified():
    """Young's modulus and Poisson's ratio of a pressed block, from its force and how far its side moves; the force alone does not tell them apart as well."""
    scene = OUT / "block.opts"
    scene.write_text(BLOCK)
    real = supple.start(scene, OUT / "real", output_fields="none").history
    tables = {}
    for column in ("plate_reaction_z", "side_ux"):
        tables[column] = OUT / f"{column}.csv"
        tables[column].write_text("time,value\n" + "".join(f"{t},{v}\n" for t, v in zip(real["time"], real[column])))
    found = supple.fit(scene, tables, {"young": 1e4, "poisson": 0.2}, OUT / "identified", bounds={"poisson": (0.0, 0.49)}, workers=2)
    check(abs(found.values["young"] / 3e4 - 1) < 1e-4 and abs(found.values["poisson"] - 0.3) < 1e-4, f"{found}")
    check(max(found.misfits.values()) < 1e-4 and not found.alike and found.nrun < 40 and "young" in str(found), f"{found}")
    check(sorted(path.name for path in (OUT / "identified").iterdir()) == ["0000", "0001", "0002"], "folders of the runs")
    # over another column, which falls
    over = supple.fit(scene, {"plate_reaction_z": (real["side_ux"], real["plate_reaction_z"])}, {"young": 5e4}, OUT / "identified", over="side_ux", poisson=0.3)
    check(abs(over.values["young"] / 3e4 - 1) < 1e-4, f"over another column: {over}")
    # a displacement under a pressure, by a linear law, is that of the pressure over Young's modulus
    scene.with_name("pressed.opts").write_text(re.sub("-effect_plate_.*\n", "", BLOCK).replace("neohookean", "linear") + "-effect_plate_type pressure\n-effect_plate_on zmax\n-effect_plate_value 100\n")
    alike = supple.fit(scene.with_name("pressed.opts"), {"side_ux": ([0, 1], [0, 1e-3])}, {"young": 1e4, "effect_plate_value": 50.0}, OUT / "identified")
    check(alike.alike == [("effect_plate_value", "young")] and alike.misfits["side_ux"] < 1e-4 and "not told apart" in str(alike), f"{alike}")
    # options that are lists: two terms of a law, each with its start and its bounds
    rubber = scene.with_name("rubber.opts")
    law = lambda mu, alpha: f"-body_block_material ogden\n-body_block_poisson 0.3\n-body_block_mu {mu}\n-body_block_alpha {alpha}\n"
    rubber.write_text(re.sub("-body_block_(material|young|poisson).*\n", "", BLOCK).replace("-0.2*t", "-0.4*t").replace("1,1,1:2", "1,1,1:1") + law("8e3,-3e3", "3,-2"))
    real = supple.start(rubber, OUT / "real", output_fields="none").history
    curves = {column: (real["time"], real[column]) for column in ("plate_reaction_z", "side_ux")}
    found = supple.fit(rubber, curves, {"mu": [7e3, -3.5e3]}, OUT / "identified", bounds={"mu": (-1e4, 2e4), "mu[0]": (1e3, 2e4)}, workers=2)
    check(numpy.allclose(found.values["mu"], [8e3, -3e3], rtol=1e-3) and numpy.shape(found.deviations["mu"]) == (2,) and "mu[1]" in str(found), f"{found}")
    curve = ([0.5, 1], [1, 2])
    for words, measured, unknown, more in (
            (["0"], {"side_ux": curve}, {"young": 0}, {}), (["points"], {"side_ux": ([1], [1])}, {"young": 1e4, "poisson": 0.2}, {}), (["no column", "top"], {"top": curve}, {"young": 1e4}, {}),
            (["1.5"], {"side_ux": ([0.5, 1.5], [1, 2])}, {"young": 1e4}, {}), (["poisson", "bounds"], {"side_ux": curve}, {"young": 1e4}, {"bounds": {"poisson": (0, 1)}}),
            (["bounds"], {"side_ux": curve}, {"young": 1e4}, {"bounds": {"young": (0, 1)}}), (["[1]", "bounds"], {"side_ux": curve}, {"young": [1e4, 2.0]}, {"bounds": {"young": (3, 1e5)}}), (["yuong"], {"side_ux": curve}, {"yuong": 1e4}, {}),
            (["nothing", "density"], {"side_ux": curve}, {"density": 1e3}, {}),
            (["nowhere.csv"], {"side_ux": "nowhere.csv"}, {"young": 1e4}, {}), (["plate_reaction_x"], {"side_ux": curve}, {"young": 1e4}, {"over": "plate_reaction_x"})):
        refused(lambda: supple.fit(scene, measured, unknown, OUT / "refused", **more), *words)


for part in (check_published, check_program, check_stability, check_recovered, check_examples, check_fibres_program, check_adventitia, check_fibres_recovered, check_fibres_stable,
             check_tables, check_script, check_identified):
    part()
print("fits: all fine")
