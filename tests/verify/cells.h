/*
  cells.h - displacement function of any element in a cell and at a vertex; boxes with perturbed
  interior vertices.
*/
#pragma once
#include "verify.h"

/* Displacement function of an element in one cell: linear; for P2 plus 4 b_i b_j e_ij for each
   edge. */
typedef struct {
  PetscReal x[4][3]; /* vertices at rest, m */
  PetscReal u[4][3]; /* vertex values in this cell */
  PetscReal e[6][3]; /* P2: values at the edge nodes less the means of the end vertices; else 0 */
  PetscReal g[4][3]; /* P1, P2: gradients of the barycentric coordinates, 1/m */
  PetscReal H[9];    /* gradient of the linear part, H[3*i+j] = du_i/dX_j */
  PetscReal V;       /* volume, m^3 */
} VerifyCell;

/* Evaluates the function of cell c from u[nnode][3], ghosts included. */
static inline void verify_cell(SbSpace s, const PetscReal u[], PetscInt c, VerifyCell *cell)
{
  const SbElement e = SbSpaceCellElement(s, c);
  const PetscInt *vertex = s->mesh->cell + 4 * c;
  const PetscInt *node = s->cell_node + 4 * c;

  for (int v = 0; v < 4; v++) {
    for (int k = 0; k < 3; k++) {
      cell->x[v][k] = s->mesh->x[3 * vertex[v] + k];
      cell->u[v][k] = 0.;
      for (int a = 0; a < 4; a++)
        cell->u[v][k] += e->ops.vertex[v][a] * u[3 * node[a] + k];
    }
  }
  for (int q = 0; q < 18; q++) {
    const int *v = SbTetEdge[q / 3];
    const int k = q % 3;

    cell->e[q / 3][k] = e->nodes_per[1] ? u[3 * SbSpaceCellNode(s, c, 4 + q / 3) + k] -
                                            0.5 * (cell->u[v[0]][k] + cell->u[v[1]][k])
                                        : 0.;
  }
  e->ops.tabulate((const PetscReal(*)[3])cell->x, cell->g + 1, &cell->V);
  for (int k = 0; k < 9; k++) {
    cell->H[k] = 0.;
    for (int a = 0; a < 3; a++)
      cell->H[k] += (u[3 * node[a + 1] + k / 3] - u[3 * node[0] + k / 3]) * cell->g[a + 1][k % 3];
  }
  for (int k = 0; k < 3; k++)
    cell->g[0][k] = -(cell->g[1][k] + cell->g[2][k] + cell->g[3][k]);
}

/* Value and gradient of that function at barycentric coordinates b. */
static inline void verify_cell_at(const VerifyCell *cell, const PetscReal b[4], PetscReal u[3],
                                  PetscReal H[9])
{
  for (int k = 0; k < 3; k++) {
    u[k] = 0.;
    for (int v = 0; v < 4; v++)
      u[k] += b[v] * cell->u[v][k];
    for (int q = 0; q < 6; q++)
      u[k] += 4. * b[SbTetEdge[q][0]] * b[SbTetEdge[q][1]] * cell->e[q][k];
  }
  for (int k = 0; k < 9; k++) {
    H[k] = cell->H[k];
    for (int q = 0; q < 6; q++) {
      const int i = SbTetEdge[q][0];
      const int j = SbTetEdge[q][1];

      H[k] += 4. * cell->e[q][k / 3] * (b[j] * cell->g[i][k % 3] + b[i] * cell->g[j][k % 3]);
    }
  }
}

/* Value at the vertex nearest to a rest position: mean over the adjacent cells, on every rank.
   Collective. */
static inline PetscErrorCode verify_value_at(SbModel m, Vec U, const PetscReal at[3],
                                             PetscReal value[3])
{
  SbSpace s = m->space;
  const PetscReal *u;
  PetscReal nearest = PETSC_MAX_REAL;
  PetscReal sum[4] = {0., 0., 0., 0.};

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  for (int pass = 0; pass < 2; pass++) {
    for (PetscInt i = 0; i < 4 * s->mesh->ncell_owned; i++) {
      const PetscReal *x = s->mesh->x + 3 * s->mesh->cell[i];
      const PetscReal d = PetscSqr(x[0] - at[0]) + PetscSqr(x[1] - at[1]) + PetscSqr(x[2] - at[2]);
      VerifyCell cell;

      if (!pass)
        nearest = PetscMin(nearest, d);
      if (!pass || d > nearest)
        continue;
      verify_cell(s, u, i / 4, &cell);
      for (int k = 0; k < 3; k++)
        sum[k] += cell.u[i % 4][k];
      sum[3] += 1.;
    }
    if (!pass)
      PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nearest, 1, MPIU_REAL, MPI_MIN, m->comm));
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 4, MPIU_REAL, MPI_SUM, m->comm));
  for (int k = 0; k < 3; k++)
    value[k] = sum[k] / sum[3];
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  PetscRandom random;
  PetscReal size[3]; /* of the box, m */
} VerifyBox;

/* Random displacement of interior vertices by up to 0.2 cells. */
static inline void verify_move_vertex(const VerifyPlace *place, PetscReal x[3])
{
  const VerifyBox *box = (const VerifyBox *)place->ctx;
  PetscBool inner = PETSC_TRUE;

  for (int k = 0; k < 3; k++)
    inner = (PetscBool)(inner && place->at[k] > 0 && place->at[k] < place->n[k]);
  for (int k = 0; k < 3; k++) {
    PetscReal r = 0.5;

    if (inner)
      (void)PetscRandomGetValueReal(box->random, &r);
    x[k] = (x[k] + (0.4 * r - 0.2) / (PetscReal)place->n[k]) * box->size[k];
  }
}

/* Writes such a box to a file; the same for equal n on any number of ranks. Collective. */
static inline PetscErrorCode verify_distorted_box(const PetscInt n[3], const PetscReal size[3],
                                                  char path[512])
{
  VerifyBox box = {NULL, {size[0], size[1], size[2]}};

  PetscFunctionBeginUser;
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &box.random));
  PetscCall(PetscRandomSetSeed(box.random, 8));
  PetscCall(PetscRandomSeed(box.random));
  PetscCall(verify_mesh_write(n, verify_move_vertex, &box, path));
  PetscCall(PetscRandomDestroy(&box.random));
  PetscFunctionReturn(PETSC_SUCCESS);
}
