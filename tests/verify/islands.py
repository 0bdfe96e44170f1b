"""Bodies that share no energy do not hold each other up: Newton's method takes a rain of blocks in as many iterations as its blocks alone.

Twenty turned blocks fall onto a floor from different heights, far apart, so that one or the other hits it in nearly every step. A step of all of
them needs hardly more iterations than the block that needs the most: 1.05 times as many in total, with one length of Newton's steps for all bodies
1.29 times. Energy and the floor's force are the sums of the blocks alone, on 1 and 3 ranks the same.
"""
import numpy

from scene_common import check, finish, history, near, start

COMMON = "-quiet -output_fields none -output_precision double -ts_dt 0.01 -ts_max_time 0.3 -time euler_implicit "
CUBE = ("-body_{0}_mesh box:0.05,0.05,0.05:2 -body_{0}_material stable_neohookean -body_{0}_young 1e5 -body_{0}_poisson 0.4 -body_{0}_density 1000 "
        "-body_{0}_rotate 1,2,3,40 -body_{0}_translate {1},0,{2} ")
FLOOR = "-effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0 -effect_floor_friction 0.3 "
MEET = " -effect_meet_type contact -effect_meet_friction 0.3 "
HEIGHTS = [0.07 + 0.012 * (7 * i % 20) for i in range(20)]


def fall(folder, which, ranks=1):
    names = [f"b{i}" for i in which]
    effects = "-effects gravity,floor" + (",meet" + MEET if len(names) > 1 else " ")
    start(folder, COMMON + f"-bodies {','.join(names)} " + "".join(CUBE.format(f"b{i}", 0.2 * i, HEIGHTS[i]) for i in which) + effects + FLOOR, ranks)
    return history(folder)


alone = [fall(f"alone{i}", [i]) for i in range(20)]
most = numpy.max([h["newton"] for h in alone], axis=0).sum()
for ranks in (1, 3):
    rain = fall("rain", range(20), ranks)
    near(rain["newton"].sum() / most, 1, 0.12, f"{ranks} ranks: iterations, over those of the blocks that need the most")
    near(rain["rejected"].sum(), 0, 0, f"{ranks} ranks: rejected steps")
    for name in ("kinetic", "strain", "floor_force_z"):
        parts = numpy.sum([h[name] for h in alone], axis=0)
        near(numpy.abs(rain[name] - parts).max() / parts.max(), 0, 1e-2, f"{ranks} ranks: {name}, difference from the sum of the blocks alone")
    check(rain["floor_gap"].min() >= 0, f"{ranks} ranks: the floor is crossed")
finish()
