/*
  faces.c - connectivity of a tet mesh: which cells share a face; the edges of the cells.

  Counting sort: the four faces of every cell go into the bucket of their lowest vertex. Each
  bucket, of about twenty faces, is sorted by the other two vertices; adjacent equal entries are one
  face. No hash table, no comparison of triples. O(n) in the number of cells for meshes of bounded
  vertex degree, O(n log n) for all others.
*/
#include "mesh_impl.h"

const int SbFaceVertex[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

/* Lowest vertex of a face, and the sort key of the other two vertices. */
static inline PetscInt face_key(PetscInt a, PetscInt b, PetscInt c, uint64_t *key)
{
  const PetscInt lo = PetscMin(PetscMin(a, b), c);
  const PetscInt hi = PetscMax(PetscMax(a, b), c);
  const PetscInt mid = PetscMax(PetscMin(a, b), PetscMin(PetscMax(a, b), c));

  *key = SbKeyOfPair(mid, hi);
  return lo;
}

/* The same of face `slot` = 4 cell + face. */
static inline PetscInt slot_key(const PetscInt cell[], PetscInt slot, uint64_t *key)
{
  const PetscInt *v = cell + 4 * (slot / 4);
  const int *f = SbFaceVertex[slot % 4];

  return face_key(v[f[0]], v[f[1]], v[f[2]], key);
}

PetscErrorCode SbFacesCreate(PetscInt nvert, PetscInt ncell, const PetscInt cell[], SbFaces *faces)
{
  PetscInt *next;
  uint64_t key;

  PetscFunctionBeginUser;
  *faces = (SbFaces){.ncell = ncell};

  // buckets of the faces by lowest vertex
  PetscCall(PetscMalloc2(nvert + 1, &faces->start, 4 * (size_t)ncell, &faces->face));
  PetscCall(PetscArrayzero(faces->start, nvert + 1));
  for (PetscInt s = 0; s < 4 * ncell; s++)
    faces->start[slot_key(cell, s, &key) + 1]++;
  for (PetscInt v = 0; v < nvert; v++)
    faces->start[v + 1] += faces->start[v];
  PetscCall(PetscMalloc1(nvert, &next));
  PetscCall(PetscArraycpy(next, faces->start, nvert));
  for (PetscInt s = 0; s < 4 * ncell; s++) {
    const PetscInt at = next[slot_key(cell, s, &key)]++;

    faces->face[at] = (SbKey){key, s};
  }
  PetscCall(PetscFree(next));

  // neighbours: sort each bucket
  PetscCall(PetscMalloc1(4 * (size_t)ncell, &faces->neighbour));
  for (PetscInt s = 0; s < 4 * ncell; s++)
    faces->neighbour[s] = -1;
  for (PetscInt v = 0; v < nvert; v++) {
    SbKey *face = faces->face;
    const PetscInt begin = faces->start[v];
    const PetscInt end = faces->start[v + 1];

    // insertion sort of short buckets, stable: equal faces stay in the order of their cells
    if (end - begin > 64)
      SbKeysSort(end - begin, face + begin);
    for (PetscInt i = begin + 1; i < end && end - begin <= 64; i++) {
      const SbKey f = face[i];
      PetscInt j = i;

      for (; j > begin && face[j - 1].key > f.key; j--)
        face[j] = face[j - 1];
      face[j] = f;
    }

    // equal keys: one face is on the boundary, two are neighbours, three are an error
    for (PetscInt i = begin, n; i < end; i += n) {
      n = SbKeysAlike(end, face, i);
      if (n == 1)
        faces->nboundary++;
      else if (n == 2) {
        faces->neighbour[face[i].slot] = face[i + 1].slot / 4;
        faces->neighbour[face[i + 1].slot] = face[i].slot / 4;
      } else if (!faces->nshared++) {
        for (int k = 0; k < 3; k++)
          faces->shared[k] = face[i + k].slot / 4;
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFacesDestroy(SbFaces *faces)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree2(faces->start, faces->face));
  PetscCall(PetscFree(faces->neighbour));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt SbFacesFind(const SbFaces *faces, const PetscInt vert[3], PetscInt slots[2])
{
  uint64_t key;
  const PetscInt lo = face_key(vert[0], vert[1], vert[2], &key);
  const PetscInt end = faces->start[lo + 1] - faces->start[lo];
  const SbKey *face = faces->face + faces->start[lo];
  PetscInt n = 0;

  for (PetscInt i = SbKeysFind(end, face, key); i >= 0 && n < 2 && i < end && face[i].key == key;
       i++)
    slots[n++] = face[i].slot;
  return n;
}

/* Counting sort: each edge is in the bucket of its lower vertex, where equal higher vertices are
   one edge. */
PetscErrorCode SbTetEdges(PetscInt nvert, PetscInt ncell, const PetscInt cell[], PetscInt *nedge,
                          PetscInt **edge)
{
  const PetscInt n = 6 * ncell;
  PetscInt *low, *high, *start, *item;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(n, &low, n, &high));
  PetscCall(PetscMalloc1(n, edge));
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt *v = cell + 4 * (i / 6);
    const PetscInt a = v[SbTetEdge[i % 6][0]];
    const PetscInt b = v[SbTetEdge[i % 6][1]];

    low[i] = PetscMin(a, b);
    high[i] = PetscMax(a, b);
  }
  PetscCall(SbBucketByKey(n, low, nvert, &start, &item));
  *nedge = 0;
  for (PetscInt v = 0; v < nvert; v++) {
    for (PetscInt i = start[v]; i < start[v + 1]; i++) {
      PetscInt j = start[v];

      while (high[item[j]] != high[item[i]])
        j++;
      (*edge)[item[i]] = j < i ? (*edge)[item[j]] : (*nedge)++;
    }
  }
  PetscCall(PetscFree2(low, high));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(item));
  PetscFunctionReturn(PETSC_SUCCESS);
}
