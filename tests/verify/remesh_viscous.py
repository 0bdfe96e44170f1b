"""Re-meshing carries the history of viscoelastic bodies.

A block is drawn to 1.2 times its length and held. Where its stress is uniform a new mesh changes nothing, with every element and integrator, on 1
and 3 ranks; where its ends are clamped the force goes on within what the new mesh changes at once, and relaxes by the same share. A body beside it
that keeps its mesh does not notice, to the last bit; a body that loses its history would jump.
"""

from scene_common import check, finish, history, near, start

BLOCK = ("-bodies b -body_b_mesh box:0.1,0.05,0.05:4,2,2 -body_b_material stable_neohookean -body_b_element {element} -body_b_young 1e5 -body_b_poisson 0.4 -body_b_density 1000 "
         "-body_b_prony_times 0.05,0.4 -body_b_prony_shear 0.3,0.3 -body_b_prony_bulk 0.1,0.2 "
         "-effects root,pull{more} -effect_root_type fixed -effect_root_on xmin -effect_pull_type prescribed_displacement -effect_pull_on xmax "
         "-effect_pull_displacement 0.02*min(1,t/0.02);0;0 {free} -time {time} -ts_dt 0.005 -ts_max_time 0.15 "
         "-output_fields none -output_precision double -snes_rtol 1e-11 -ksp_rtol 1e-11 ")
# nothing but the ends along x is held, and mass is too small to matter: uniform stress
UNIFORM = "-body_b_density 1e-3 -effect_root_components x -effect_pull_components x"


def run(folder, options, ranks=1, code=0):
    text = start(folder, options, ranks, code)
    return text if code else (text, history(folder)["pull_reaction_x"])


for element, time in (("p1", "euler_implicit"), ("p1", "genalpha"), ("p2", "newmark"), ("cr", "euler_implicit"), ("dg", "euler_implicit")):
    for ranks in (1, 3):
        scene = BLOCK.format(element=element, time=time, free=UNIFORM, more="")
        _, whole = run("whole", scene, ranks)
        text, new = run("new", scene + "-remesh_times 0.05", ranks)
        check("re-meshed after step 10" in text, text)
        near(new[-1] / whole[-1], 1, 1e-6, f"{element}, {time}, {ranks} ranks, uniform: force at the end over that with one mesh")
        check(whole[-1] < 0.9 * whole[10], "the force does not relax")
# clamped ends, and a body beside it that keeps its mesh
OTHER = ("-bodies b,c -body_c_mesh box:0.1,0.05,0.05:4,2,2 -body_c_translate 0,0.1,0 -body_c_material corotated -body_c_young 1e5 -body_c_poisson 0.4 -body_c_density 1000 "
         "-body_c_element p2 -body_c_prony_times 0.1 -body_c_prony_shear 0.5 -effect_root_on b.xmin,c.xmin -effect_pull_on b.xmax,c.xmax -remesh_bodies b -probes tip -probe_tip_in c "
         "-probe_tip_fields von_mises ")
for element in ("p1", "p2"):
    _, whole = run("whole", BLOCK.format(element=element, time="euler_implicit", free="", more=""))
    text, new = run("new", BLOCK.format(element=element, time="euler_implicit", free="", more="") + "-remesh_times 0.05")
    check("re-meshed after step 10" in text, text)
    near(new[-1] / new[11], whole[-1] / whole[11], 0.016, f"{element}, clamped: share that is left")
    near(new[11] / new[10], whole[11] / whole[10], 0.05, f"{element}, clamped: force across the new mesh")
run("whole", BLOCK.format(element="p1", time="euler_implicit", free="", more="") + OTHER)
before = history("whole")["tip_von_mises"]
run("new", BLOCK.format(element="p1", time="euler_implicit", free="", more="") + OTHER + "-remesh_times 0.05")
near(history("new")["tip_von_mises"][-1] / before[-1], 1, 1e-9, "the body beside it: stress over that with one mesh")
finish()
