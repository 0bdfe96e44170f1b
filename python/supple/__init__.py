"""Results of supple as arrays, and runs of it: single ones, sweeps over options, convergence
studies, options from measurements, shapes without loads.

    import supple
    run = supple.Run("out/demo")
    run.times, run.positions(-1), run.field("von_mises", -1)
    run.history["strain"], run.info["steps"]
    run = supple.start("scenarios/pull.opts", "out/mine", ranks=2, young=2e4)
    print(supple.sweep("scenarios/pull.opts", young=[1e4, 2e4], poisson=[0.3, 0.4]))
    print(supple.fit("scenarios/pull.opts", {"grip_reaction_x": "force.csv"}, {"young": 2e4}))
    print(supple.unload("scenarios/hanging.opts"))

Nothing of the solver is in here: numbers come from the files of a run. SI units throughout, in the
frame of the scenario.
"""

from .identify import Identified, fit
from .obstacles import Obstacle, obstacles
from .run import Mesh, Run, RunError, Surface
from .study import Convergence, Table, convergence, richardson, start, sweep
from .unload import Unloaded, unload

__all__ = [
    "Convergence",
    "Identified",
    "Mesh",
    "Obstacle",
    "Run",
    "RunError",
    "Surface",
    "Table",
    "Unloaded",
    "convergence",
    "fit",
    "obstacles",
    "richardson",
    "start",
    "sweep",
    "unload",
]
