"""Meshes of the hard cases of contact: mapped grids of cubes, each divided into six tets, without flat tets and duplicate vertices."""
import itertools

import numpy as np


def grid(lines, keep=None, place=None):
    """Tets of a grid with the given coordinates (x, y, z); keep(i, j, k): whether a cube is kept; place(p): map of the points. Returns points, tets."""
    lines = [np.asarray(line, float) for line in lines]
    n = [len(line) for line in lines]
    number = np.arange(n[0] * n[1] * n[2]).reshape(n)
    x = np.stack([a.ravel() for a in np.meshgrid(*lines, indexing="ij")], axis=1)
    tets = []
    for i, j, k in np.ndindex(n[0] - 1, n[1] - 1, n[2] - 1):
        if keep is None or keep(i, j, k):
            for order in itertools.permutations(range(3)):
                at, tet = [i, j, k], [number[i, j, k]]
                for axis in order:
                    at[axis] += 1
                    tet.append(number[tuple(at)])
                tets.append(tet)
    return clean(x if place is None else np.array([place(p) for p in x]), np.array(tets))


def clean(x, tets):
    """Merges coincident points, drops flat tets, and orients the others to positive volume."""
    size = np.ptp(x, axis=0).max()
    _, first, inverse = np.unique(np.round(x / size, 9), axis=0, return_index=True, return_inverse=True)
    x, tets = x[first], inverse.ravel()[tets]
    a = x[tets]
    volume = np.einsum("ij,ij->i", np.cross(a[:, 1] - a[:, 0], a[:, 2] - a[:, 0]), a[:, 3] - a[:, 0]) / 6
    tets = np.where((volume < 0)[:, None], tets[:, [1, 0, 2, 3]], tets)[np.abs(volume) > 1e-9 * size**3]
    used, tets = np.unique(tets, return_inverse=True)
    return x[used], tets.reshape(-1, 4)


def even(a, b, n):
    return np.linspace(a, b, n + 1)


def box(size, n):
    """From 0 to size, n cubes along each side."""
    return grid([even(0, s, m) for s, m in zip(size, n)])


def spike(n, side=0.1, height=0.1):
    """A pyramid about the z axis, its tip at the height."""
    def place(p):
        return (p[0] * (1 - p[2] / height), p[1] * (1 - p[2] / height), p[2])

    return grid([even(-side / 2, side / 2, n), even(-side / 2, side / 2, n), even(0, height, n)], place=place)


def wedge(n, side=0.1, height=0.1):
    """A roof, its ridge along y."""
    def place(p):
        return (p[0] * (1 - p[2] / height), p[1], p[2])

    return grid([even(-side / 2, side / 2, n), even(-side / 2, side / 2, n), even(0, height, n)], place=place)


def crack(n, side=0.15, height=0.1, width=0.004):
    """A block with a crack along y that closes towards its bottom, half its height."""
    def place(p):
        if abs(abs(p[0]) - width / 2) > 1e-12:
            return p
        return (p[0] * max(0, 2 * p[2] / height - 1), p[1], p[2])

    half = even(width / 2, side / 2, n)
    return grid([np.concatenate([-half[::-1], half]), even(-side / 2, side / 2, n), even(0, height, 2 * n)],
                keep=lambda i, j, k: i != n or k < n, place=place)


def hole(n, side=0.15, height=0.1, width=0.03):
    """A block with a square hole, half its height deep."""
    half = even(width / 2, side / 2, n)
    line = np.concatenate([-half[::-1], half])
    return grid([line, line, even(0, height, 2 * n)], keep=lambda i, j, k: i != n or j != n or k < n)


def ball(n, radius):
    """A cube mapped to a ball."""
    def place(p):
        p = np.array(p)
        most = np.abs(p).max()
        return p if most == 0 else p * most / np.linalg.norm(p) * radius

    return grid([even(-1, 1, n)] * 3, place=place)


def ring(radius, half, around, n, turns=1.0):
    """A torus of square section about the z axis; turns < 1: an arc."""
    def place(p):
        angle = 2 * np.pi * p[0]
        return ((radius + p[1]) * np.cos(angle), (radius + p[1]) * np.sin(angle), p[2])

    return grid([even(0, turns, around), even(-half, half, n), even(-half, half, n)], place=place)


def surface(tets, also=None):
    """Surface triangles, oriented outwards; also: the same corners in another numbering of the tets."""
    corners = ([1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1])
    faces = np.concatenate([tets[:, c] for c in corners])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    outer = first[count == 1]
    return faces[outer] if also is None else (faces[outer], np.concatenate([also[:, c] for c in corners])[outer])


def turn(x, axis, degrees):
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    angle = np.radians(degrees)
    return x * np.cos(angle) + np.cross(axis, x) * np.sin(angle) + np.outer(x @ axis, axis) * (1 - np.cos(angle))


def write_msh(path, mesh):
    x, tets = mesh
    with open(path, "w") as f:
        f.write("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%d\n" % len(x))
        for i, p in enumerate(x):
            f.write("%d %.17g %.17g %.17g\n" % (i + 1, *p))
        f.write("$EndNodes\n$Elements\n%d\n" % len(tets))
        for i, t in enumerate(tets):
            f.write("%d 4 2 1 1 %d %d %d %d\n" % (i + 1, *(t + 1)))
        f.write("$EndElements\n")


def write_off(path, x, triangles):
    used, triangles = np.unique(triangles, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    with open(path, "w") as f:
        f.write("OFF\n%d %d 0\n" % (len(used), len(triangles)))
        for p in x[used]:
            f.write("%.17g %.17g %.17g\n" % tuple(p))
        for t in triangles:
            f.write("3 %d %d %d\n" % tuple(t))
