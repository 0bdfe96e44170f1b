"""Runs with laws that have moduli of their own, two of them with fibres, as the program does them: static and dynamic, on every element, the same numbers on
one and on three ranks; a run taken up from a checkpoint is the run that was not interrupted, bit for bit; the ledger estimates its errors; the options that were used are written, and run again.
"""
import csv
import json
import shutil
import subprocess
import sys

from output_common import MPI, OUT, SUPPLE

BAR = ("-bodies a,b,c,d -body_a_mesh box:0.2,0.05,0.05:6,2,2 -body_a_material ogden -body_a_mu 0.63e5,0.0012e5,-0.01e5 -body_a_alpha 1.3,5,-2 -body_a_bulk 2e6 "
       "-body_b_mesh box:0.1,0.05,0.05:3,2,2 -body_b_translate 0,0.1,0 -body_b_material mooney_rivlin -body_b_c10 2e4 -body_b_c01 4e3 -body_b_poisson 0.45 "
       "-body_b_volumetric quadratic -body_c_mesh box:0.1,0.05,0.05:3,2,2 -body_c_translate 0,0.2,0 -body_c_material holzapfel_gasser_ogden "
       "-body_c_mu 2e4 -body_c_k1 3e4 -body_c_k2 2 -body_c_kappa 0.1 -body_c_angles 30,-30 -body_c_fibre 1,10*z,x -body_c_sheet 0,1,x -body_c_poisson 0.45 "
       "-body_d_mesh box:0.1,0.05,0.05:3,2,2 -body_d_translate 0,0.3,0 -body_d_material guccione -body_d_c 1e4 -body_d_bf 8 -body_d_bt 2 -body_d_bfs 4 "
       "-body_d_fibre cos(9*x),sin(9*x),0 -body_d_bulk 1e6 -body_default_element {0} -effects hold,gravity,pull -effect_hold_type fixed -effect_hold_on xmin "
       "-effect_gravity_vector 0,0,-9.81 -effect_pull_type traction -effect_pull_on xmax -effect_pull_vector 0;0;{1} -output_fields none -quiet "
       "-output_history_bodies -solver direct ")
RUNS = {"static": "-time static -static_steps 3 -snes_rtol 1e-11 ",
        "dynamic": "-time newmark -ts_dt 0.005 -ts_max_time 0.1 -snes_rtol 1e-11 -checkpoint_every_steps 10 -checkpoint_keep 9 "}
UNLIKE = ("newton", "linear", "rejected")  # what solving took is not compared


def run(ranks, folder, options, code=0):
    shutil.rmtree(OUT / folder, ignore_errors=True)
    return again(ranks, folder, options, code)


def again(ranks, folder, options, code=0):
    command = [*MPI, str(ranks), SUPPLE, *options.split(), "-output_dir", str(OUT / folder)]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode != code:
        sys.exit(f"{folder}: exit code {result.returncode}\n{' '.join(command)}\n{result.stdout}{result.stderr}")
    return result.stdout + result.stderr


def history(folder):
    rows = list(csv.reader((OUT / folder / "history.csv").read_text().splitlines()))
    return rows[0], rows[2:]


def check_ranks(element, kind):
    """The columns of energies, volumes and displacements on three ranks are those on one."""
    tables = []
    for ranks in (1, 3):
        run(ranks, f"{kind}_{element}_{ranks}", BAR.format(element, -100) + RUNS[kind])
        tables.append(history(f"{kind}_{element}_{ranks}"))
    (names, one), (_, three) = tables
    if len(one) != len(three) or len(one) < 3:
        sys.exit(f"{kind}, {element}: {len(one)} and {len(three)} rows")
    compared = 0
    for k, name in enumerate(names):
        if not any(name.startswith(word) for word in ("strain", "kinetic", "volume", "min_J", "max_displacement", "gravity_work")):
            continue
        a, b = ([float(row[k]) for row in rows] for rows in (one, three))
        size = max(abs(x) for x in a)
        worst = max(abs(x - y) for x, y in zip(a, b))
        compared += size > 0
        if not worst <= 1e-8 * size:
            sys.exit(f"{kind}, {element}: column {name} differs by {worst:g} of {size:g}")
    if compared < 4 or not 1e-3 < float(one[-1][names.index("max_displacement")]) < 1:
        sys.exit(f"{kind}, {element}: {compared} columns compared, displacement {one[-1][names.index('max_displacement')]} m")


def check_restart(element):
    """From step 10 on, on the same rank: the same history, to the last digit written. The faces of CR and DG lose rounding with every law."""
    whole = f"dynamic_{element}_1"
    shutil.rmtree(OUT / "restarted", ignore_errors=True)
    shutil.copytree(OUT / whole, OUT / "restarted")
    again(1, "restarted", BAR.format(element, -100) + RUNS["dynamic"] + f"-restart {OUT / 'restarted' / 'checkpoint_000010.h5'}")
    names, before = history(whole)
    _, after = history("restarted")
    kept = [k for k, name in enumerate(names) if not name.startswith(UNLIKE) and "seconds" not in name]
    if len(before) != len(after):
        sys.exit(f"restart, {element}: {len(after)} rows, not {len(before)}")
    for k in kept:
        size = 1 + max(abs(float(row[k])) for row in before)
        for x, y in zip(before, after):
            if x[k] != y[k] and (element[0] == "p" or abs(float(x[k]) - float(y[k])) > 1e-12 * size):
                sys.exit(f"restart, {element}: column {names[k]} is {y[k]}, not {x[k]}")


