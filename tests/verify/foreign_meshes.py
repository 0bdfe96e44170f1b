"""MED, Exodus and CGNS: files written here are read with names, sets and curved edges, or refused by name; damaged ones end with one line.

tests/data has files of gmsh and netCDF, which tests/unit/test_mesh_formats.c compares with the same mesh in other formats.

@cpu 300
"""
import os
import random
import re
import subprocess
import sys
from pathlib import Path

try:
    import h5py
    import numpy as np
except ImportError:
    print("needs h5py: scripts/venv makes .venv")
    sys.exit(77)

OUT = Path(os.environ["SB_OUT"])
TOOL = Path(os.environ["SB_SUPPLE"]).with_name("supple-mesh")
COUNT = int(os.environ.get("SB_MUTATIONS", "60"))
passed = failed = 0
os.environ["ASAN_OPTIONS"] = "detect_leaks=0:allocator_may_return_null=1"

# Two tets with a common face, volumes 1/6 and 1/3; the middles of the edges of the first one, that of 3-4 off the middle.
X = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1.]])
MIDDLES = np.array([[.5, 0, 0], [.5, .5, 0], [0, .5, 0], [0, 0, .5], [.5, 0, .5], [0, .6, .5]])  # 12 23 31 14 24 34
TETS = np.array([[1, 2, 3, 4], [2, 3, 4, 5]])


def check(what: str, good: bool, text: str = "") -> None:
    global passed, failed
    passed, failed = passed + good, failed + (not good)
    if not good:
        print(f"FAIL {what}: {text}")


def info(path: Path) -> tuple[int, str, list[str]]:
    """Exit code, output, and lines of errors."""
    done = subprocess.run([TOOL, "info", path], capture_output=True, text=True, errors="replace", check=False, timeout=100)
    return done.returncode, done.stdout + done.stderr, [line for line in done.stderr.splitlines() if line.startswith("supple-mesh: error:")]


def reads(name: str, path: Path, *patterns: str) -> None:
    code, text, _ = info(path)
    check(name, code == 0 and all(re.search(p, text) for p in patterns), f"exit code {code}, expected {patterns}: {text[:1500]}")


def refuses(name: str, path: Path, *patterns: str) -> None:
    code, text, lines = info(path)
    check(name, code == 1 and len(lines) == 1 and all(re.search(p, lines[0]) for p in patterns), f"exit code {code}, expected {patterns}: {text[:600]}")


# ---------------------------------------------------------------- MED

def med(name: str, change=None, version: int = 4, tets=None, x=None, kind: str = "TE4") -> Path:
    path = OUT / f"{name}.med"
    with h5py.File(path, "w") as f:
        x, tets = X if x is None else x, TETS if tets is None else tets
        mesh = f.create_group("ENS_MAA/block")
        mesh.attrs.update({"ESP": 3, "DIM": 3, "TYP": 0, "REP": 0})
        base = mesh if version < 3 else mesh.create_group("-0000000000000000001-0000000000000000001")
        base["NOE/COO"] = x.T.ravel()
        base["NOE/FAM"] = np.array([1] + [0] * (len(x) - 1))
        base[f"MAI/{kind}/NOD"] = tets.T.ravel()
        base[f"MAI/{kind}/FAM"] = np.array([-1, -2][:len(tets)])
        for group, number, names in (("NOEUD/N", 1, ["foot"]), ("ELEME/A", -1, ["left", "all"]), ("ELEME/B", -2, ["all"])):
            family = f.create_group(f"FAS/block/{group if version >= 3 else group[-1]}")
            family.attrs["NUM"] = number
            texts = np.array([[*n.encode()] + [0] * (80 - len(n)) for n in names], dtype=np.int8)
            family["GRO/NOM"] = texts
        f.create_group("FAS/block/FAMILLE_ZERO").attrs["NUM"] = 0
        if change:
            change(f, base)
    return path


def set_of(key: str, value):
    def change(f, base):
        del base[key]
        base[key] = value
    return change


