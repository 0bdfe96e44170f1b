"""The effect water: buoyancy below a level, and drag.

Blocks of every element float at their draught, on 1 and 3 ranks; a rigid one heaves and rolls with the periods of naval architecture, and keeps its energy;
a sinking one has the speed of its drag; a rod bends in a current as a beam does; a wall bears the pressure of the water in front of it. A soft block that
falls into water has the same numbers on 1 and 3 ranks and after a restart, and its energies add up. What is no water is an error.
"""
import math

import numpy

from scene_common import check, finish, history, near, start

COMMON = "-quiet -output_fields none -output_precision double -reproducible -snes_rtol 1e-10 -ksp_rtol 1e-10 "
G = 9.81


def run(folder, options, ranks=1, code=0):
    return start(folder, COMMON + options, ranks, code)


def last(folder):
    return {name: values[-1] for name, values in history(folder).items()}


def period(time, values):
    """The time between the first two rises through zero, and the next."""
    up = [k for k in range(len(time) - 1) if values[k] < 0 <= values[k + 1]]
    at = [time[k] - values[k] * (time[k + 1] - time[k]) / (values[k + 1] - values[k]) for k in up]
    return (at[-1] - at[0]) / (len(at) - 1)


# a block of 600 kg/m^3 is 0.06 m in the water, its bottom at -0.02 m, with facets that the water line cuts; without Poisson's ratio it stays a prism
BLOCK = "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_material linear -body_a_young {} -body_a_poisson 0 -body_a_density 600 -body_a_element {} "
FLOAT = ("-effects gravity,water,hold -effect_water_level 0.04 -effect_hold_type fixed -effect_hold_on a -effect_hold_components xy -time static "
         "-probes foot -probe_foot_at 0.05,0.05,0 ")
for element in ("p1", "p2", "cr", "dg"):
    for ranks in (1, 3):
        run("float", BLOCK.format(1e8, element) + FLOAT, ranks)
        end = last("float")
        near(end["foot_uz"], -0.02, 2e-6, f"{element}, {ranks} ranks: the bottom goes down, m")
        near(end["water_volume"], 0.6e-3, 1e-9, f"{element}, {ranks} ranks: volume below the level, m^3")
        near(end["water_energy"], 1000 * G * 0.01 * 0.06**2 / 2, 2e-7, f"{element}, {ranks} ranks: energy, J")
        check(end["newton"] <= 8, f"{element}: {end['newton']} iterations")

# facets of a box that lies askew, cut by the level anywhere: force and energy of the tilted box, by cubes of a hundredth of its sides
ASKEW = "-bodies a -body_a_mesh box:0.1,0.2,0.3:2 -body_a_rotate 1,2,0.5,40 -body_a_material linear -body_a_poisson 0 -body_a_density 1000 -body_a_young 1e9 -body_a_element {} -effects gravity,water,hold -effect_hold_type fixed -effect_hold_on a -time static "
axis = numpy.array([1, 2, 0.5]) / math.sqrt(5.25)
X = numpy.stack(numpy.meshgrid(*[(numpy.arange(100) + 0.5) / 100 * side for side in (0.1, 0.2, 0.3)], indexing="ij"), -1).reshape(-1, 3)
angle = math.radians(40)
X = X * math.cos(angle) + numpy.cross(axis, X) * math.sin(angle) + numpy.outer(X @ axis, axis) * (1 - math.cos(angle))
depth = numpy.maximum(0, 0.11 - X[:, 2])
for element in ("p1", "p2", "cr", "dg"):
    run("askew", ASKEW.format(element) + "-effect_water_level 0.11")
    end = last("askew")
    wet = 0.006 * (depth > 0).mean()
    near(end["water_volume"], wet, 1e-5 * 0.006 + 2e-4 * wet, f"{element}, askew: wet volume, m^3")
    near(end["water_force_z"], 1000 * G * end["water_volume"], 1e-10, f"{element}, askew: buoyancy is the weight of that, N")
    near(math.hypot(end["water_force_x"], end["water_force_y"]), 0, 1e-6, f"{element}, askew: no force sideways, N")
    near(end["water_energy"], 1000 * G * 0.006 * depth.mean(), 1e-4, f"{element}, askew: energy, J")