def check_ledger(element):
    run(1, "ledger", BAR.format(element, -100) + RUNS["static"] + "-ledger true")
    names, rows = history("ledger")
    error = float(rows[-1][names.index("error_space")])
    strain = [float(r[-1][n.index("strain")]) for n, r in (history("ledger"), history(f"static_{element}_1"))]
    if not 1e-3 < error < 1 or strain[0] != strain[1]:
        sys.exit(f"ledger, {element}: error {error} in space; strain energy {strain[0]} J with it, {strain[1]} J without")


def check_view():
    """scenario.opts has the moduli, no young, and gives the same run."""
    text = (OUT / "dynamic_p2_1" / "scenario.opts").read_text()
    words = text.split()
    if "-body_a_alpha" not in words or "-body_b_c10" not in words or "-body_a_young" in words or "-body_a_bulk" not in words:
        sys.exit(f"scenario.opts does not say which constants were used\n{text}")
    run(1, "viewed", str(OUT / "dynamic_p2_1" / "scenario.opts"))
    if history("viewed")[1][-1][:24] != history("dynamic_p2_1")[1][-1][:24]:
        sys.exit("scenario.opts gives another run")


def check_resistance():
    """The bulk modulus or Poisson's ratio of a body goes before that of all; of both alike the error names what was given."""
    bar = ("-bodies a -body_a_mesh box:1,1,1:1 -body_a_material ogden -body_a_mu 1e5 -body_a_alpha 2 -effects hold -effect_hold_type fixed "
           "-effect_hold_on zmin -time static -output_fields none ")
    for options, poisson in (("-body_a_poisson 0.4 -body_default_bulk 1e6", 0.4), ("-body_a_bulk 1e6 -body_default_poisson 0.4", 0.4516129)):
        run(1, "resistance", bar + options)
        found = json.loads((OUT / "resistance" / "run.json").read_text())["bodies"][0]["poisson"]
        if abs(found - poisson) > 1e-6:
            sys.exit(f"{options}: Poisson's ratio {found}, not {poisson}")
    for options, words in (("-body_default_poisson 0.4 -body_default_bulk 1e6", "-body_default_bulk and -body_default_poisson both"),
                           ("-body_a_poisson 0.4 -body_a_bulk 1e6", "-body_a_bulk and -body_a_poisson both")):
        text = run(1, "resistance", bar + options, 1)
        if words not in text:
            sys.exit(f"{options}: {text}")
    text = run(1, "resistance", bar.replace("ogden -body_a_mu 1e5 -body_a_alpha 2", "neohookean -body_a_young 1e5 -body_a_poisson 0.3 -body_a_bulk 1e6"))
    if "it is for types mooney_rivlin, " not in text or "ogden" not in text:
        sys.exit(f"an option of other laws: {text}")


def check_warnings():
    """Unstable constants, with mode and stretch; a modulus that nothing reads; linear tets that lock by a bulk modulus; of copies once."""
    cube = ("-bodies a -body_a_mesh box:0.1,0.1,0.1:1 -body_a_copies grid:2,1,1,0.3,0,0 -body_a_material mooney_rivlin -body_a_c10 1e5 -body_a_c01 {0} "
            "-body_a_bulk {1} -effects hold -effect_hold_type fixed -effect_hold_on zmin -time static -output_fields none ")
    for c01, bulk, more, words in (("-2e4", "1e6", "", ("-body_a_material mooney_rivlin", "equibiaxial tension beyond the stretch 1.6")),
                                   ("1e4", "1e9", "", ("-body_a_bulk 1e+09 Pa", "-body_a_element p1")),
                                   ("1e4", "1e6", "-body_a_young 1e5 ", ("-body_a_young", "moduli of their own")), ("1e4", "1e6", "", ())):
        output = run(1, "warned", cube.format(c01, bulk) + more)
        warnings = [line for line in output.splitlines() if "warning" in line]
        if len(warnings) != bool(words) or not all(word in warnings[0] for word in words):
            sys.exit(f"c01 {c01}, bulk {bulk} {more}: not one warning with {words}, but {warnings}")


def check_inclusion():
    """A stiff core by another law of this kind: its options are those of the inclusion."""
    run(1, "inclusion", BAR.format("p2", -100) + RUNS["static"] + "-body_a_inclusions core -sets core -set_core_at box:-1,-1,-1,0.1,1,1 "
        "-inclusion_core_material gent -inclusion_core_mu 1e6 -inclusion_core_jm 30 -inclusion_core_poisson 0.49")
    with_core, without = (float(history(f)[1][-1][history(f)[0].index("max_displacement")]) for f in ("inclusion", "static_p2_1"))
    if not 0.1 * without < with_core < 0.8 * without:
        sys.exit(f"a stiff half of the bar: {with_core} m, without it {without} m")


def main():
    for element in ("p1", "p2", "cr", "dg"):
        for kind in RUNS:
            check_ranks(element, kind)
        check_restart(element)
        check_ledger(element)
    check_view()
    check_resistance()
    check_warnings()
    check_inclusion()
    print("4 elements, static and dynamic: 1 and 3 ranks, restart, ledger")


main()
