/*
  curve.c - tets with curved edges: cells of a second-order mesh whose edge nodes are not at the
  midpoints.

  x(l) = sum_a phi_a(l) x_a with the P2 basis (src/base/quadratic_map.c). The Jacobian of the map
  must be positive: it is checked at the quadrature points and at the ten nodes; edges of a tet
  where it is not are made straight, as gmsh leaves some at curved surfaces. The volume is the
  integral of the Jacobian, a cubic polynomial.
*/
#include <stdlib.h>
#include "mesh_impl.h"

static int compare(const void *a, const void *b)
{
  const PetscInt *p = (const PetscInt *)a;
  const PetscInt *q = ((const SbMiddle *)b)->end;

  if (p[0] != q[0])
    return p[0] < q[0] ? -1 : 1;
  return (p[1] > q[1]) - (p[1] < q[1]);
}

/* Jacobian of the map at the place L: six times the volume of the P1 tet with the same
   gradients. */
static PetscReal jacobian(const PetscReal x[SB_CELL_NODES][3], const PetscReal L[4])
{
  static const PetscInt own[4] = {0, 1, 2, 3};
  PetscReal corner[4][3];

  SbQuadraticCorners(L, x, corner);
  return SbTetDeterminant(&corner[0][0], own);
}

PetscReal SbTetCurvedVolume(const PetscReal x[], const PetscInt v[4], const PetscReal off[18])
{
  PetscReal node[SB_CELL_NODES][3];
  PetscReal volume = 0;

  SbTetNodes(x, v, off, node);
  for (int q = 0; q < SbRuleQuintic.n; q++)
    volume +=
      SbRuleQuintic.weight[q] * jacobian((const PetscReal(*)[3])node, SbRuleQuintic.L[q]) / 6;
  return volume;
}

PetscReal SbTetCurvedLeast(const PetscReal x[], const PetscInt v[4], const PetscReal off[18])
{
  PetscReal node[SB_CELL_NODES][3];
  PetscReal least = PETSC_MAX_REAL;

  SbTetNodes(x, v, off, node);
  for (int q = 0; q < SbRuleQuintic.n + SB_CELL_NODES; q++) {
    const int n = q - SbRuleQuintic.n;
    PetscReal L[4] = {0, 0, 0, 0};
    PetscReal at;

    if (n >= 0 && n < 4)
      L[n] = 1;
    if (n >= 4)
      L[SbTetEdge[n - 4][0]] = L[SbTetEdge[n - 4][1]] = 0.5;
    at = jacobian((const PetscReal(*)[3])node, n < 0 ? SbRuleQuintic.L[q] : L);
    if (at < least || isnan(at))
      least = at; /* NaN: the offsets may overflow */
  }
  return least / SbTetDeterminant(x, v);
}

PetscBool SbImportOffsets(const SbImport *im, int dim, const PetscInt v[], PetscReal off[18])
{
  PetscBool curved = PETSC_FALSE;

  for (int k = 0; k < 18; k++)
    off[k] = 0;
  for (int e = 0; im->nmiddle.n && e < 6; e++) {
    const int *p = SbTetEdge[e];
    PetscInt end[2];
    const SbMiddle *m;

    if (p[1] > dim)
      continue;
    end[0] = PetscMin(v[p[0]], v[p[1]]);
    end[1] = PetscMax(v[p[0]], v[p[1]]);
    m = (const SbMiddle *)bsearch(end, im->middle, (size_t)im->nmiddle.n, sizeof(*m), compare);
    for (int k = 0; m && k < 3; k++)
      off[3 * e + k] = m->off[k];
    curved = (PetscBool)(curved || m);
  }
  return curved;
}

static int compare_keys(const void *a, const void *b)
{
  const PetscInt64 p = *(const PetscInt64 *)a;
  const PetscInt64 q = *(const PetscInt64 *)b;

  return (p > q) - (p < q);
}

/* Key of an edge, alike on all ranks. */
static PetscInt64 edge_key(const SbImport *im, PetscBool alone, PetscInt a, PetscInt b)
{
  if (alone)
    return (PetscInt64)SbKeyOfPair(a, b);
  return (PetscInt64)SbKeyOfPair((PetscInt)im->vert_number[a], (PetscInt)im->vert_number[b]);
}