SETS = (r"left +1 tets, 0.166667 m\^3", r"all +2 tets, 0.5 m\^3", r"foot +1 points", r"volume +0.5 m\^3")
reads("MED 4", med("four"), *SETS)
reads("MED 2", med("two", version=2), *SETS)
TEN = np.array([[1, 2, 3, 4, 5, 6, 7, 8, 9, 10]])
SIX = np.vstack([X[:4], MIDDLES])
reads("MED T10", med("ten", tets=TEN, x=SIX, kind="T10"), "off the middle: 1, by 0.071", "left +1 tets")
refuses("MED with two meshes", med("meshes", lambda f, base: f.create_group("ENS_MAA/other")), "2 meshes")
refuses("MED with two steps", med("steps", lambda f, base: base.parent.create_group("later")), "2 steps")
refuses("MED with hexahedra", med("hex", lambda f, base: base.__setitem__("MAI/HE8/NOD", np.arange(1, 9) % 5 + 1)), "1 hexahedra")
refuses("MED with polyhedra", med("poly", lambda f, base: base.__setitem__("MAI/POE/NOD", np.arange(9))), "POE")
refuses("MED structured", med("grid", lambda f, base: base.parent.attrs.__setitem__("TYP", 1)), "structured")
refuses("MED cylindrical", med("round", lambda f, base: base.parent.attrs.__setitem__("REP", 1)), "Cartesian")
refuses("MED, a node that is not there", med("node", set_of("MAI/TE4/NOD", np.array([1, 2, 2, 3, 3, 4, 4, 55]))), "element 2", "node 55")
refuses("MED, a family that is not there", med("family", set_of("MAI/TE4/FAM", np.array([-1, -7]))), "family -7")
refuses("MED, too few families", med("few", set_of("MAI/TE4/FAM", np.array([-1]))), "FAM", "expected 2")
refuses("MED, no number", med("nan", set_of("NOE/COO", np.full(15, np.nan))), "COO", "finite")
refuses("MED, a link", med("link", lambda f, base: f.__setitem__("away", h5py.ExternalLink("/etc/passwd", "/"))), "away", "link")
refuses("MED, no mesh", med("none", lambda f, base: f.__delitem__("ENS_MAA")), "ENS_MAA")

# ---------------------------------------------------------------- Exodus in HDF5


def exodus(name: str, change=None, tets=None, x=None, kind: str = "TETRA4") -> Path:
    path = OUT / f"{name}.exo"
    with h5py.File(path, "w") as f:
        x, tets = X if x is None else x, TETS if tets is None else tets
        for k in range(3):
            f["coord" + "xyz"[k]] = x[:, k]
        f["connect1"] = tets
        f["connect1"].attrs["elem_type"] = np.bytes_(kind)
        f["eb_prop1"] = [7]
        f["ss_prop1"] = [1]
        f["ss_names"] = np.array([[*b"base".ljust(33, b"\0")]], dtype=np.uint8).view("S1").reshape(1, 33)
        f["elem_ss1"], f["side_ss1"] = [1], [4]
        f["node_ns1"] = [1, 2]
        if change:
            change(f, f)
    return path


reads("Exodus", exodus("good"), r"volume_7 +2 tets", r"base +1 triangles, 0.5 m\^2", r"point_1 +2 points", r"volume +0.5 m\^3")
reads("Exodus TETRA10", exodus("ten", tets=TEN, x=SIX, kind="TETRA10"), "off the middle: 1, by 0.071", "base +1 triangles")
refuses("Exodus with hexahedra", exodus("hex", tets=np.array([[1, 2, 3, 4, 5, 1, 2, 3]]), kind="HEX8"), "1 hexahedra")
refuses("Exodus with polyhedra", exodus("poly", kind="nfaced"), "connect1", "nfaced")
refuses("Exodus in a plane", exodus("flat", lambda f, _: f.__delitem__("coordz")), "coordz")
refuses("Exodus, a side that is not there", exodus("side", set_of("side_ss1", [5])), "side_ss1", "side 5 of element 1")
refuses("Exodus, an element that is not there", exodus("element", set_of("elem_ss1", [9])), "elem_ss1", "element 9")
refuses("Exodus, a node that is not there", exodus("ns", set_of("node_ns1", [0])), "node_ns1", "node 0")


def second(of: str, status: int | None):
    """Change of a file that announces a second block or set, of which there is no array."""
    def change(f, _):
        f.pop(f"{of}_prop1", None)
        f[f"{of}_prop1"] = [7, 8]
        f.pop(f"{of}_names", None)
        if status is not None:
            f[f"{of}_status"] = [1, status]
    return change


for letters, array in (("eb", "connect2"), ("ss", "elem_ss2"), ("ns", "node_ns2")):
    refuses(f"Exodus, no {array}", exodus(f"no_{array}", second(letters, 1)), array, "status")
    reads(f"Exodus, empty {array}", exodus(f"empty_{array}", second(letters, 0)), r"volume +0.5 m\^3")
    reads(f"Exodus, {array} without status", exodus(f"unknown_{array}", second(letters, None)), f"no array {array}")
refuses("Exodus, no sides", exodus("sides", lambda f, _: f.__delitem__("side_ss1")), "side_ss1")
refuses("Exodus, no coordinates", exodus("none", lambda f, _: [f.__delitem__("coord" + c) for c in "xyz"]), "no nodes")

# ---------------------------------------------------------------- CGNS


def node(parent, name: str, label: str, data=None):
    group = parent.create_group(name)
    group.attrs["label"], group.attrs["name"] = np.bytes_(label), np.bytes_(name)
    if isinstance(data, str):
        data = np.frombuffer(data.encode(), dtype=np.int8)
    if data is not None:
        group[" data"] = np.array(data)
    return group


