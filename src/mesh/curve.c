/*
  curve.c - tets with curved edges: cells of a second-order mesh whose edge nodes are not at the midpoints.

  x(l) = sum_a phi_a(l) x_a with the P2 basis (src/base/quadratic_map.c). The Jacobian of the map must be
  positive: it is checked at the quadrature points and at the ten nodes. The volume is the integral of the
  Jacobian, a cubic polynomial.
*/
#include "mesh_impl.h"
#include "sbkernel.h"

static int compare(const void *a, const void *b)
{
  const PetscInt *p = (const PetscInt *)a, *q = ((const SbMiddle *)b)->end;

  if (p[0] != q[0]) return p[0] < q[0] ? -1 : 1;
  return (p[1] > q[1]) - (p[1] < q[1]);
}

/* Jacobian of the map at the place L: six times the volume of the P1 tet with the same gradients. */
static PetscReal jacobian(const PetscReal x[SB_CELL_NODES][3], const PetscReal L[4])
{
  static const PetscInt own[4] = {0, 1, 2, 3};
  PetscReal corner[4][3];

  SbQuadraticCorners(L, x, corner);
  return SbTetDeterminant(&corner[0][0], own);
}

PetscReal SbTetCurvedVolume(const PetscReal x[], const PetscInt v[4], const PetscReal off[18])
{
  PetscReal node[SB_CELL_NODES][3], volume = 0;

  SbTetNodes(x, v, off, node);
  for (int q = 0; q < SbRuleQuintic.n; q++)
    volume += SbRuleQuintic.weight[q] * jacobian((const PetscReal(*)[3])node, SbRuleQuintic.L[q]) / 6;
  return volume;
}

PetscReal SbTetCurvedLeast(const PetscReal x[], const PetscInt v[4], const PetscReal off[18])
{
  PetscReal node[SB_CELL_NODES][3], least = PETSC_MAX_REAL;

  SbTetNodes(x, v, off, node);
  for (int q = 0; q < SbRuleQuintic.n + SB_CELL_NODES; q++) {
    const int n = q - SbRuleQuintic.n;
    PetscReal L[4] = {0, 0, 0, 0}, at;

    if (n >= 0 && n < 4) L[n] = 1;
    if (n >= 4) L[SbTetEdge[n - 4][0]] = L[SbTetEdge[n - 4][1]] = 0.5;
    at = jacobian((const PetscReal(*)[3])node, n < 0 ? SbRuleQuintic.L[q] : L);
    if (at < least || isnan(at)) least = at; /* NaN: the offsets may overflow */
  }
  return least / SbTetDeterminant(x, v);
}

PetscBool SbImportOffsets(const SbImport *im, int dim, const PetscInt v[], PetscReal off[18])
{
  PetscBool curved = PETSC_FALSE;

  for (int k = 0; k < 18; k++) off[k] = 0;
  for (int e = 0; im->nmiddle.n && e < 6; e++) {
    const int *p = SbTetEdge[e];
    PetscInt end[2];
    const SbMiddle *m;

    if (p[1] > dim) continue;
    end[0] = PetscMin(v[p[0]], v[p[1]]);
    end[1] = PetscMax(v[p[0]], v[p[1]]);
    m = (const SbMiddle *)bsearch(end, im->middle, (size_t)im->nmiddle.n, sizeof(*m), compare);
    for (int k = 0; m && k < 3; k++) off[3 * e + k] = m->off[k];
    curved = (PetscBool)(curved || m);
  }
  return curved;
}

/* Statistics of curved cells. */
typedef struct {
  PetscInt n[2];    /* numbers of curved cells, and of those whose Jacobian is not positive */
  int64_t number;   /* file number of the first cell whose Jacobian is not positive */
  PetscReal least;  /* its smallest Jacobian over that of the straight tet */
  PetscReal volume; /* sum of the volume changes relative to straight tets, m^3 */
} Curved;

