"""Boxes without supports that touch or overlap held ones when a static run begins, on one side, on one side beside a gap, and in a corner of three:
they are moved out of each other, have no energy before the first load step, and end under their weight as those that begin apart by the barrier's
width; strain energy is the work of the loads, and nothing is lost. With P1, P2 and CR, every response, on 1 and 3 ranks. The warning says how they
were parted. Supports that come later do the work of what they move."""
import csv
import os
import subprocess
import sys
from pathlib import Path

OUT = Path(os.environ["SB_OUT"])
SIZE, DEEP, SMALL = 0.1, 1e-3, 0.06
WIDTH, SMALLER = 1e-3 * SIZE * 3**0.5, 1e-3 * (2 * SMALL**2 + SIZE**2) ** 0.5
# Energies of gaps and of the trapezoidal rule, over the strain energy: 6e-3 of barriers, 8e-3 with friction, 6e-4 of others; where starts gave energy 0.3 to 500.
LOST, SAME = 2e-2, 1e-2
passed = failed = 0


def check(name: str, bad: list[str]) -> None:
    global passed, failed
    passed, failed = passed + (not bad), failed + bool(bad)
    if bad:
        print(f"FAILED: {name}: {'; '.join(bad)}")


def run(name: str, options: str, ranks: int = 1) -> tuple[subprocess.CompletedProcess, list[dict]]:
    """The run, and the rows of its history."""
    done = subprocess.run([*os.environ["SB_MPI"].split(), str(ranks), os.environ["SB_SUPPLE"], *(
        "-body_default_material stable_neohookean -body_default_young 1e6 -body_default_poisson 0.3 -body_default_density 1000 -time static "
        f"-output_every 0 -output_dir {OUT / name} {options}").split()], capture_output=True, text=True, check=False)
    rows = list(csv.reader(open(OUT / name / "history.csv", encoding="utf-8"))) if done.returncode == 0 else []
    return done, [{k: float(v) for k, v in zip(rows[0], row, strict=False)} for row in rows[2:]]


def faults(done: subprocess.CompletedProcess, rows: list[dict], apart: list[dict]) -> list[str]:
    """What is wrong with a run; the rows of one that begins apart."""
    if done.returncode or not apart:
        return [f"exit code {done.returncode}: {done.stderr[-300:]}", f"rows apart: {len(apart)}"]
    end, strain = rows[-1], rows[-1]["strain"]
    bad = []
    if abs(strain - apart[-1]["strain"]) > SAME * strain:
        bad.append(f"strain energy {strain} J, from apart {apart[-1]['strain']} J")
    if rows[0]["strain"] > 1e-12 or rows[0]["load_work"] > 1e-12:
        bad.append(f"{rows[0]['strain']} J of strain at the start, work {rows[0]['load_work']} J")
    if abs(end["integrator_loss"]) > LOST * strain or abs(end["meet_work"]) > 0.05 * strain:
        bad.append(f"loss {end['integrator_loss']} J, work of contact {end['meet_work']} J, strain {strain} J")
    if end["meet_unguarded"] or end["max_displacement"] > 3 * DEEP:
        bad.append(f"{end['meet_unguarded']} intersections, {end['max_displacement']} m")
    return bad


# on a held box, beside another one or not
ON = ("-bodies a,c{2} -effects meet,ha,g{3} -effect_g_type gravity -effect_meet_type contact -effect_meet_verify yes -body_c_mesh box:0.1,0.1,0.1:2 "
      "-body_a_mesh box:0.1,0.1,0.1:3 -body_c_translate 0,0,{0:.17g} -effect_ha_type fixed -effect_ha_on a.zmin -effect_meet_friction 0.3 {1}")
BESIDE = "-body_d_mesh box:0.1,0.1,0.1:3 -body_d_translate 0.102,0,0.12 -effect_hd_type fixed -effect_hd_on d.xmax "
RESPONSES = ("barrier", "penalty", "augmented", "projected", "multiplier")
CASES = [(depth, response, "p1", 1, "") for response in RESPONSES for depth in (-0.3 * WIDTH, 0.0, 0.5 * WIDTH, DEEP)]
CASES += [(depth, response, element, 1, "") for element in ("p2", "cr") for response in ("barrier", "projected") for depth in (0.0, DEEP)]
CASES += [(DEEP, response, "p1", 1, BESIDE) for response in ("barrier", "projected")] + [(DEEP, response, "p1", 3, "") for response in ("barrier", "multiplier")]
known: dict[tuple, list[dict]] = {}
for i, (depth, response, element, ranks, extra) in enumerate(CASES):
    more = (",d", ",hd") if extra else ("", "")
    extra += f"-effect_meet_response {response} -body_default_element {element}"
    if extra not in known:
        known[extra] = run(f"apart{i}", ON.format(SIZE + WIDTH, extra, *more))[1]
    done, rows = run(f"on{i}", ON.format(SIZE - depth, extra, *more), ranks)
    bad = faults(done, rows, known[extra])
    if ("They are moved apart\n" in done.stderr) != (depth == DEEP):
        bad.append(f"said: {done.stderr[-300:]}")
    check(f"on a held box, {depth} m deep, {ranks} ranks {extra}", bad)

