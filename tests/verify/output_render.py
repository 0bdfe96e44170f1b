"""scripts/render draws a run without a display: a picture with the body in the colours of the scale, an animation.

"""
import os
import re
import subprocess
import sys
from pathlib import Path

import imageio_ffmpeg
import matplotlib
import numpy
from PIL import Image

from output_common import ELEMENTS, OUT, run

sys.path.insert(0, str(Path("python").resolve()))
import supple
from supple.run import colour_range

RENDER = [sys.executable, str(Path(__file__).resolve().parents[2] / "scripts" / "render")]
WITHOUT_DISPLAY = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}


def render(*args, fails=False):
    result = subprocess.run(RENDER + [str(a) for a in args], capture_output=True, text=True, env=WITHOUT_DISPLAY)
    if (result.returncode != 0) != fails:
        sys.exit(f"render {args}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    if fails and (len(result.stderr.strip().splitlines()) != 1 or "Traceback" in result.stderr):
        sys.exit(f"render {args}: not one line\n{result.stderr}")
    return result.stdout + result.stderr


def check(condition, text):
    if not condition:
        sys.exit(text)


def body_pixels(path, scale_width):
    """Saturated pixels left of the scale: the background is nearly grey."""
    pixels = numpy.asarray(Image.open(path).convert("RGB")).astype(int)
    left = pixels[:, : pixels.shape[1] - scale_width]
    return left, left.max(axis=2) - left.min(axis=2) > 40


def check_obstacles():
    """A ball beside the bar and a tet read from a file are drawn where they have moved to, and only when asked for."""
    mesh = OUT / "tet.msh"
    mesh.write_text("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n100 0 0\n0 100 0\n0 0 100\n"
                    "$EndNodes\n$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n")
    run(1, "obstacles", "-ts_max_time", "0.02", "-quiet", "-time", "euler_implicit", "-effects", "gravity,hold,ball,tet",
        "-effect_ball_type", "contact", "-effect_ball_obstacle", "sphere:0.2,0.05,0.3,0.06", "-effect_ball_displacement", "0;0;ramp(t)^2",
        "-effect_tet_type", "contact", "-effect_tet_obstacle", f"mesh:{mesh}", "-effect_tet_obstacle_scale", "0.001",
        "-effect_tet_obstacle_at", "0.1,0,-0.3")
    folder = OUT / "obstacles"
    render(folder, "-o", folder / "without.png")
    render(folder, "--obstacles", "-o", folder / "with.png")
    dark = []
    for name in ("without.png", "with.png"):
        left, body = body_pixels(folder / name, 230)
        dark.append((~body & (left.max(axis=2) < 190))[100:].mean())
    check(dark[0] < 0.005 < 0.01 < dark[1], f"grey and dark beside the bar: {dark[0]:.2%} without obstacles, {dark[1]:.2%} with them")


def check_open_obstacles():
    """Of a plane a piece below the bar is drawn, of a bowl around it the part behind it: neither hides the bar, both are wholly in the picture."""
    for name, obstacle in (("plane", "plane:0,0,1,-0.1"), ("bowl", "bowl:0.2,0.05,0.35,0.42")):
        run(1, name, "-ts_max_time", "0.01", "-quiet", "-time", "euler_implicit", "-effects", "gravity,hold,it", "-effect_it_type", "contact",
            "-effect_it_obstacle", obstacle)
        render(OUT / name, "--obstacles", "-o", OUT / f"{name}.png")
        left, body = body_pixels(OUT / f"{name}.png", 230)
        grey = ~body & (left.max(axis=2) < 190)
        grey[:100] = False
        # were the near side of the bowl drawn, 5.7 % would be left of the bar, not 7.7 %
        check(grey.mean() > 0.05 and body.mean() > 0.067, f"{name}: {grey.mean():.2%} of the picture is grey, {body.mean():.1%} of it the bar")
        rows, columns = numpy.nonzero(grey)
        check(columns.min() > 20 and columns.max() < left.shape[1] - 20 and rows.max() < left.shape[0] - 20,
              f"{name} reaches from {columns.min()} to {columns.max()}, down to {rows.max()}")


def check_copies():
    """The floor reaches below all copies of a body, and a field that is zero nearly everywhere has a scale of its own."""
    run(1, "copies", "-ts_max_time", "0.01", "-quiet", "-time", "euler_implicit", "-body_bar_copies", "grid:1,4,1,0.1,0.2,0.1", "-effects", "gravity,floor",
        "-effect_floor_type", "contact", "-effect_floor_obstacle", "plane:0,0,1,-0.1", "-effect_floor_on", "zmin", "-output_fields", "displacement,contact_force")
    it = supple.Run(OUT / "copies")
    floor = supple.obstacles(it)[0].x
    check(len(it.bodies) == 4 and floor[:, 1].min() < 0 and floor[:, 1].max() > 0.7, f"the floor lies from {floor.min(axis=0)} to {floor.max(axis=0)}")
    few = numpy.zeros(10000)
    few[:20] = 0.02
    check(colour_range([few]) == (0, 0.02) and colour_range([few - 1]) == (-1, -0.98) and colour_range([0 * few]) == (0, 1), f"scale {colour_range([few])} of a few forces")


def dark(path, box):
    """Share of the picture's part (left, top, right, bottom), as fractions of its size, that texts and lines cover."""
    picture = Image.open(path).convert("L")
    part = picture.crop([int(f * size) for f, size in zip(box, picture.size * 2)])
    return (numpy.asarray(part) < 120).mean()


def check_marks(folder):
    """Axes at the upper right, a length at the lower right; several views have names and one scale."""
    render(folder, "--frame", "0", "--field", "displacement", "--range", "0", "1", "-o", OUT / "marks.png")
    axes, length = dark(OUT / "marks.png", (0.82, 0, 1, 0.14)), dark(OUT / "marks.png", (0.82, 0.92, 1, 1))
    check(axes > 0.004 and length > 0.01, f"axes {axes:.2%}, length {length:.2%}")
    render(folder, "--frame", "0", "--views", "front,right,top", "--field", "displacement", "--range", "0", "1", "-o", OUT / "views.png")
    sizes = [box_of(OUT / "views.png", 3, panel) for panel in range(3)]
    # 0.1 m of the bar's end and of its side have the same length, but for what is nearer to the eye
    check(abs(sizes[1][1] / sizes[0][1] - 1) < 0.2 and abs(sizes[2][1] / sizes[0][1] - 1) < 0.2, f"the views have different scales: {sizes}")
    for panel in range(3):
        name = dark(OUT / "views.png", (0.27 * panel + 0.02, 0.08, 0.27 * panel + 0.12, 0.14))
        check(name > 0.02, f"view {panel} has no name: {name:.2%}")


def box_of(path, panels, panel):
    """Width and height in pixels of what is drawn in one of several views."""
    left, body = body_pixels(path, 230)
    width = left.shape[1] // panels
    rows, columns = numpy.nonzero(body[:, panel * width:(panel + 1) * width])
    return columns.max() - columns.min() + 1, rows.max() - rows.min() + 1


def check_views(folder):
    """Three views of the bar at rest, 0.4 x 0.1 x 0.1 m; the same lying along y with gravity along -y, as scans with y up have it, looks the same."""
    render(folder, "--frame", "0", "--views", "front,right,top", "--field", "displacement", "--range", "0", "1", "-o", OUT / "views.png")
    for panel, ratio in enumerate((4, 1, 4)):
        width, height = box_of(OUT / "views.png", 3, panel)
        check(abs(width / height / ratio - 1) < 0.3, f"view {panel}: {width} x {height} pixels, expected {ratio} to 1")
    # tight: the longest side fills its panel but for a margin
    check(box_of(OUT / "views.png", 3, 0)[0] > 0.85 * 970 / 3, f"the bar is {box_of(OUT / 'views.png', 3, 0)[0]} pixels wide")
    turned = ["-body_bar_rotate", "1,0,0,-90", "-effect_gravity_vector", "0,-9.81,0"]
    run(1, "yup", "-ts_max_time", "0.1", "-quiet", "-output_fields", "displacement,von_mises", *turned)
    run(1, "zup", "-ts_max_time", "0.1", "-quiet", "-output_fields", "displacement,von_mises")
    boxes = []
    for name in ("zup", "yup"):
        render(OUT / name, "--views", "front", "-o", OUT / f"{name}.png")
        boxes.append(box_of(OUT / f"{name}.png", 1, 0))
    check(numpy.abs(numpy.subtract(*boxes)).max() <= 6, f"z up and y up: {boxes}")
    check(boxes[0][1] > 0.2 * boxes[0][0], f"the bar does not sag in the picture: {boxes}")
    # from a place of one's own
    render(OUT / "zup", "--frame", "0", "--camera", "1,0,0", "--up", "0,1,0", "--field", "displacement", "--range", "0", "1", "-o", OUT / "own.png")
    width, height = box_of(OUT / "own.png", 1, 0)
    check(abs(width / height - 1) < 0.1, f"along the bar: {width} x {height} pixels")


def check_scale(folder):
    """The scale leaves out what few points have, and says so; both signs get a scale that is symmetric."""
    told = render(folder, "-o", OUT / "scale.png")
    check("scale 0 to " in told, told)
    check("% of the surface beyond it (max " in render(folder, "--range", "0", "100", "-o", OUT / "scale.png"), "what is beyond the scale")
    ends = re.search(r"scale (\S+) to (\S+)", render(folder, "--field", "stress_xx", "-o", OUT / "scale.png")).groups()
    check(float(ends[0]) == -float(ends[1]) < 0, f"scale of both signs: {ends}")


def main():
    check_obstacles()
    check_open_obstacles()
    check_copies()
    run(1, "run", "-ts_max_time", "0.1", "-quiet", "-output_fields", "displacement,von_mises,stress")
    folder = OUT / "run"

    render(folder, "--rest")
    picture = folder / "picture.png"
    check(Image.open(picture).size == (1200, 800), f"size {Image.open(picture).size}")
    left, body = body_pixels(picture, 230)
    rows, columns = numpy.nonzero(body)
    # the bar is drawn large, whole, and not beyond the picture or into the scale
    check(0.15 < body.mean() < 0.8, f"the body covers {body.mean():.0%} of the picture")
    check(columns.min() > 20 and columns.max() < left.shape[1] - 20 and rows.min() > 20 and rows.max() < left.shape[0] - 20,
          f"the body reaches from {columns.min()} to {columns.max()}, {rows.min()} to {rows.max()}")
    # the held end is at the left and more stressed: warmer than the free one
    warm = left[:, :, 0] - left[:, :, 2]
    third = (columns.max() - columns.min()) // 3
    held, free = (warm[rows[side], columns[side]].mean() for side in (columns < columns.min() + third, columns > columns.max() - third))
    check(held > free + 30, f"held end {held:.0f}, free end {free:.0f}")

    other = OUT / "other.png"
    render(folder, "--field", "stress_xx", "--frame", "0", "--range", "-1", "1", "--colours", "viridis", "--size", "600x400", "-o", other)
    left, body = body_pixels(other, 150)
    middle = numpy.array(matplotlib.colormaps["viridis"](0.5)[:3])
    drawn = left[body].mean(axis=0) / left[body].mean()
    # no stress at rest: one colour, but for light and shade
    check(numpy.abs(drawn - middle / middle.mean()).max() < 0.15, f"colour {drawn}, of the scale {middle / middle.mean()}")

    render(folder, "--animate", OUT / "bar.gif", "--size", "300x200", "--fps", "50")
    check(Image.open(OUT / "bar.gif").n_frames == 6, f"{Image.open(OUT / 'bar.gif').n_frames} pictures for 0.1 s at 50 a second")
    render(folder, "--animate", OUT / "bar.mp4", "--size", "300x200", "--fps", "50")
    film = list(imageio_ffmpeg.read_frames(str(OUT / "bar.mp4")))
    check(film[0]["size"] == (300, 200) and len(film) == 7, f"{len(film) - 1} pictures in the .mp4")
    check_views(folder)
    check_marks(folder)
    check_scale(folder)
    render(folder, "--animate", OUT / "bar.png", "--size", "300x200", "--fps", "50", "--field", "displacement_z")
    check(len(list(OUT.glob("bar_0*.png"))) == 6, "the sequence of pictures")

    # points of their own change shades and, where cells part, a few pixels
    run(1, "cr", "-ts_max_time", "0.05", "-quiet", "-output_fields", "displacement,pressure", *ELEMENTS["cr"])
    run(1, "corners", "-ts_max_time", "0.05", "-quiet", "-output_fields", "displacement,pressure", "-output_discontinuous", *ELEMENTS["cr"])
    pictures = []
    for name in ("cr", "corners"):
        render(OUT / name, "--field", "pressure", "--range", "-200", "200", "--size", "600x400", "-o", OUT / f"{name}.png")
        left, body = body_pixels(OUT / f"{name}.png", 150)
        check(0.1 < body.mean() < 0.8, f"{name}: the body covers {body.mean():.0%} of the picture")
        pictures.append(left)
    apart = (numpy.abs(pictures[0] - pictures[1]).max(axis=2) > 40).mean()
    print(f"points of their own change {apart:.2%} of the picture")
    check(apart < 0.05, f"points of their own change {apart:.1%} of the picture")

    check("has no field 'von_mizes'; it has displacement" in render(folder, "--field", "von_mizes", fails=True), "unknown field")
    check("is a tensor" in render(folder, "--field", "stress", fails=True), "tensor")
    check("there is no frame 99" in render(folder, "--frame", "99", fails=True), "unknown frame")
    check("does not exist" in render(OUT, fails=True), "no results")
    print("pictures and animations are drawn")


if __name__ == "__main__":
    main()
