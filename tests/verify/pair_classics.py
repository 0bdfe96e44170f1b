"""Known results of contact between bodies, by the responses with exact constraints.

Two elastic bars collide lengthwise: the force is rho c v A / 2 for the time 2 L / c, then they have exchanged their velocities. Three blocks of
different sizes lie on each other: each joint bears what is above it. An arch of seven stones stands by friction alone, its feet push outwards.
"""
import csv
import math
import subprocess
import sys

import numpy

from output_common import MPI, OUT, SUPPLE

BODY = "-body_{0}_mesh {1} -body_{0}_material {2} -body_{0}_young {3} -body_{0}_poisson {4} -body_{0}_density 1000 "


def run(name, options, ranks=1):
    command = [*MPI, str(ranks), SUPPLE, *options.split(), "-quiet", "-output_fields", "none", "-output_dir", str(OUT / name)]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode:
        sys.exit(f"{name}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    with open(OUT / name / "history.csv", newline="") as f:
        names, _, *rows = csv.reader(f)
    return {key: numpy.array([float(row[k]) for row in rows]) for k, key in enumerate(names)}


def check(good, text):
    if not good:
        sys.exit(text)


def check_bars(response):
    """nu = 0, so that the bars are of one dimension: c = sqrt(E / rho) = 31.6 m/s."""
    length, area, c, v = 1.0, 0.01, math.sqrt(1e6 / 1000), 0.5
    options = ("-bodies a,b " + "".join(BODY.format(k, f"box:{length},0.1,0.1:40,1,1", "linear", "1e6", "0") for k in "ab")
               + f"-body_b_translate {length + 0.002},0,0 -body_a_velocity {v},0,0 -effects meet -effect_meet_type contact "
               f"-effect_meet_response {response} -effect_meet_barrier_width 1e-3 -time euler_implicit -ts_dt 1e-4 -ts_max_time 0.08 -probes a,b -probe_a_in a "
               "-probe_b_in b -probe_a_fields velocity -probe_b_fields velocity")
    found = run(f"bars-{response}", options)
    force = found["meet_normal_force"]
    expected, duration = 1000 * c * v * area / 2, 2 * length / c
    touch = force > 0.5 * expected
    middle = force[touch][len(force[touch]) // 4: -len(force[touch]) // 4].mean()
    lasted = touch.sum() * 1e-4
    print(f"  bars-{response}: force {middle / expected:.4f}, duration {lasted / duration:.4f} of the wave's, "
          f"velocities {found['a_velocity_x'][-1]:.4f}, {found['b_velocity_x'][-1]:.4f} m/s")
    check(abs(middle / expected - 1) < 0.01, f"bars-{response}: force {middle} N, not {expected}")
    check(abs(lasted / duration - 1) < 0.05, f"bars-{response}: touched for {lasted} s, not {duration}")
    check(abs(found["b_velocity_x"][-1] / v - 1) < 0.04, f"bars-{response}: velocity {found['b_velocity_x'][-1]} m/s")


def check_stack(response):
    """Static, held by friction alone; then in time: nothing moves."""
    sizes = ("0.3,0.3,0.1:4", "0.2,0.2,0.1:3", "0.1,0.12,0.1:2")
    options = "-bodies a,b,c " + "".join(BODY.format(k, "box:" + s, "stable_neohookean", "1e6", "0.3") for k, s in zip("abc", sizes))
    options += ("-body_b_translate 0.05,0.04,0.1003 -body_c_translate 0.11,0.07,0.2006 -effects g,hold,meet -effect_g_type gravity "
                "-effect_hold_type fixed -effect_hold_on a.zmin -effect_meet_type contact -effect_meet_friction 0.5 -effect_meet_pairs yes "
                f"-effect_meet_barrier_width 3e-4 -effect_meet_response {response} ")
    found = run(f"stack-{response}", options + "-time static")
    upper = 1000 * 9.81 * 0.1 * 0.12 * 0.1
    middle = upper + 1000 * 9.81 * 0.2 * 0.2 * 0.1
    for column, weight in ("meet_b_c_force_z", upper), ("meet_a_b_force_z", middle):
        off = found[column][-1] / weight - 1
        print(f"  stack-{response}: {column} {off:.1e} off")
        check(abs(off) < 1e-6, f"stack-{response}: {column} is {found[column][-1]} N, not {weight}")


def check_arch(response, stones=7, gap=1e-4, young="1e8", name="arch"):
    """Stones of a half circle of 1 m, 0.25 m thick: wedges, each of 6 tets, with joints of the width `gap`. Of stiff stone, 10 and 30 GPa, the
    springs of the first attempt make Newton's method cycle."""
    options = "-bodies " + ",".join(f"s{k}" for k in range(stones)) + " "
    for k in range(stones):
        shrink = gap / 2 / 1.0
        angles = (math.pi * k / stones + shrink * (k > 0), math.pi * (k + 1) / stones - shrink * (k + 1 < stones))
        corners = [(-r * math.cos(a), y, r * math.sin(a)) for y in (0, 0.3) for a in angles for r in (0.875, 1.125)]
        # corners by r, then angle, then y; a hexahedron as six tets around its diagonal from 0 to 7
        tets = [(0, 7, *pair) for pair in ((1, 3), (3, 2), (2, 6), (6, 4), (4, 5), (5, 1))]
        path = OUT / f"{name}{stones}-stone{k}.msh"
        with open(path, "w") as f:
            f.write("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n")
            f.writelines(f"{i + 1} {x:.12g} {y:.12g} {z:.12g}\n" for i, (x, y, z) in enumerate(corners))
            f.write("$EndNodes\n$Elements\n6\n")
            for i, tet in enumerate(tets):
                a, b, c, d = (numpy.array(corners[j]) for j in tet)
                tet = tet if numpy.dot(numpy.cross(b - a, c - a), d - a) > 0 else (tet[1], tet[0], *tet[2:])
                f.write(f"{i + 1} 4 2 0 1 " + " ".join(str(j + 1) for j in tet) + "\n")
            f.write("$EndElements\n")
        options += BODY.format(f"s{k}", path, "stable_neohookean", young, "0.2")
    options += (f"-sets left,right -set_left_at plane:0,0,1,0 -set_right_at plane:0,0,1,0 -effects g,hold,meet -effect_g_type gravity "
                "-effect_hold_type fixed -effect_hold_on left -effect_meet_type contact -effect_meet_friction 0.6 -effect_meet_pairs yes "
                f"-effect_meet_barrier_width {gap} -effect_meet_response {response} -effect_meet_verify yes -time static")
    if name == "refused":
        check_refused(options)
        return
    name = f"{name}-{response}"
    found = run(name, options)
    # of the wedges; each joint takes half of it from both of its stones
    stone = 1000 * 9.81 * 0.3 * (1.125**2 - 0.875**2) / 2 * math.sin(math.pi / stones - gap)
    top = found[f"meet_s{stones // 2 - 1}_s{stones // 2}_force_z"][-1] - found[f"meet_s{stones // 2}_s{stones // 2 + 1}_force_z"][-1]
    left, right = found[f"meet_s{stones // 2 - 1}_s{stones // 2}_force_x"][-1], found[f"meet_s{stones // 2}_s{stones // 2 + 1}_force_x"][-1]
    print(f"  {name}: {found['newton'][-1]:.0f} Newton iterations, thrust {left:.3f} and {right:.3f} N, "
          f"the joints bear {top / stone:.7f} of the keystone")
    check(abs(top / stone - 1) < 1e-4, f"{name}: the keystone of {stone} N is borne by {top} N")
    check(abs(left / right - 1) < 1e-3, f"{name}: thrust {left} N on one side, {right} N on the other")
    check(abs(left) > 0.1 * stone * stones, f"{name}: thrust {left} N, without which no arch stands")
    check(found["meet_penetration"][-1] < 1e-3 * gap, f"{name}: penetration {found['meet_penetration'][-1]} m")


def check_refused(options):
    """Where Newton's method fails, contact that holds a body is not forgotten: that nothing held it was said of every body without supports."""
    command = [*MPI, "1", SUPPLE, *options.split(), "-quiet", "-output_fields", "none", "-output_dir", str(OUT / "refused"), "-snes_max_it", "2",
               "-time_max_halvings", "0"]
    result = subprocess.run(command, capture_output=True, text=True)
    text = result.stdout + result.stderr
    check(result.returncode and "DIVERGED_MAX_IT" in text and "nothing holds" not in text, f"refused: exit code {result.returncode}\n{text}")


for response in "projected", "multiplier":
    check_bars(response)
    check_stack(response)
check_arch("projected")
check_arch("projected", 9, 1e-4, "1e10", "stone")
check_arch("multiplier", 7, 1e-3, "3e10", "stone")
check_arch("projected", 7, 1e-3, "3e10", "refused")