# a wall: the force on its wet part is rho g h^2 / 2 per width, whatever the mesh; the level rises by its formula; gravity may be another one
for element in ("p1", "p2", "cr", "dg"):
    run("wall", BLOCK.format(1e9, element) + "-effects weight,sea,hold -effect_weight_type gravity -effect_weight_vector 0,0,-3.7 -effect_hold_type fixed -effect_hold_on a "
        "-effect_sea_type water -effect_sea_on xmin -effect_sea_gravity 0,0,-3.7 -effect_sea_density 1025 -effect_sea_level 0.08*t -time static -static_steps 2")
    near(last("wall")["sea_force_x"], 1025 * 3.7 * 0.08**2 / 2 * 0.1, 1e-7, f"{element}: force on a wall, N")
    near(history("wall")["sea_force_x"][1], 1025 * 3.7 * 0.04**2 / 2 * 0.1, 1e-7, f"{element}: force on a wall, level 0.04 m, N")

# a rigid block heaves: T = 2 pi sqrt(m / (rho g A)), with its energy
RIGID = "-bodies a -body_a_mesh box:{} -body_a_rigid yes -body_a_density 500 -effects gravity,water -effect_water_level {} -time newmark "
run("heave", RIGID.format("0.1,0.1,0.1:2", 0.055) + "-ts_dt 0.003 -ts_max_time 0.8")
heave = history("heave")
near(period(heave["time"], heave["centre_z"] - 0.055), 2 * math.pi * math.sqrt(0.05 / G), 3e-4, "heave: period, s")
total = heave["kinetic"] + heave["strain"] + heave["water_energy"] + 0.5 * G * heave["centre_z"]
near(total.max() - total.min(), 0, 1e-6 * heave["kinetic"].max(), "heave: energy kept, J")
near(heave["kinetic"].max() / (1000 * G * 0.01 * 0.005**2 / 2), 1, 5e-3, "heave: kinetic energy in the middle, over that of the spring rho g A")

# a soft one with added mass, whose weight a traction takes back, heaves more slowly: T = 2 pi sqrt((m + m_a) / (rho g A))
run("added", BLOCK.format(1e6, "p1") + "-effects gravity,water,carried,lifts -effect_water_level 0.065 -effect_carried_type mass -effect_carried_on boundary -effect_carried_mass 0.4 "
    f"-effect_lifts_type traction -effect_lifts_on boundary -effect_lifts_total 0,0,{0.4 * G} -time newmark -ts_dt 0.01 -ts_max_time 1.6")
added = history("added")
near(period(added["time"], added["centre_z"] - 0.055), 2 * math.pi * math.sqrt(1 / (1000 * G * 0.01)), 3e-3, "heave with added mass: period, s")

# a flat one rolls: its metacentre is GM = KB + BM - KG above its centre, BM = I / V = b^2 / (12 d); until the deck is wet the righting arm is
# (GM + BM tan^2(a) / 2) sin(a) (wall-sided formula), here without heave, as the level is half-way up
m, b, h = 1.0, 0.2, 0.05
BM = b * b / (12 * h / 2)
GM = h / 4 + BM - h / 2
inertia = m * (b * b + h * h) / 12
for degrees in (1, 10):
    a = math.radians(degrees)
    at = (b / 2 * math.cos(a) + h / 2 * math.sin(a), h / 2 * math.cos(a) - b / 2 * math.sin(a))
    run("roll", RIGID.format(f"{b},{b},{h}:1", h / 2) + f"-body_a_rotate 0,1,0,{degrees} -body_a_translate {-at[0]},{-b / 2},{h / 2 - at[1]} -ts_dt 0.003 -ts_max_time 0.8")
    roll = history("roll")
    energy = m * G * (GM * (1 - math.cos(a)) + BM / 2 * (1 / math.cos(a) + math.cos(a) - 2))
    near(roll["kinetic"].max() / energy, 1, 5e-3, f"roll by {degrees} degrees: work of the righting moment, over that of the formula")
    near(abs(roll["centre_z"] - h / 2).max(), 0, 1e-5, f"roll by {degrees} degrees: no heave, m")
    if degrees == 1:
        near(period(roll["time"], roll["angular_y"]), 2 * math.pi * math.sqrt(inertia / (m * G * GM)), 2e-3, "roll: period, s")
    total = roll["kinetic"] + roll["strain"] + roll["water_energy"] + m * G * roll["centre_z"]
    near(total.max() - total.min(), 0, 1e-3 * energy, f"roll by {degrees} degrees: energy kept, J")