# in a corner of three held boxes that do not touch each other; stiff ones that are hardly strained
CORNER = ("-bodies a,d,f,c -effects meet,ha,hd,hf,g -effect_g_type gravity -effect_g_vector {0} -effect_meet_type contact -effect_meet_verify yes "
          "-body_c_mesh box:0.1,0.1,0.1:3 ")


def corner(depths: tuple[float, ...], extra: str) -> str:
    text = CORNER.format("-5.7,-5.6,-5.8") + extra
    for axis, (body, depth) in enumerate(zip("adf", depths, strict=True)):
        size, at = [SMALL] * 3, [0.02] * 3
        size[axis], at[axis] = SIZE, depth - SIZE
        text += (f" -body_{body}_mesh box:{size[0]},{size[1]},{size[2]}:2 -body_{body}_translate {at[0]:.17g},{at[1]:.17g},{at[2]:.17g}"
                 f" -effect_h{body}_type fixed -effect_h{body}_on {body}.{'xyz'[axis]}min")
    return text


for i, (depths, response, element, ranks) in enumerate((
        ((DEEP, DEEP, DEEP), "barrier", "p1", 1), ((DEEP, DEEP, DEEP), "barrier", "p1", 3), ((DEEP, 0.5 * DEEP, 2 * DEEP), "barrier", "p1", 1),
        ((DEEP, DEEP, DEEP), "projected", "p1", 1), ((DEEP, 0.5 * DEEP, 2 * DEEP), "multiplier", "p1", 1), ((DEEP, DEEP, DEEP), "penalty", "p1", 1),
        ((DEEP, DEEP, DEEP), "barrier", "cr", 1), ((0.0, 0.0, 0.0), "barrier", "p1", 1))):
    extra = f"-effect_meet_response {response} -body_default_element {element}"
    done, rows = run(f"corner{i}", corner(depths, extra), ranks)
    check(f"in a corner, {depths} m deep, {ranks} ranks {extra}", faults(done, rows, run(f"corner{i}apart", corner((-0.999 * SMALLER,) * 3, extra))[1]))
stiff = "-body_default_young 2e11 -effect_meet_response "
for response in ("barrier", "projected"):
    done, rows = run("stiff", ON.format(SIZE, stiff + response, "", ""))
    good = done.returncode == 0 and rows[-1]["load_work"] < 1e-6
    check(f"steel, {response}", [] if good else [f"{done.returncode} {done.stderr[-300:]} {rows}"])

# supports that come at half of the load: without contact, and of what contact holds
BAR = ("-bodies a -body_a_mesh box:0.3,0.1,0.1:2 -static_steps 4 -effects g,c,s -effect_g_type gravity -effect_c_type fixed -effect_c_on a.xmin -effect_s_on a.xmax "
       "-effect_s_from 0.5 -effect_s_type ")
LATE = "-static_steps 4 -effects meet,ha,g,s -effect_s_from 0.5 -effect_s_type fixed -effect_s_on c.zmax -effect_meet_response "
CASES = [(f"{kind} {element}", f"{BAR} {kind} -body_a_element {element}") for kind in ("fixed", "prescribed_displacement -effect_s_displacement 0.001;0;0")
         for element in ("p1", "p2", "cr")]
CASES += [(response, ON.format(SIZE - depth, LATE + response, "", "")) for response in ("barrier", "projected") for depth in (0.0,)]
for name, scene in CASES:
    done, rows = run("late", scene)
    bad = [done.stderr[-300:]] if done.returncode else []
    # the reaction grows from zero in the step; the trapezoidal rule has its work within some per cent
    if rows and any(abs(row["integrator_loss"]) > 0.05 * max(row["strain"] for row in rows) for row in rows):
        bad.append(f"loss {[row['integrator_loss'] for row in rows]} J of {[row['strain'] for row in rows]} J")
    if rows and not abs(rows[-1]["prescribed_work"]) > 0.01 * max(row["strain"] for row in rows):
        bad.append(f"work of supports {rows[-1]['prescribed_work']} J")
    check(f"late support, {name}", bad)
print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
