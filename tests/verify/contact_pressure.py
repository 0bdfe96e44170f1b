"""The field contact_pressure on an obstacle: a block without lateral strain is pressed onto a floor, so that the pressure is E times its strain,
positive and the same at every vertex of the bottom, corners and edges included, with every response.
"""
import subprocess
import sys

import h5py

from output_common import MPI, OUT, SUPPLE

PRESS = ("-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_material linear -body_a_young 1e5 -body_a_poisson 0 -body_a_density 1000 "
         "-effects floor,top -effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0 -effect_top_type prescribed_displacement "
         "-effect_top_on zmax -effect_top_displacement 0;0;-0.005*t -time static -output_fields contact_pressure,contact_gap,displacement "
         "-output_precision double -quiet ")

for response in ("barrier", "penalty", "augmented", "projected", "multiplier"):
    folder = OUT / response
    command = [*MPI, "1", SUPPLE, *PRESS.split(), "-effect_floor_response", response, "-output_dir", str(folder)]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode:
        sys.exit(f"{response}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    with h5py.File(folder / "fields.h5") as f:
        places = f["mesh/x"][:]
        last = f["step/0000"][sorted(f["step/0000"])[-1]]
        pressure, moved = last["contact_pressure"][:].ravel(), last["displacement"][:]
    bottom = places[:, 2] < 1e-9
    expected = 1e5 * (0.005 + moved[bottom, 2].mean()) / 0.1
    off = abs(pressure[bottom] / expected - 1).max()
    if not off < 0.06 or abs(pressure[~bottom]).max() > 0:
        sys.exit(f"{response}: pressures {pressure[bottom].min()} to {pressure[bottom].max()} Pa, not {expected}")
    print(f"{response}: {expected:.1f} Pa, within {off:.2g}")