# a block sinks: v = V tanh(g' t / V) with g' = (1 - rho_w / rho) g and V of drag and weight in balance; top and bottom have drag normal to them, four sides along
SINK = "-bodies a -body_a_mesh box:0.1,0.1,0.1:1 -body_a_density 2000 -body_a_material corotated -body_a_poisson 0 -body_a_young 1e8 -body_a_element {} {} -effects gravity,water -effect_water_level 0.2 -time newmark -ts_dt 0.02 -ts_max_time 0.5 "
for element, rigid in (("p1", ""), ("p1", "-body_a_rigid yes"), ("p2", ""), ("cr", ""), ("dg", "")):
    what = rigid or element
    run("sink", SINK.format(element, rigid) + "-effect_water_drag_normal 1.2 -effect_water_drag_tangent 0.2")
    sink = history("sink")
    speed = math.sqrt(1000 * G * 0.001 / (500 * (2 * 1.2 + 4 * 0.2) * 0.01))
    near(-sink["momentum_z"][-1] / 2, speed * math.tanh(G / 2 * 0.5 / speed), 1e-3, f"{what}: speed of a sinking block, m/s")
    total = sink["kinetic"] + sink["strain"] + sink["water_energy"] + 2 * G * sink["centre_z"] - sink["water_drag_work"]
    near(total.max() - total.min(), 0, 2e-3 * -sink["water_drag_work"][-1], f"{what}: energy and drag, J")
    check(sink["water_drag_work"][-1] < -1, f"{what}: drag takes {sink['water_drag_work'][-1]} J")
run("sink", SINK.format("p1", "-body_a_rigid yes") + "-effect_water_drag_linear 50")
rate = 50 * 0.06 / 2
near(-last("sink")["momentum_z"] / 2, G / 2 / rate * (1 - math.exp(-rate * 0.5)), 1e-3, "linear drag: speed, m/s")
# in water that goes along there is none, and a body at rest is taken along
run("along", "-bodies a -body_a_mesh box:0.1,0.1,0.1:1 -body_a_rigid yes -body_a_density 1000 -effects water -effect_water_drag_linear 50 -effect_water_velocity 2*exp(t);0;0 -time newmark "
    "-ts_dt 0.02 -ts_max_time 1")
near(last("along")["momentum_x"], 2 * 3 / 4 * (math.e - math.exp(-3)), 1e-3, "taken along by water that gets faster: speed, m/s")

# a rod in a current: q = 2 C rho / 2 v^2 b, the end of a beam bends by q L^4 / (8 E I), and 1 + 4 E I / (k G A L^2) times that by shear
b, L, E, v = 0.02, 0.4, 1e7, 0.1
q = 1.1 * 1000 * v**2 * b
beam = q * L**4 / (8 * E * b**4 / 12) * (1 + 4 * b * b / 12 * 2 / (5 / 6 * L * L))
for ranks in (1, 3):
    run("rod", f"-bodies a -body_a_mesh box:{b},{b},{L}:2 -body_a_element p2 -body_a_material stvk -body_a_young {E} -body_a_poisson 0 -body_a_density 1000 -effects foot,water -effect_foot_type fixed -effect_foot_on zmin "
        f"-effect_water_drag_normal 1.1 -effect_water_velocity {v};0;0 -time static -probes end -probe_end_at {b / 2},{b / 2},{L}", ranks)
    near(last("rod")["end_ux"] / beam, 1, 2e-3, f"{ranks} ranks: a rod in a current bends, over the beam")
    near(last("rod")["water_force_x"], q * L, 1e-3 * q * L, f"{ranks} ranks: drag on it, N")

