"""The effect tie: two surfaces held together whose meshes need not match.

Two blocks, one on the other, with meshes that do not match, are stretched: the stress is even to rounding with every pair of elements, on 1 and 3
ranks. Two tied bodies with a gap between them turn in space, and keep energy and momenta. A cantilever of two halves bends as one of a piece. A
soft block hangs from a rigid plate by its weight. Half and twice the stiffness that a tie has by itself change little. Thin sheets are tied where
they touch, not at their far sides, and a pair of facets that both surfaces have counts once. Glue that is too weak parts, a run that goes on from a checkpoint is the same run, and a tie lets
go at a given time. Surfaces that are apart, face away, or that nothing can be said of are an error.
"""
import numpy

from scene_common import check, finish, history, near, start

COMMON = "-quiet -output_fields none -output_precision double -reproducible -snes_rtol 1e-10 -ksp_rtol 1e-10 "
LAW = "-body_{0}_material {1} -body_{0}_element {2} -body_{0}_young {3} -body_{0}_poisson 0.3 -body_{0}_density 1000 "


def run(folder, options, ranks=1, code=0):
    return start(folder, COMMON + options, ranks, code)


def body(name, mesh, young=1e6, law="linear", element="p1"):
    return f"-body_{name}_mesh box:{mesh} " + LAW.format(name, law, element, young)


def last(folder):
    return {name: values[-1] for name, values in history(folder).items()}


# blocks of 2 and 3 cells across, 10 cm high each, 1e6 Pa; k = 1e8 Pa/m: stress 1 mm / (0.2 m / E + 1 / k) = 4761.9 Pa
STRETCH = ("-body_b_translate 0,0,0.1 -sets left,front,low,top,under,on -set_left_at plane:1,0,0,0 -set_front_at plane:0,1,0,0 -set_low_at plane:0,0,1,0 "
           "-set_top_at plane:0,0,1,0.2 -set_under_at body:a -set_on_at body:b -effects glue,x,y,z,pull "
           "-effect_glue_type tie -effect_glue_on on -effect_glue_to under -effect_glue_stiffness 1e8 -effect_x_type fixed -effect_x_on left -effect_x_components x "
           "-effect_y_type fixed -effect_y_on front -effect_y_components y -effect_z_type fixed -effect_z_on low -effect_z_components z "
           "-effect_pull_type prescribed_displacement -effect_pull_on top -effect_pull_components z -effect_pull_displacement 0;0;1e-3 -time static ")
stress = 1e-3 / (0.2 / 1e6 + 1 / 1e8)
for below, above in (("p1", "p1"), ("p2", "p2"), ("cr", "cr"), ("dg", "dg"), ("p2", "cr"), ("p1", "dg")):
    what = f"{above} on {below}"
    blocks = "-bodies a,b " + body("a", "0.1,0.1,0.1:2", element=below) + body("b", "0.1,0.1,0.1:3", element=above)
    for ranks in (1, 3):
        run("stretch", blocks + STRETCH, ranks)
        end = last("stretch")
        near(end["glue_force_z"], -stress * 0.01, 1e-8 * stress * 0.01, f"{what}, {ranks} ranks: force")
        near(end["strain"], stress**2 / 2e6 * 0.002, 1e-8 * end["strain"], f"{what}, {ranks} ranks: strain energy, J")
        near(end["glue_energy"], stress**2 / 2e8 * 0.01, 1e-8 * end["glue_energy"], f"{what}, {ranks} ranks: energy of the tie, J")
        near(end["glue_area"], 0.01, 1e-12, f"{what}, {ranks} ranks: area")

# two blocks with a gap of 1 mm between them turn about no axis of symmetry: energy and momenta stay, the tie is not stretched
TURN = ("-bodies a,b " + body("a", "0.1,0.1,0.1:2", law="corotated", element="p2") + body("b", "0.06,0.08,0.1:2", law="corotated")
        + "-body_b_translate 0.02,0.01,0.101 -sets under,on -set_under_at body:a -set_on_at body:b -effects glue -effect_glue_type tie -effect_glue_on on "
        "-effect_glue_to under -effect_glue_distance 2e-3 -time newmark -ts_dt 5e-4 -ts_max_time 0.05 ")
