"""Intersections of surfaces, computed independently of the program: edges that intersect triangles, in double precision.

If the package ipctk is installed, its test checks the same frames too.
"""
import h5py
import numpy as np

from contact_meshes import surface

try:
    import ipctk
except ImportError:
    ipctk = None


def edges_of(triangles):
    return np.unique(np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1), axis=0)


def volume(a, b, c, d):
    """Six times the signed volumes of tets; 0 within rounding."""
    p, q, r = b - a, c - a, d - a
    v = np.einsum("ij,ij->i", np.cross(p, q), r)
    size = np.abs(p).max(axis=1) * np.abs(q).max(axis=1) * np.abs(r).max(axis=1)
    return np.where(np.abs(v) <= 1e-14 * size, 0, v)


def crossings(x, edges, triangles):
    """Intersecting pairs of an edge and a triangle without common vertices."""
    axis = np.ptp(x, axis=0).argmax()
    e, t = x[edges], x[triangles]
    elow, ehigh, tlow, thigh = e.min(axis=1), e.max(axis=1), t.min(axis=1), t.max(axis=1)
    order = np.argsort(elow[:, axis])
    start = elow[order, axis]
    longest = (ehigh - elow)[:, axis].max()
    first = np.searchsorted(start, tlow[:, axis] - longest, "left")
    last = np.searchsorted(start, thigh[:, axis], "right")
    count = last - first
    found = []
    # in blocks, to limit memory
    for part in np.array_split(np.arange(len(triangles)), max(1, int(count.sum() // 2_000_000) + 1)):
        n = count[part]
        ti = np.repeat(part, n)
        ei = order[np.repeat(first[part] - np.concatenate([[0], np.cumsum(n)[:-1]]), n) + np.arange(n.sum())]
        near = np.all((elow[ei] <= thigh[ti]) & (ehigh[ei] >= tlow[ti]), axis=1)
        ei, ti = ei[near], ti[near]
        apart = (edges[ei][:, :, None] != triangles[ti][:, None, :]).all(axis=(1, 2))
        ei, ti = ei[apart], ti[apart]
        a, b, p, q, r = e[ei, 0], e[ei, 1], t[ti, 0], t[ti, 1], t[ti, 2]
        sides = volume(p, q, r, a) * volume(p, q, r, b) < 0
        around = np.stack([volume(a, b, p, q), volume(a, b, q, r), volume(a, b, r, p)])
        sides &= (around > 0).all(axis=0) | (around < 0).all(axis=0)
        found += list(zip(ei[sides], ti[sides]))
    return found


def weld(path):
    """For a run whose tets have separate points: the matrix from these points to the contact surface, means over the boundary facets at each
    vertex, as rows (vertex, point, weight); with triangles and the body of each vertex."""
    with h5py.File(path) as f:
        x, cells, body = f["mesh/x"][...], f["mesh/cells"][...], f["mesh/body"][...]
    size = np.ptp(x, axis=0).max()
    key = np.concatenate([np.round(x / size, 9), np.zeros((len(x), 1))], axis=1)
    key[cells, 3] = body[:, None]
    _, vertex = np.unique(key, axis=0, return_inverse=True)
    vertex = vertex.ravel()
    triangles, points = surface(vertex[cells], also=cells)
    count = np.bincount(triangles.ravel(), minlength=vertex.max() + 1)
    vertex_body = np.zeros(vertex.max() + 1, int)
    vertex_body[vertex] = key[:, 3]
    return triangles, vertex_body, triangles.ravel(), points.ravel(), 1 / count[triangles.ravel()]


def frames(path, most, to=None):
    """Steps and positions x of the frames of a run, a limited number including the last one; to: the matrix of weld()."""
    with h5py.File(path) as f:
        x, steps = f["mesh/x"][...], f["step"]
        names = sorted(f"{group}/{name}" for group in steps for name in steps[group])
        chosen = np.unique(np.linspace(0, len(names) - 1, min(most, len(names))).astype(int))
        for i in chosen:
            now = x + steps[names[i]]["displacement"][...]
            if to:
                mean = np.zeros((len(to[1]), 3))
                np.add.at(mean, to[2], to[4][:, None] * now[to[3]])
                now = mean
            yield int(names[i].split("/")[-1]), now


def topology(path):
    """Surface triangles of the bodies of a run, and the body of each vertex."""
    with h5py.File(path) as f:
        cells, body = f["mesh/cells"][...], f["mesh/body"][...]
    vertex_body = np.zeros(cells.max() + 1, int)
    vertex_body[cells] = body[:, None]
    return surface(cells), vertex_body


def samples(x, triangles):
    """Sample points on triangles: a lattice of fifteen on each."""
    b = np.array([(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]) / 4
    return np.einsum("kc,tcx->tkx", b, x[triangles]).reshape(-1, 3)


def check(path, most=40, self_contact=True, solids=(), tool=None, split=False, times=None):
    """Checks the frames of fields.h5. solids: functions (points, t) -> signed distance from an obstacle, m; tool: function (t) -> points and
    triangles of an obstacle given by a mesh; split: tets have separate points; times: s by step. Returns a list of the failures found."""
    to = weld(path) if split else None
    triangles, body = to[:2] if split else topology(path)
    found = []
    for step, x in frames(path, most, to):
        every, all_x = triangles, x
        if tool:
            points, more = tool(times[step])
            every = np.concatenate([triangles, more + len(x)])
            all_x = np.concatenate([x, points])
        parts = np.concatenate([body, np.full(len(all_x) - len(x), -1)])
        edges = edges_of(every)
        hits = [(e, t) for e, t in crossings(all_x, edges, every)
                if self_contact and parts[edges[e, 0]] >= 0 or parts[edges[e, 0]] != parts[every[t, 0]]]
        if hits:
            found.append(f"step {step}: {len(hits)} edges through triangles, one at {all_x[edges[hits[0][0], 0]]}")
        if ipctk and self_contact and not tool:
            mesh = ipctk.CollisionMesh(all_x, edges, every)
            if ipctk.has_intersections(mesh, all_x):
                found.append(f"step {step}: ipctk finds an intersection")
        for solid in solids:
            least = solid(samples(x, triangles), times[step]).min()
            if least < 0:
                found.append(f"step {step}: {-least:g} m behind an obstacle")
    return found