# a soft block falls into water: ranks, restart, energies
SPLASH = ("-bodies a -body_a_mesh box:0.1,0.08,0.06:2 -body_a_rotate 1,1,0,25 -body_a_translate 0,0,0.05 -body_a_young 2e4 -body_a_poisson 0.3 -body_a_density 500 -body_a_material stable_neohookean -body_a_element {} "
          "-effects gravity,water -effect_water_level 0 -effect_water_drag_normal 1 -effect_water_drag_tangent 0.01 -time newmark -ts_dt 4e-3 ")
names = ("centre_z", "kinetic", "strain", "water_volume", "water_energy", "water_drag_work")
for element in ("p1", "p2", "cr", "dg"):
    one = SPLASH.format(element) + "-ts_max_time 0.2 "
    run("splash", one + "-checkpoint_every_time 0.1")
    splash = history("splash")
    total = splash["kinetic"] + splash["strain"] + splash["water_energy"] + 0.24 * G * splash["centre_z"] - splash["water_drag_work"]
    near(total.max() - total.min(), 0, 5e-3 * -splash["water_drag_work"][-1], f"{element}, splash: energies, J")
    check(splash["water_drag_work"][-1] < -0.01 and splash["water_volume"].max() > 1e-4, f"{element}: no splash")
    if element in ("p2", "dg"):
        continue
    run("splash-three", one, 3)
    for name in names:
        near(last("splash-three")[name], splash[name][-1], 1e-6 * abs(splash[name]).max(), f"{element}, 1 and 3 ranks: {name}")
    if element != "p1":
        continue
    run("splash-on", SPLASH.format(element) + "-ts_max_time 0.12 -checkpoint_every_time 0.1")
    run("splash-on", one + "-checkpoint_every_time 0.1 -restart latest", 2)
    for name in names:
        near(last("splash-on")[name], splash[name][-1], 1e-6 * abs(splash[name]).max(), f"{element}, restart: {name}")
# explicit, without drag: the same to the order of the step
run("explicit", SPLASH.format("p1").replace("-time newmark -ts_dt 4e-3", "-time euler_symplectic").replace("-effect_water_drag_normal 1 -effect_water_drag_tangent 0.01", "") + "-ts_max_time 0.2")
run("implicit", SPLASH.format("p1").replace("-effect_water_drag_normal 1 -effect_water_drag_tangent 0.01", "") + "-ts_max_time 0.2")
near(last("explicit")["centre_z"], last("implicit")["centre_z"], 1e-3, "explicit and implicit: centre, m")

ONE = BLOCK.format(1e5, "p1") + "-effects gravity,water -ts_max_time 0.01 "
LEVEL = ONE + "-effect_water_level 0 "
ERRORS = ((ONE, "-effect_water_level"), (LEVEL + "-effect_water_gravity 0,0,0 ", "-effect_water_gravity is 0,0,0"), (LEVEL + "-effect_gravity_vector 0,0,-1 ", "give -effect_water_gravity"),
          (LEVEL + "-effects water ", "no weight"), (LEVEL + "-effect_water_density -1 ", "-effect_water_density"), (LEVEL + "-effect_water_velocity 1;0;0 ", "-effect_water_velocity does nothing"),
          (ONE + "-effect_water_drag_linear 1 -effect_water_gravity 0,0,-1 ", "-effect_water_gravity does nothing"), (LEVEL + "-effect_water_on nowhere ", "nowhere"),
          (LEVEL + "-effect_water_level x ", "-effect_water_level"), (LEVEL + "-effect_water_drag_normal 1 -time euler_explicit ", "euler_explicit"), (LEVEL + "-effect_water_time -1 ", "-effect_water_time"))
for options, words in ERRORS:
    text = run("error", options, code=1)
    check(words in text, f"{words}: {text}")
finish()