def cgns(name: str, change=None, kind: int = 10, tets=None, x=None, zone_type: str = "Unstructured") -> Path:
    path = OUT / f"{name}.cgns"
    with h5py.File(path, "w") as f:
        x, tets = X if x is None else x, TETS if tets is None else tets
        base = node(f, "Base", "CGNSBase_t", [3, 3])
        zone = node(base, "Zone", "Zone_t", [[len(x)], [len(tets)], [0]])
        node(zone, "ZoneType", "ZoneType_t", zone_type)
        node(zone, "FamilyName", "FamilyName_t", "flesh")
        grid = node(zone, "GridCoordinates", "GridCoordinates_t")
        for k in range(3):
            node(grid, "Coordinate" + "XYZ"[k], "DataArray_t", x[:, k])
        section = node(zone, "cells", "Elements_t", [kind, 0])
        node(section, "ElementRange", "IndexRange_t", [1, len(tets)])
        node(section, "ElementConnectivity", "DataArray_t", np.hstack([np.hstack([[10], t]) for t in tets]) if kind == 20 else tets.ravel())
        section = node(zone, "sides", "Elements_t", [5, 0])
        node(section, "ElementRange", "IndexRange_t", [len(tets) + 1] * 2)
        node(section, "ElementConnectivity", "DataArray_t", [1, 2, 3])
        conditions = node(zone, "ZoneBC", "ZoneBC_t")
        one = node(conditions, "base", "BC_t", "BCWall")
        node(one, "PointList", "IndexArray_t", [[len(tets) + 1]])
        node(one, "GridLocation", "GridLocation_t", "FaceCenter")
        one = node(conditions, "foot", "BC_t", "BCWall")
        node(one, "PointRange", "IndexRange_t", [[1], [2]])
        if change:
            change(f, zone)
    return path


for k, kind in enumerate((10, 20)):
    reads(f"CGNS of type {kind}", cgns(f"good{k}", kind=kind), r"cells +2 tets", r"flesh +2 tets", r"base +1 triangles, 0.5 m\^2", r"sides +1 tri",
          r"foot +2 points", r"volume +0.5 m\^3")
reads("CGNS TETRA_10", cgns("ten", kind=11, tets=TEN, x=SIX), "off the middle: 1, by 0.071")
refuses("CGNS structured", cgns("grid", zone_type="Structured"), "Structured")
refuses("CGNS with two zones", cgns("zones", lambda f, zone: node(zone.parent, "Other", "Zone_t")), "2 nodes Zone_t")
refuses("CGNS of polyhedra", cgns("ngon", kind=23), "'cells'", "type 23")
refuses("CGNS, a node that is not there", cgns("node", set_of("cells/ElementConnectivity/ data", np.array([1, 2, 3, 4, 2, 3, 4, 9]))), "element 2", "node 9")
refuses("CGNS, too few nodes", cgns("few", set_of("cells/ElementConnectivity/ data", np.array([1, 2, 3, 4]))), "'cells'")
refuses("CGNS, a range of lies", cgns("lies", set_of("cells/ElementRange/ data", np.array([1, 1 << 30]))), "'cells' announces")
refuses("CGNS, a condition of lies", cgns("far", set_of("ZoneBC/foot/PointRange/ data", np.array([[1], [1 << 39]]))), "'foot'")
refuses("CGNS of no base", cgns("none", lambda f, zone: f["Base"].attrs.__delitem__("label")), "CGNSBase_t")
(OUT / "old.cgns").write_bytes(b"@(#)ADF Database Version B02012>" + bytes(400))
refuses("CGNS in ADF", OUT / "old.cgns", "ADF")

# ---------------------------------------------------------------- damaged files

GOOD = [*Path("tests/data").glob("two_cubes*.exo"), Path("tests/data/two_cubes.med"), Path("tests/data/two_cubes.cgns"), OUT / "four.med", OUT / "good.exo",
        OUT / "good0.cgns"]
choose = random.Random(7)
for path in sorted(GOOD):
    data = path.read_bytes()
    used = [i for i in range(len(data)) if data[i]]
    for i in range(COUNT // len(GOOD) + 1):
        broken = bytearray(data)
        for _ in range(choose.randrange(1, 6)):
            broken[choose.choice(used)] = choose.randrange(256)
        if i % 5 == 0:
            del broken[choose.randrange(len(broken)):]
        file = OUT / f"damaged{path.suffix}"
        file.write_bytes(broken)
        try:
            code, text, lines = info(file)
        except subprocess.TimeoutExpired:
            code, text, lines = -1, "no end", []
        good = code in (0, 1) and len(lines) == (code == 1) and not re.search("PETSC ERROR|Sanitizer|runtime error|HDF5-DIAG", text)
        check(f"damaged {path.name} {i}", good, f"exit code {code}: {text[-400:]}")
        if not good:
            file.rename(OUT / f"kept_{failed}{path.suffix}")

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