SPIN = "-body_a_angular_velocity 3,2,1 -body_b_angular_velocity 3,2,1 -body_a_velocity -0.1,0.15,0 -body_b_velocity 0.102,-0.153,0 "
first = None
for ranks in (1, 3):
    run("turn", TURN + SPIN, ranks)
    turn = history("turn")
    total = turn["kinetic"] + turn["strain"] + turn["glue_energy"]
    near(numpy.abs(total / total[0] - 1).max(), 0, 1e-3, f"{ranks} ranks: energy")
    for name in ("momentum_x", "angular_z", "angular_x"):
        near(numpy.abs(turn[name] - turn[name][0]).max(), 0, 1e-7, f"{ranks} ranks: {name}")
    first = first or last("turn")
near(last("turn")["strain"], first["strain"], 1e-6 * first["strain"], "1 and 3 ranks: strain energy")

# a cantilever of 0.4 m under its weight: halves with other meshes, glued along its middle plane, and one of a piece
CANTILEVER = ("-sets left,under,on -set_left_at plane:1,0,0,0 -set_under_at body:a -set_on_at body:{} -time static -effects gravity,clamp{} "
              "-effect_clamp_type fixed -effect_clamp_on left ")
run("whole", "-bodies a " + body("a", "0.4,0.1,0.1:16,4,4", element="p2") + CANTILEVER.format("a", ""))
GLUE = CANTILEVER.format("b", ",glue") + "-effect_glue_type tie -effect_glue_on on -effect_glue_to under "
HALVES = "-bodies a,b " + body("a", "0.4,0.1,0.05:12,3,2", element="p2") + body("b", "0.4,0.1,0.05:16,4,2", element="p2") + "-body_b_translate 0,0,0.05 "
whole = last("whole")["strain"]
run("halves", HALVES + GLUE, 2)
near(last("halves")["strain"], whole, 0.01 * whole, "glued halves: strain energy, J")
near(last("halves")["newton"], 1, 1, "glued halves: iterations")
run("halves", HALVES + GLUE + "-effect_glue_stiffness 1", 2)
near(last("halves")["strain"] / whole, 4, 0.5, "loose halves: strain energy, over that of one piece")

# the same mesh in two halves: what half and twice the stiffness of 100 E / h add to the energy and to linear iterations; h = 35.4 mm
CELLS = "-body_a_element p1 -body_b_element p1 -body_a_mesh box:0.4,0.1,0.05:16,4,2 -body_b_mesh box:0.4,0.1,0.05:16,4,2 "
run("whole", "-bodies a " + body("a", "0.4,0.1,0.1:16,4,4") + CANTILEVER.format("a", ""))
whole = last("whole")["strain"]
for factor, more in ((50, 5e-6), (100, 2e-6), (200, 1e-6)):
    run("halves", HALVES + CELLS + GLUE + f"-solver cg_two_level -effect_glue_stiffness {factor * 1e6 / (0.025 * 2**0.5):.17g}")
    near(last("halves")["strain"] / whole - 1, more / 2, more / 2, f"halves, {factor} E / h, {last('halves')['linear']:g} linear iterations: energy, over that of one piece, less 1")

# sheets that are thinner than a tenth of their cells: the upper one is tied to the lower one by the sides that touch
SHEETS = ("-bodies a,b " + body("a", "0.2,0.2,0.002:4,4,1") + body("b", "0.2,0.2,0.002:3,3,1") + "-body_b_translate 0,0,0.002 -sets under,on -set_under_at body:a "
          "-set_on_at body:b -effects glue -effect_glue_type tie -effect_glue_on on -effect_glue_to under -ts_max_time 0.01 ")
