"""scripts/export: what the files hold, read back: points, triangles, colours and fields of each body and frame, and where obstacles are.

"""
import json
import subprocess
import sys
from pathlib import Path

import numpy
import trimesh
from alembic3d import Abc, AbcGeom
from pxr import Usd, UsdGeom
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLogger
from vtkmodules.vtkIOGeometry import vtkGLTFReader

from output_common import OUT, run

sys.path.insert(0, str(Path("python").resolve()))
import supple

BALL = ["-effects", "gravity,hold,ball", "-effect_ball_type", "contact", "-effect_ball_obstacle", "sphere:0.2,0.05,-0.3,0.06",
        "-effect_ball_displacement", "0;0;-2*t"]


def check(condition, text):
    if not condition:
        sys.exit(text)


def export(*args, fails=False):
    done = subprocess.run([sys.executable, "scripts/export", *map(str, args)], capture_output=True, text=True)
    check((done.returncode != 0) == fails, f"export {args}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    check(not fails or "Traceback" not in done.stderr, done.stderr)
    return done.stdout + done.stderr


def check_files(it, folder):
    """One file per frame: both surfaces with their places, in the axes of the format."""
    surface = it.mesh().surface
    x = it.positions(-1)[surface.points]
    for form, ending in (("obj", ".obj"), ("ply", ".ply")):
        export(folder, "--to", form, "-o", OUT / form)
        files = sorted(OUT.glob(f"{form}_*{ending}"))
        check(len(files) == len(it), f"{form}: {len(files)} files for {len(it)} frames")
        found = trimesh.load(files[-1], process=False)
        whole = found.to_mesh() if isinstance(found, trimesh.Scene) else found
        near = numpy.array([numpy.abs(whole.vertices - p).max(axis=1).min() for p in x])
        check(near.max() < 1e-6, f"{form}: a point of the bar is {near.max()} m off")
        check(len(whole.faces) > len(surface.triangles) and abs(whole.area - 0.045 - area_of(x, surface)) < 2e-3, f"{form}: area {whole.area}")
    ply = trimesh.load(sorted(OUT.glob("ply_*.ply"))[-1], process=False)
    values = surface.at_points(it.values("von_mises")[0])
    told = ply.metadata["_ply_raw"]["vertex"]["data"]["von_mises"]
    check(numpy.allclose(told[: len(values)].ravel(), values, rtol=1e-6), "the field in the .ply")
    colours = ply.visual.vertex_colors[: len(values)].astype(int)
    # viridis: the largest stress is yellow, the least violet
    check(colours[values.argmax()][0] > 200 > 120 > colours[values.argmin()][0], f"colours {colours[values.argmax()]}, {colours[values.argmin()]}")


def area_of(x, surface):
    corners = x[surface.triangles]
    return numpy.linalg.norm(numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2


def check_usd(it, folder):
    """One file with all frames, at the run's own pace."""
    export(folder, "--to", "usd", "-o", OUT / "all", "--field", "displacement")
    stage = Usd.Stage.Open(str(OUT / "all.usdc"))
    check(UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1, "axes of the .usdc")
    check(abs(stage.GetEndTimeCode() / stage.GetTimeCodesPerSecond() - it.times[-1]) < 1e-9, f"the film lasts {stage.GetEndTimeCode()} frames")
    bar, ball = (UsdGeom.Mesh.Get(stage, f"/run/{name}") for name in ("bar", "ball"))
    points = it.mesh().surface.points
    for k in (0, len(it) - 1):
        x = numpy.array(bar.GetPointsAttr().Get(k))
        check(numpy.abs(x - it.positions(k)[points]).max() < 1e-6, f"points of frame {k}")
        u = numpy.array(UsdGeom.PrimvarsAPI(bar).GetPrimvar("displacement").Get(k))
        check(numpy.allclose(u, it.values("displacement", k)[0][points], atol=1e-7), f"field of frame {k}")
        centre = ball.ComputeLocalToWorldTransform(k).Transform(numpy.array(ball.GetPointsAttr().Get()).mean(axis=0).tolist())
        check(numpy.allclose(centre, [0.2, 0.05, -0.3 - 2 * it.times[k]], atol=1e-6), f"the ball is at {centre} in frame {k}")
    check(len(bar.GetFaceVertexCountsAttr().Get()) == len(it.mesh().surface.triangles), "triangles")


def check_alembic(it, folder):
    """The same in Alembic's axes, y up: points, field, colours, the ball, at the run's own pace."""
    export(folder, "--to", "alembic", "-o", OUT / "all", "--field", "displacement")
    top = Abc.IArchive(str(OUT / "all.abc")).getTop()
    bar, ball = (AbcGeom.IPolyMesh(top, name).getSchema() for name in ("bar", "ball"))
    surface = it.mesh().surface
    check(bar.getNumSamples() == len(it), f"{bar.getNumSamples()} samples for {len(it)} frames")
    for k in (0, len(it) - 1):
        at = Abc.ISampleSelector(k)
        check(abs(bar.getTimeSampling().getSampleTime(k) - it.times[k]) < 1e-9, "times of the samples")
        x, expected = numpy.array([[p.x, p.y, p.z] for p in bar.getValue(at).getPositions()]), it.positions(k)[surface.points]
        check(numpy.abs(x - expected[:, [0, 2, 1]] * [1, 1, -1]).max() < 1e-6, f"points of frame {k}")
        middle = numpy.array([[p.x, p.y, p.z] for p in ball.getValue(at).getPositions()]).mean(axis=0)
        check(numpy.allclose(middle, [0.2, -0.3 - 2 * it.times[k], -0.05], atol=1e-3), f"the ball is at {middle} in frame {k}")
        u = numpy.array(list(AbcGeom.IFloatGeomParam(bar.getArbGeomParams(), "displacement").getExpandedValue(at).getVals()))
        check(numpy.allclose(u, it.values("displacement", k)[0][surface.points], atol=1e-7), f"field of frame {k}")
    faces = numpy.array(list(bar.getValue(Abc.ISampleSelector(0)).getFaceIndices())).reshape(-1, 3)
    check((faces == surface.triangles[:, ::-1]).all(), "triangles")


def check_gltf(it, folder):
    """One file with all frames, y up: VTK plays it, the bar and the ball are where they were at each time; trimesh and who plays nothing see the last frame; colours of all frames."""
    export(folder, "--to", "gltf", "-o", OUT / "all")
    surface, path = it.mesh().surface, str(OUT / "all.glb")
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)  # VTK warns that it does not play colours
    reader = vtkGLTFReader()
    reader.SetFileName(path)
    reader.UpdateInformation()
    check(reader.GetNumberOfAnimations() == 1 and abs(reader.GetAnimationDuration(0) - it.times[-1]) < 1e-6, f"the film lasts {reader.GetAnimationDuration(0)} s")
    reader.EnableAnimation(0)
    reader.SetFrameRate(1000)  # VTK's own time steps, among which are those of the run
    for k in (0, len(it) // 2, len(it) - 1):
        reader.UpdateInformation()
        reader.UpdateTimeStep(float(it.times[k]))
        shapes, items = [], reader.GetOutput().NewIterator()
        items.InitTraversal()
        while not items.IsDoneWithTraversal():
            shapes.append(vtk_to_numpy(items.GetCurrentDataObject().GetPoints().GetData()).astype(float))
            items.GoToNextItem()
        x = it.positions(k)[surface.points]
        check(numpy.abs(shapes[0] - x[:, [0, 2, 1]] * [1, 1, -1]).max() < 1e-6, f"points of frame {k}")
        check(numpy.allclose(shapes[1].mean(axis=0), [0.2, -0.3 - 2 * it.times[k], -0.05], atol=1e-3), f"the ball is at {shapes[1].mean(axis=0)} in frame {k}")
    still = trimesh.load(path, process=False)
    x = trimesh.transform_points(still.geometry["bar"].vertices, still.graph["bar"][0])
    check(numpy.abs(x - it.positions(-1)[surface.points][:, [0, 2, 1]] * [1, 1, -1]).max() < 1e-6, "trimesh does not see the last frame")
    # viridis in every frame: the largest stress is yellow, that is red and green, the least violet, that is blue
    with open(path, "rb") as f:
        f.seek(12)
        size = int.from_bytes(f.read(4), "little")
        file, blob = json.loads(f.read(4 + size)[4:]), f.read()[8:]

    def array(number):
        a = file["accessors"][number]
        return numpy.frombuffer(blob, numpy.float32, 3 * a["count"], file["bufferViews"][a["bufferView"]]["byteOffset"]).reshape(-1, 3)

    part = file["meshes"][0]["primitives"][0]
    check(len(part["targets"]) == len(it) - 1, f"{len(part['targets'])} targets for {len(it)} frames")
    for k, target in [(1, part["targets"][1]["COLOR_0"]), (len(it) - 1, None)]:
        colours = array(part["attributes"]["COLOR_0"]) + (array(target) if target else 0)
        values = surface.at_points(it.values("von_mises", k)[0])
        check(colours.min() > -1e-6 and colours.max() < 1 + 1e-6 and colours[values.argmin()][2] > colours[values.argmin()][1], f"colours of frame {k}")
        check(k == 1 or colours[values.argmax()][0] > 0.5, f"colours {colours[values.argmax()]}")
    export(folder, "--to", "gltf", "--frame", 0, "-o", OUT / "still")
    check(numpy.abs(trimesh.load(OUT / "still.glb", process=False).geometry["bar"].vertices - it.positions(0)[surface.points]).max() < 1e-6, "a still of frame 0")


def check_remeshed():
    """A file per frame has the mesh of its frame; one with all frames has those since the last re-meshing, and the last line says how many are left out."""
    run(1, "again", "-ts_max_time", "0.03", "-quiet", "-body_bar_mesh", "box:0.4,0.1,0.1:2", "-remesh_times", "0.015", "-remesh_size", "0.5")
    it = supple.Run(OUT / "again")
    old = sum(it.mesh(k) is not it.mesh(-1) for k in range(len(it)))
    check(0 < old < len(it), f"{old} of {len(it)} frames before the re-meshing")
    check("without" not in export(OUT / "again", "--to", "ply", "-o", OUT / "again/bar"), "ply: frames left out")
    files = sorted((OUT / "again").glob("bar_*.ply"))
    check(len(files) == len(it), f"ply: {len(files)} files for {len(it)} frames")
    for k, path in enumerate(files):
        x = trimesh.load(path, process=False).vertices
        y = it.positions(k)[it.mesh(k).surface.points]
        check(x.shape == y.shape and numpy.abs(x - y).max() < 1e-6, f"ply: frame {k} is not the run's")
    for form in ("usd", "gltf", "alembic"):
        check(f"without the {old} " in export(OUT / "again", "--to", form, "-o", OUT / "again/bar"), f"{form}: nothing says that frames are left out")


def main():
    run(1, "run", "-ts_max_time", "0.04", "-quiet", "-time", "euler_implicit", *BALL)
    it = supple.Run(OUT / "run")
    check_files(it, OUT / "run")
    check_usd(it, OUT / "run")
    check_gltf(it, OUT / "run")
    check("there is no frame 99" in export(OUT / "run", "--to", "ply", "--frame", 99, fails=True), "unknown frame")
    check_alembic(it, OUT / "run")
    check_remeshed()


if __name__ == "__main__":
    main()