PetscErrorCode SbImportStraighten(MPI_Comm comm, SbImport *im, SbStraightened *done)
{
  PetscMPIInt size;
  PetscInt nfolded = 1;

  PetscFunctionBeginUser;
  *done = (SbStraightened){.nedge = 0};
  PetscCallMPI(MPI_Comm_size(comm, &size));

  // a straight edge changes all tets around it, which may fold then: until none does
  while (nfolded) {
    const PetscBool alone = (PetscBool)(size == 1);
    PetscInt64 *key = NULL;
    PetscInt64 *all = NULL;
    PetscInt room = 0;
    PetscInt n = 0;
    PetscInt total;
    PetscInt kept = 0;
    PetscInt here;

    nfolded = 0;
    for (PetscInt c = 0; im->nmiddle.n && c < im->item[3].n; c++) {
      const PetscInt *v = im->item[3].vert + 4 * c;
      PetscReal off[18];

      if (!SbImportOffsets(im, 3, v, off) || SbTetCurvedLeast(im->x, v, off) > 0)
        continue;
      if (!nfolded++ && !done->ntet) {
        done->number = im->item[3].number[c];
        for (int i = 0; i < 3; i++)
          done->at[i] = (im->x[3 * v[0] + i] + im->x[3 * v[1] + i] + im->x[3 * v[2] + i] +
                         im->x[3 * v[3] + i]) /
                        4;
      }
      for (int e = 0; e < 6; e++) {
        PetscCall(SbReserve(n + 1, sizeof(*key), &room, &key));
        key[n++] = edge_key(im, alone, v[SbTetEdge[e][0]], v[SbTetEdge[e][1]]);
      }
    }

    // the edges of all ranks; each drops those that it knows
    done->ntet += nfolded;
    if (alone) {
      all = key;
      total = n;
    } else {
      PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nfolded, 1, MPIU_INT, MPI_SUM, comm));
      PetscCall(SbAllgatherv(comm, MPIU_INT64, n, key, &total, &all, NULL));
      PetscCall(PetscFree(key));
    }
    if (total)
      qsort(all, (size_t)total, sizeof(*all), compare_keys);
    for (PetscInt i = 0; i < im->nmiddle.n && total; i++) {
      const PetscInt64 its = edge_key(im, alone, im->middle[i].end[0], im->middle[i].end[1]);

      if (!bsearch(&its, all, (size_t)total, sizeof(its), compare_keys))
        im->middle[kept++] = im->middle[i];
    }
    here = total ? im->nmiddle.n - kept : 0;
    done->nedge += here;
    im->nmiddle.n -= here;
    PetscCall(PetscFree(all));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The note about edges made straight; the first tet is that of the lowest rank that has one. */
static PetscErrorCode note_straightened(MPI_Comm comm, SbStraightened *s, SbBody *body)
{
  PetscMPIInt rank, lowest;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  lowest = s->ntet ? rank : PETSC_MPI_INT_MAX;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &lowest, 1, MPI_INT, MPI_MIN, comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &s->ntet, 1, MPIU_INT, MPI_SUM, comm));
  if (!s->ntet)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Bcast(&s->number, 1, MPI_INT64_T, lowest, comm));
  PetscCallMPI(MPI_Bcast(s->at, 3, MPIU_REAL, lowest, comm));
  SbAppend(sizeof(body->note), body->note,
           "%stets that folded over themselves, with their edges made straight: %" PetscInt_FMT
           " (the first: tetrahedron %lld at (%.4g, %.4g, %.4g) m)",
           body->note[0] ? ", " : "", s->ntet, (long long)s->number, (double)s->at[0],
           (double)s->at[1], (double)s->at[2]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportCurve(MPI_Comm comm, SbImport *im, SbBody *body, uint64_t cell[],
                             PetscReal **edge_off)
{
  SbStraightened straightened = {0};
  PetscInt n = 0;
  PetscInt room = 0;
  PetscReal volume = 0;

  PetscFunctionBeginUser;
  if (body->edge_nodes) {
    PetscCall(SbImportStraighten(comm, im, &straightened));
    PetscCall(note_straightened(comm, &straightened, body));
  }
  for (PetscInt c = 0; im->nmiddle.n && c < im->item[3].n; c++) {
    const PetscInt *v = im->item[3].vert + 4 * c;
    PetscReal off[18];

    if (!SbImportOffsets(im, 3, v, off))
      continue;
    n++;
    if (!body->edge_nodes)
      continue;
    volume += SbTetCurvedVolume(im->x, v, off) - SbTetDeterminant(im->x, v) / 6;
    if (!cell)
      continue;
    cell[c] |= SB_CURVED;
    PetscCall(SbReserve(n, 18 * sizeof(PetscReal), &room, edge_off));
    PetscCall(PetscArraycpy(*edge_off + 18 * (size_t)(n - 1), off, 18));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &n, 1, MPIU_INT, MPI_SUM, comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &volume, 1, MPIU_REAL, MPI_SUM, comm));
  body->volume += volume;
  SbNoteCount(
    sizeof(body->note), body->note,
    body->edge_nodes ? "curved tets" : "curved tets, which only p2 keeps, taken as straight", n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeshCurve(SbMesh mesh, PetscInt n, const PetscInt orig[], const PetscReal off[])
{
  PetscInt *leaf, *root;
  PetscInt ncurved = 0;
  PetscInt total = n;
  PetscLayout blocks;
  PetscSF sf;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPIU_INT, MPI_SUM, mesh->comm));
  if (!total)
    PetscFunctionReturn(PETSC_SUCCESS);

  // from the ranks that read them to all that have the cells, ghosts included
  PetscCall(PetscCalloc1(18 * (size_t)mesh->ncell + 1, &mesh->edge_off));
  PetscCall(PetscMalloc2(mesh->ncell, &leaf, mesh->ncell, &root));
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    if (!(mesh->cell_set[c] & SB_CURVED))
      continue;
    leaf[ncurved] = c;
    root[ncurved++] = mesh->cell_orig[c];
  }
  PetscCall(PetscLayoutCreateFromSizes(mesh->comm, PETSC_DECIDE, mesh->Ncell, 1, &blocks));
  PetscCall(
    PetscSFCreateByMatchingIndices(blocks, n, orig, NULL, 0, ncurved, root, leaf, 0, NULL, &sf));
  PetscCall(SbForestBroadcast(sf, 18, MPIU_REAL, off, mesh->edge_off));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscLayoutDestroy(&blocks));
  PetscCall(PetscFree2(leaf, root));
  PetscFunctionReturn(PETSC_SUCCESS);
}