run("sheets", SHEETS)
near(last("sheets")["glue_area"], 0.04, 1e-9, "thin sheets: area, m^2")
run("sheets", SHEETS + "-effect_glue_on on,under -effect_glue_to under,on ")
near(last("sheets")["glue_area"], 0.04, 1e-9, "named both ways: area, m^2")

# a soft block of 1 kg hangs from a rigid plate
run("hang", "-bodies a,b -body_a_mesh box:0.1,0.1,0.02:2 -body_a_rigid yes -body_a_density 1000 -body_a_translate 0,0,0.1 "
    + body("b", "0.1,0.1,0.1:3", law="neohookean", element="p2") + "-sets under,on -set_under_at body:a -set_on_at body:b -effects gravity,hold,glue "
    "-effect_hold_type fixed -effect_hold_on under -effect_glue_type tie -effect_glue_on on -effect_glue_to under -time static ")
near(last("hang")["glue_force_z"], 9.81, 1e-6, "block on a rigid plate: force of the tie, N")
near(last("hang")["hold_reaction_z"], 9.81 * 1.2, 1e-6, "reaction of the plate, N")

# glue that holds 3000 Pa parts before it reaches 4762 Pa
PULL = ("-bodies a,b " + body("a", "0.1,0.1,0.1:2") + body("b", "0.1,0.1,0.1:3") + STRETCH + "-static_steps 8 ")
run("tear", PULL + "-effect_glue_strength 3000", 2)
tear = history("tear")
near(tear["glue_force_z"][5], -stress * 0.01 * 5 / 8, 1e-6, "before it parts: force, N")
near(abs(tear["glue_force_z"][6:]).max() + tear["glue_area"][-1] + tear["strain"][-1], 0, 1e-9, "after it has parted: force, area, strain")

# a load step is solved again without what parts in it: in one step, and along a path
for steps, more in ((1, ""), (4, "-static_control arc_length ")):
    run("tear", PULL.replace("-static_steps 8", f"-static_steps {steps}") + more + "-effect_glue_strength 3000", 2)
    near(abs(last("tear")["glue_force_z"]) + last("tear")["glue_area"] + last("tear")["strain"], 0, 1e-9, f"{steps} steps {more}: force, area, strain")

# sides of bodies are named without a set
run("sides", PULL.replace("-effect_glue_on on -effect_glue_to under", "-effect_glue_on b.zmin -effect_glue_to a.zmax"))
near(last("sides")["glue_force_z"], -stress * 0.01, 1e-8, "by the sides' names: force, N")

# it lets go at a given time
run("let-go", PULL + "-effect_glue_until 0.5")
near(history("let-go")["glue_force_z"][4], -stress * 0.01 / 2, 1e-6, "a tie until 0.5: force, N")
near(abs(history("let-go")["glue_force_z"][5:]).max(), 0, 1e-12, "after that")

# a bond that tears from one side, as the plate is lifted at its end; the run from a checkpoint is the same run on another number of ranks
PEEL = ("-bodies a,b " + body("a", "0.2,0.05,0.02:8,2,1") + body("b", "0.2,0.05,0.02:12,3,1", law="corotated") + "-body_b_translate 0,0,0.02 "
        "-sets under,on,base,end -set_under_at body:a -set_on_at body:b -set_base_at plane:0,0,1,0 -set_end_at box:0.19,-1,0.03,0.21,1,0.05 -effects glue,hold,lift "
        "-effect_glue_type tie -effect_glue_on on -effect_glue_to under -effect_glue_strength 4e3 -effect_hold_type fixed -effect_hold_on base "
        "-effect_lift_type prescribed_displacement -effect_lift_on end -effect_lift_components z -effect_lift_displacement 0;0;0.02*t "
        "-time euler_implicit -ts_dt 0.005 ")
run("peel", PEEL + "-ts_max_time 0.1 -checkpoint_every_time 0.05", 1)
peel = history("peel")
area = peel["glue_area"]
check((numpy.diff(area) <= 1e-15).all(), "the area that holds grows")
check(0 < area[-1] < 0.9 * area[0], f"a part of the bond should be left: {area[-1]} of {area[0]} m^2")

