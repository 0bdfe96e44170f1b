/*
  curve.c - tets with curved edges: cells of a second-order mesh whose edge nodes are not at the
  midpoints.

  x(l) = sum_a phi_a(l) x_a with the P2 basis (src/base/quadratic_map.c). The Jacobian of the map
  must be positive: it is checked at the quadrature points and at the ten nodes. The volume is the
  integral of the Jacobian, a cubic polynomial.
*/
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

/* Error of the first tet whose Jacobian is not positive, by its number in the file. */
static PetscErrorCode refuse(const SbImport *im, int64_t number, PetscReal least, PetscInt nfolded)
{
  PetscFunctionBeginUser;
  SETERRQ(
    PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s: tetrahedron %lld of second order folds over itself (tets that do: %lld): its least "
    "Jacobian is %.3g "
    "times that of the straight tet, and must be above 0; mesh finer there or let gmsh untangle it "
    "(Mesh.HighOrderOptimize = 2), or save straight tets (Mesh.ElementOrder = 1)",
    im->where, (long long)number, (long long)nfolded, (double)least);
}

PetscErrorCode SbImportCurve(MPI_Comm comm, const SbImport *im, SbBody *body, uint64_t cell[],
                             PetscReal **edge_off)
{
  SbCaughtError caught = {0, ""};
  PetscInt mine[2] = {0, 0}, n[2],
           room = 0; /* curved cells; those whose Jacobian is not positive */
  PetscReal least = 0;
  PetscReal volume = 0;
  int64_t number = 0;

  PetscFunctionBeginUser;
  for (PetscInt c = 0; im->nmiddle.n && c < im->item[3].n; c++) {
    const PetscInt *v = im->item[3].vert + 4 * c;
    PetscReal off[18], smallest;

    if (!SbImportOffsets(im, 3, v, off))
      continue;
    mine[0]++;
    if (!body->edge_nodes)
      continue;

    // smallest Jacobian at quadrature points and nodes, and the change of volume relative to the
    // straight tet
    smallest = SbTetCurvedLeast(im->x, v, off);
    if (!(smallest > 0) && !mine[1]++) {
      number = im->item[3].number[c];
      least = smallest;
    }
    volume += SbTetCurvedVolume(im->x, v, off) - SbTetDeterminant(im->x, v) / 6;
    if (!cell)
      continue;
    cell[c] |= SB_CURVED;
    PetscCall(SbReserve(mine[0], 18 * sizeof(PetscReal), &room, edge_off));
    PetscCall(PetscArraycpy(*edge_off + 18 * (size_t)(mine[0] - 1), off, 18));
  }
  PetscCallMPI(MPI_Allreduce(mine, n, 2, MPIU_INT, MPI_SUM, comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &volume, 1, MPIU_REAL, MPI_SUM, comm));
  if (!n[0])
    PetscFunctionReturn(PETSC_SUCCESS);
  if (cell && mine[1])
    SB_CATCH(&caught, refuse(im, number, least, n[1]));
  PetscCall(SbCaughtRaise(comm, &caught));
  body->volume += volume;
  SbNoteCount(
    sizeof(body->note), body->note,
    body->edge_nodes ? "curved tets" : "curved tets, which only p2 keeps, taken as straight", n[0]);
  if (n[1])
    SbAppend(sizeof(body->note), body->note,
             ", folded over themselves, which p2 refuses: %" PetscInt_FMT
             " (the first: tetrahedron %lld)",
             n[1], (long long)number);
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
