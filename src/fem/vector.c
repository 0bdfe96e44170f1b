/*
  Vectors of a space: the storage of a ghosted vector is the local array of the kernels, owned nodes
  first. Reading updates the ghosts; writing does not communicate. On one rank vectors are plain
  sequential ones.

  Prescribed unknowns stay in the system, so that the block size is three everywhere: their rows are
  u = prescribed (see tangent.c for the matrix). The initial guess of every solve has the prescribed
  values, so that their residual is zero and their effect on free unknowns is in the right-hand
  side.
*/
#include "fem_impl.h"

PetscErrorCode SbSpaceCreateVec(SbSpace s, Vec *v)
{
  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(s->template_vec, v));
  PetscCall(VecZeroEntries(*v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceViewDisplacement(SbSpace s, Vec U)
{
  Vec X;

  PetscFunctionBeginUser;
  if (!s->view_displacement)
    PetscFunctionReturn(PETSC_SUCCESS);

  // a vector of the DM: PETSc's viewers take the mesh from it, newer ones its (empty) DS as well
  PetscCall(DMCreateDS(s->dm));
  PetscCall(DMCreateGlobalVector(s->dm, &X));
  PetscCall(PetscObjectSetName((PetscObject)X, "displacement"));
  PetscCall(VecCopy(U, X));
  PetscCall(VecViewFromOptions(X, NULL, "-displacement_view"));
  PetscCall(VecDestroy(&X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The storage of a ghosted vector continues after its owned entries. */
PetscErrorCode SbSpaceGetLocalRead(SbSpace s, Vec v, const PetscReal **array)
{
  PetscFunctionBeginUser;
  if (s->ghosted) {
    PetscCall(VecGhostUpdateBegin(v, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecGhostUpdateEnd(v, INSERT_VALUES, SCATTER_FORWARD));
  }
  PetscCall(VecGetArrayRead(v, array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceGetLocalWrite(SbSpace s, Vec v, PetscReal **array)
{
  PetscFunctionBeginUser;
  if (s->ghosted) {
    Vec local = NULL;

    PetscCall(VecGhostGetLocalForm(v, &local));
    PetscCheck(local, s->comm, PETSC_ERR_ARG_WRONG,
               "The vector has no ghost entries: make it by SbSpaceCreateVec()");
    PetscCall(VecGhostRestoreLocalForm(v, &local));
  }
  PetscCall(VecGetArray(v, array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceUpdateGhosts(SbSpace s, PetscReal x[])
{
  PetscFunctionBeginUser;
  if (!s->ghosted)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecPlaceArray(s->template_vec, x));
  PetscCall(VecGhostUpdateBegin(s->template_vec, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGhostUpdateEnd(s->template_vec, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecResetArray(s->template_vec));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpacePrescribe(SbSpace s, PetscInt node, int components)
{
  PetscFunctionBeginUser;
  PetscCheck(!s->fixed_node, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "Unknowns can be prescribed during set-up only");
  s->fixed[node] |= (uint8_t)(components & 7);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceZeroPrescribed(SbSpace s, PetscBool prescribed, Vec X)
{
  PetscScalar *x;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(X, &x));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    for (int k = 0; k < 3; k++)
      if (prescribed == ((s->fixed[i] >> k) & 1))
        x[3 * i + k] = 0.;
  }
  PetscCall(VecRestoreArray(X, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceVertexPositions(SbSpace s, Vec U, PetscReal x[])
{
  const SbMesh mesh = s->mesh;
  PetscReal *weight;
  const PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(mesh->nvert, &weight));
  PetscCall(PetscArrayzero(x, 3 * mesh->nvert));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  for (PetscInt b = 0; b < s->nbatch; b++) {
    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      const PetscInt c = s->batch_cell[b] + l;
      const PetscInt *node = s->cell_node + 4 * c;
      const SbElement e = SbSpaceCellElement(s, c);

      for (int v = 0; v < 4; v++) {
        const PetscInt vertex = mesh->cell[4 * c + v];

        // the displacement of a node at the vertex, else the volume-weighted mean of the cells
        // around
        weight[vertex] = e->nodes_per[0] ? 1. : weight[vertex] + s->batch_V[b][l];
        for (int k = 0; e->nodes_per[0] && k < 3; k++)
          x[3 * vertex + k] = u[3 * node[v] + k];
        for (int i = 0; !e->nodes_per[0] && i < 12; i++)
          x[3 * vertex + i % 3] +=
            s->batch_V[b][l] * SbSpaceCornerBasis(s, c, v)[i / 3] * u[3 * node[i / 3] + i % 3];
      }
    }
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  for (PetscInt i = 0; i < 3 * mesh->nvert; i++)
    x[i] = mesh->x[i] + (weight[i / 3] > 0. ? x[i] / weight[i / 3] : 0.);
  PetscCall(PetscFree(weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}