/* The curved cells of this rank, with their edge offsets if `keep`; without cell[] they are only counted. */
static PetscErrorCode find_curved(const SbImport *im, PetscBool keep, uint64_t cell[], PetscReal **edge_off,
                                  Curved *found)
{
  PetscInt room = 0;

  PetscFunctionBeginUser;
  for (PetscInt c = 0; im->nmiddle.n && c < im->item[3].n; c++) {
    const PetscInt *v = im->item[3].vert + 4 * c;
    PetscReal off[18], least;

    if (!SbImportOffsets(im, 3, v, off)) continue;
    found->n[0]++;
    if (!keep) continue;

    // smallest Jacobian at quadrature points and nodes, and the change of volume relative to the straight tet
    least = SbTetCurvedLeast(im->x, v, off);
    if (!(least > 0) && !found->n[1]++) {
      found->number = im->item[3].number[c];
      found->least = least;
    }
    found->volume += SbTetCurvedVolume(im->x, v, off) - SbTetDeterminant(im->x, v) / 6;
    if (!cell) continue;
    cell[c] |= SB_CURVED;
    PetscCall(SbReserve(found->n[0], 18 * sizeof(PetscReal), &room, edge_off));
    PetscCall(PetscArraycpy(*edge_off + 18 * (size_t)(found->n[0] - 1), off, 18));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode refuse(const SbImport *im, const Curved *found, PetscInt nfolded)
{
  PetscFunctionBeginUser;
  SETERRQ(
    PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s: tetrahedron %lld of second order folds over itself (tets that do: %lld): its least Jacobian is %.3g "
    "times that of the straight tet, and must be above 0; mesh finer there or let gmsh untangle it "
    "(Mesh.HighOrderOptimize = 2), or save straight tets (Mesh.ElementOrder = 1)",
    im->where, (long long)found->number, (long long)nfolded, (double)found->least);
}

PetscErrorCode SbImportCurve(MPI_Comm comm, const SbImport *im, SbBody *body, uint64_t cell[],
                             PetscReal **edge_off)
{
  SbCaughtError caught = {0, ""};
  Curved found = {{0, 0}, 0, 0, 0};
  PetscInt n[2];

  PetscFunctionBeginUser;
  PetscCall(find_curved(im, body->edge_nodes, cell, edge_off, &found));
  PetscCallMPI(MPI_Allreduce(found.n, n, 2, MPIU_INT, MPI_SUM, comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &found.volume, 1, MPIU_REAL, MPI_SUM, comm));
  if (!n[0]) PetscFunctionReturn(PETSC_SUCCESS);
  if (cell && found.n[1]) SB_CATCH(&caught, refuse(im, &found, n[1]));
  PetscCall(SbCaughtRaise(comm, &caught));
  body->volume += found.volume;
  SbAppend(sizeof(body->note), body->note, "%s%s: %" PetscInt_FMT, body->note[0] ? ", " : "",
           body->edge_nodes ? "curved tets" : "curved tets, which only p2 keeps, taken as straight", n[0]);
  if (n[1])
    SbAppend(sizeof(body->note), body->note,
             ", folded over themselves, which p2 refuses: %" PetscInt_FMT " (the first: tetrahedron %lld)",
             n[1], (long long)found.number);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeshCurve(SbMesh mesh, PetscInt n, const PetscInt orig[], const PetscReal off[])
{
  PetscInt *leaf, *root, ncurved = 0, total = n, ndealt;
  PetscReal *dealt;
  PetscLayout rows;
  PetscSF sf;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPIU_INT, MPI_SUM, mesh->comm));
  if (!total) PetscFunctionReturn(PETSC_SUCCESS);
  // offsets go from the ranks that read them to the home ranks of the cells' original numbers
  PetscCall(PetscLayoutCreateFromSizes(mesh->comm, PETSC_DECIDE, mesh->Ncell, 1, &rows));
  PetscCall(PetscLayoutGetLocalSize(rows, &ndealt));
  PetscCall(PetscMalloc1(18 * (size_t)ndealt, &dealt));
  PetscCall(PetscSFCreate(mesh->comm, &sf));
  PetscCall(PetscSFSetGraphLayout(sf, rows, n, NULL, PETSC_COPY_VALUES, orig));
  PetscCall(SbForestReduce(sf, 18, MPIU_REAL, off, dealt));
  PetscCall(PetscSFDestroy(&sf));
  // and from the home ranks to all ranks that have the cells, ghosts included
  PetscCall(PetscCalloc1(18 * (size_t)mesh->ncell, &mesh->edge_off));
  PetscCall(PetscMalloc2(mesh->ncell, &leaf, mesh->ncell, &root));
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    if (!(mesh->cell_set[c] & SB_CURVED)) continue;
    leaf[ncurved] = c;
    root[ncurved++] = mesh->cell_orig[c];
  }
  PetscCall(PetscSFCreate(mesh->comm, &sf));
  PetscCall(PetscSFSetGraphLayout(sf, rows, ncurved, leaf, PETSC_COPY_VALUES, root));
  PetscCall(SbForestBroadcast(sf, 18, MPIU_REAL, dealt, mesh->edge_off));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscLayoutDestroy(&rows));
  PetscCall(PetscFree2(leaf, root));
  PetscCall(PetscFree(dealt));
  PetscFunctionReturn(PETSC_SUCCESS);
}