# statically, whatever the number of load steps: in equilibrium, and all in all the same bond is left
left = {}
for steps in (1, 4, 16):
    run("peel-static", PEEL.replace("-time euler_implicit -ts_dt 0.005", "-time static") + f"-static_steps {steps} -effect_lift_displacement 0;0;0.002*t", 2)
    end = last("peel-static")
    left[steps] = end["glue_area"] / area[0]
    near(end["hold_reaction_z"] + end["lift_reaction_z"], 0, 1e-6 * abs(end["lift_reaction_z"]), f"static peeling, {steps} steps: sum of the reactions, N")
check(0 < min(left.values()) and max(left.values()) < 0.9, f"static peeling: left of the bond {left}")
near(max(left.values()) - min(left.values()), 0, 0.1, f"static peeling: what is left depends on the steps: {left}")
run("peel-on", PEEL + "-ts_max_time 0.05 -checkpoint_every_time 0.05", 1)
run("peel-on", PEEL + "-ts_max_time 0.1 -checkpoint_every_time 0.05 -restart latest", 3)
near(last("peel-on")["glue_area"], area[-1], 1e-12, "restart: area, m^2")
near(last("peel-on")["glue_force_z"], peel["glue_force_z"][-1], 1e-5 * abs(peel["glue_force_z"]).max(), "restart: force, N")

ALONE = "-bodies a,b " + body("a", "0.1,0.1,0.1:2") + body("b", "0.1,0.1,0.1:2")
SETS = "-sets under,on -set_under_at body:a -set_on_at body:b -effects glue -effect_glue_type tie -effect_glue_on on -effect_glue_to under -ts_max_time 0.01 "
RIGID = "-body_b_translate 0,0,0.1 " + "".join(f"-body_{name}_rigid yes -body_{name}_mesh box:0.1,0.1,0.1:2 -body_{name}_density 1000 " for name in "ab")
ERRORS = ((ALONE + "-body_b_translate 0,0,0.15 " + SETS, "0.05 m away"), (ALONE + "-body_b_translate 0,0,0.1 " + SETS.replace("-effect_glue_to under", ""), "-effect_glue_to"),
          ("-bodies a,b " + RIGID + SETS, "-effect_glue_stiffness (Pa/m)"),
          (ALONE + "-body_b_translate 0,0,0.1 " + SETS + "-time euler_explicit ", "euler_explicit"),
          (ALONE + "-body_b_translate 0,0,0.1 " + SETS + "-effect_glue_strength 1e3 -remesh_times 0.005 ", "re-meshed"),
          (ALONE + "-body_b_translate 0,0,0.1 " + SETS + "-effect_glue_strength -1 ", "-effect_glue_strength"))
for options, words in ERRORS:
    text = run("error", options, code=1)
    check(words in text, f"{words}: {text}")
text = run("tilted", ALONE + "-body_b_translate 0,0,0.101 -body_b_rotate 0,1,0,5 " + SETS)
check("m^2 are held" in text and "-effect_glue_distance" in text, text)

# what holds or presses the same surfaces twice
TOUCH = ALONE + "-body_b_translate 0,0,0.1 " + SETS
AGAIN = TOUCH + "-effects glue,more -effect_more_type tie "
for options, words in ((AGAIN + "-effect_more_on on -effect_more_to under ", "effects glue and more"), (AGAIN + "-effect_more_on under -effect_more_to on ", "effects glue and more"),
                       (TOUCH + "-effects glue,meet -effect_meet_type contact ", "effect meet is contact"), (AGAIN + "-effect_more_on on -effect_more_to under -effect_glue_until 0.005 -effect_more_from 0.005", ""),
                       (TOUCH + "-effects glue,meet -effect_meet_type contact -effect_meet_obstacle plane:0,0,1,-1 ", "")):
    text = run("twice", options)
    check(words in text if words else "warning" not in text, f"{words or 'no warning'}: {text}")
finish()
