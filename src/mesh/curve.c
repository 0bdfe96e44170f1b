/*
  curve.c - tets with curved edges: a mesh of second order whose nodes at edges lie off the middle.

  x(l) = sum_a phi_a(l) x_a with the basis of P2 (src/base/quadratic_map.c). The map must have a positive Jacobian, which is examined where it is used, at the
  points of the rule, and at the ten nodes. The volume is the integral of the Jacobian, a cubic polynomial.
*/
#include "mesh_impl.h"
#include "sbkernel.h"

static int compare(const void *a, const void *b)
{
  const PetscInt *p = (const PetscInt *)a, *q = ((const SbMiddle *)b)->end;

  if (p[0] != q[0]) return p[0] < q[0] ? -1 : 1;
  return (p[1] > q[1]) - (p[1] < q[1]);
}

/* Six times the volume of the P1 tet with the derivatives at L. */
static PetscReal jacobian(const PetscReal x[SB_CELL_NODES][3], const PetscReal L[4])
{
  static const PetscInt own[4] = {0, 1, 2, 3};
  PetscReal corner[4][3];

  SbQuadraticCorners(L, x, corner);
  return SbTetDeterminant(&corner[0][0], own);
}

/* The ten nodes of a tet. */
static void positions(const PetscReal x[], const PetscInt v[4], const PetscReal off[18],
                      PetscReal node[SB_CELL_NODES][3])
{
  for (int k = 0; k < 12; k++) node[k / 3][k % 3] = x[3 * v[k / 3] + k % 3];
  for (int k = 0; k < 18; k++)
    node[4 + k / 3][k % 3] =
      0.5 * (x[3 * v[SbTetEdge[k / 3][0]] + k % 3] + x[3 * v[SbTetEdge[k / 3][1]] + k % 3]) + off[k];
}

PetscReal SbTetCurvedVolume(const PetscReal x[], const PetscInt v[4], const PetscReal off[18])
{
  PetscReal node[SB_CELL_NODES][3], volume = 0;

  positions(x, v, off, node);
  for (int q = 0; q < SbRuleQuintic.n; q++)
    volume += SbRuleQuintic.weight[q] * jacobian((const PetscReal(*)[3])node, SbRuleQuintic.L[q]) / 6;
  return volume;
}

PetscErrorCode SbImportCurve(const SbImport *im, SbBody *body, uint64_t cell[], PetscReal **edge_off)
{
  PetscInt ncurved = 0;
  char text[128];

  PetscFunctionBeginUser;
  if (!im->nmiddle.n) PetscFunctionReturn(PETSC_SUCCESS);
  if (body->edge_nodes) PetscCall(PetscCalloc1(18 * (size_t)im->item[3].n, edge_off));
  for (PetscInt c = 0; c < im->item[3].n; c++) {
    const PetscInt *v = im->item[3].vert + 4 * c;
    PetscReal x[SB_CELL_NODES][3], off[18] = {0}, least = PETSC_MAX_REAL;
    PetscBool curved = PETSC_FALSE;

    for (int e = 0; e < 6; e++) {
      const PetscInt a = v[SbTetEdge[e][0]], b = v[SbTetEdge[e][1]],
                     end[2] = {PetscMin(a, b), PetscMax(a, b)};
      const SbMiddle *m =
        (const SbMiddle *)bsearch(end, im->middle, (size_t)im->nmiddle.n, sizeof(*m), compare);

      for (int k = 0; m && k < 3; k++) off[3 * e + k] = m->off[k];
      curved = (PetscBool)(curved || m);
    }
    ncurved += curved;
    if (!curved || !*edge_off) continue;

    // its Jacobian where it is used and at its nodes, and its volume instead of that of the straight tet
    cell[c] |= SB_CURVED;
    PetscCall(PetscArraycpy(*edge_off + 18 * (size_t)c, off, 18));
    positions(im->x, v, off, x);
    for (int q = 0; q < SbRuleQuintic.n + SB_CELL_NODES; q++) {
      const int n = q - SbRuleQuintic.n;
      PetscReal L[4] = {0, 0, 0, 0};

      if (n >= 0 && n < 4) L[n] = 1;
      if (n >= 4) L[SbTetEdge[n - 4][0]] = L[SbTetEdge[n - 4][1]] = 0.5;
      least = PetscMin(least, jacobian((const PetscReal(*)[3])x, n < 0 ? SbRuleQuintic.L[q] : L));
    }
    PetscCheck(
      least > 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
      "%s: tetrahedron %lld of second order folds over itself: its least Jacobian is %.3g times that of the "
      "straight tet, and must be above 0; mesh finer there or let gmsh untangle it (Mesh.HighOrderOptimize = "
      "2), or save straight tets (Mesh.ElementOrder = 1)",
      im->where, (long long)im->item[3].number[c], (double)(least / SbTetDeterminant(im->x, v)));
    body->volume += SbTetCurvedVolume(im->x, v, off) - SbTetDeterminant(im->x, v) / 6;
  }
  if (!ncurved) PetscFunctionReturn(PETSC_SUCCESS);
  (void)snprintf(text, sizeof(text), "%s%s: %" PetscInt_FMT, body->note[0] ? ", " : "",
                 *edge_off ? "curved tets" : "curved tets, which only p2 keeps, taken as straight", ncurved);
  PetscCall(PetscStrlcat(body->note, text, sizeof(body->note)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeshCurve(SbMesh mesh, const PetscReal *edge_off)
{
  PetscInt *leaf, *root, n = 0;
  PetscMPIInt any = edge_off != NULL;
  PetscSF sf;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Bcast(&any, 1, MPI_INT, 0, mesh->comm));
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(18 * (size_t)mesh->ncell, &mesh->edge_off));
  PetscCall(PetscMalloc2(mesh->ncell, &leaf, mesh->ncell, &root));
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    if (!(mesh->cell_set[c] & SB_CURVED)) continue;
    leaf[n] = c;
    root[n++] = mesh->cell_orig[c];
  }
  PetscCall(SbForestOnRank0(mesh->comm, mesh->Ncell, n, leaf, root, &sf));
  PetscCall(SbForestBroadcast(sf, 18, MPIU_REAL, edge_off, mesh->edge_off));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscFree2(leaf, root));
  PetscFunctionReturn(PETSC_SUCCESS);
}
