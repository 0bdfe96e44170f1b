// The DMPLEX of a mesh: PETSc's own checks, its cells, vertices, sides and labels against the
// arrays. @ranks 1 2 3 7
#include <petscdmplex.h>
#include "../../src/mesh/mesh_impl.h"
#include "mesh_test.h"

enum {
  NSET = 4
};

/* Two boxes and sets, one of which has the name of a label, and one that which it gets instead. */
static PetscErrorCode create(PetscBool sides, SbBody body[2], SbSet set[NSET], SbMesh *mesh)
{
  static const char *const names[NSET][2] = {{"set_body", "plane:0,0,1,0"},
                                             {"body", "body:b"},
                                             {"corner", "box:-1,-1,-1,0.01,0.01,0.01"},
                                             {"hull", "boundary"}};

  PetscFunctionBeginUser;
  body[0] = test_body("a", "box:2,1,1:2");
  body[1] = test_body("b", "box:1,1,1:1");
  body[1].translate[0] = 3;
  body[0].other_nodes = sides;
  PetscCall(PetscMemzero(set, NSET * sizeof(*set)));
  for (int k = 0; k < NSET; k++) {
    PetscCall(PetscStrncpy(set[k].name, names[k][0], sizeof(set[k].name)));
    PetscCall(SbSetParse("-set", names[k][1], &set[k]));
  }
  PetscCall(SbMeshCreate(PETSC_COMM_WORLD, 2, body, NSET, set, mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Owned points of a depth, over all ranks. */
static PetscErrorCode count_owned(DM dm, PetscInt depth, PetscInt *n)
{
  PetscInt first, last, nroot, nleaf;
  const PetscInt *leaf;
  PetscSF sf;

  PetscFunctionBeginUser;
  PetscCall(DMPlexGetDepthStratum(dm, depth, &first, &last));
  *n = PetscMax(0, last - first);
  PetscCall(DMGetPointSF(dm, &sf));
  PetscCall(PetscSFGetGraph(sf, &nroot, &nleaf, &leaf, NULL));
  for (PetscInt i = 0; nroot >= 0 && i < nleaf; i++) {
    const PetscInt p = leaf ? leaf[i] : i;

    *n -= p >= first && p < last;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, n, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells: their vertices by PETSc's closure, their volumes by PETSc's geometry. */
static PetscErrorCode test_cells(SbMesh mesh)
{
  DM dm = mesh->dm;
  PetscInt first, last;

  PetscFunctionBeginUser;
  PetscCall(DMPlexGetHeightStratum(dm, 0, &first, &last));
  SB_CHECK(!mesh->ncell || (first == 0 && last == mesh->ncell), "cells %d to %d", (int)first,
           (int)last);
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    PetscInt *closure = NULL;
    PetscInt n, found[4];
    PetscInt nfound = 0;
    PetscReal v0[3], J[9], inverse[9], det; /* of the map from a tet of volume 4/3 */

    PetscCall(DMPlexGetTransitiveClosure(dm, c, PETSC_TRUE, &n, &closure));
    for (PetscInt i = 0; i < n; i++) {
      const PetscInt v = closure[2 * i] - mesh->ncell;

      if (v >= 0 && v < mesh->nvert && nfound < 4)
        found[nfound++] = v;
    }
    PetscCall(DMPlexRestoreTransitiveClosure(dm, c, PETSC_TRUE, &n, &closure));
    SB_CHECK(nfound == 4, "%d vertices of cell %d", (int)nfound, (int)c);
    for (int a = 0; a < 4; a++) {
      PetscBool has = PETSC_FALSE;

      for (int b = 0; b < 4; b++)
        has = (PetscBool)(has || found[b] == mesh->cell[4 * c + a]);
      SB_CHECK(has, "cell %d lacks its vertex %d", (int)c, a);
    }
    PetscCall(DMPlexComputeCellGeometryFEM(dm, c, NULL, v0, J, inverse, &det));
    SB_CHECK_NEAR(4. / 3. * det, SbTetDeterminant(mesh->x, mesh->cell + 4 * c) / 6., 1e-14,
                  "volume");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A number per owned point comes to its copies by the point star forest: coordinates of the centres
   of the sides, from the cones. */
static PetscErrorCode test_forest(SbMesh mesh)
{
  PetscInt npoint, nroot;
  PetscReal *own, *got;
  PetscSF sf;

  PetscFunctionBeginUser;
  PetscCall(DMPlexGetChart(mesh->dm, NULL, &npoint));
  PetscCall(DMGetPointSF(mesh->dm, &sf));
  PetscCall(PetscSFGetGraph(sf, &nroot, NULL, NULL, NULL));
  PetscCall(PetscCalloc2(3 * npoint, &own, 3 * npoint, &got));
  for (PetscInt p = 0; p < npoint; p++) {
    PetscInt *closure = NULL;
    PetscInt n;
    PetscInt nvert = 0;

    PetscCall(DMPlexGetTransitiveClosure(mesh->dm, p, PETSC_TRUE, &n, &closure));
    for (PetscInt i = 0; i < n; i++) {
      const PetscInt v = closure[2 * i] - mesh->ncell;

      if (v < 0 || v >= mesh->nvert)
        continue;
      nvert++;
      for (int k = 0; k < 3; k++)
        own[3 * p + k] += mesh->x[3 * v + k];
    }
    PetscCall(DMPlexRestoreTransitiveClosure(mesh->dm, p, PETSC_TRUE, &n, &closure));
    for (int k = 0; k < 3; k++)
      own[3 * p + k] /= PetscMax(1, nvert);
  }
  PetscCall(PetscArraycpy(got, own, 3 * npoint));
  if (nroot >= 0)
    PetscCall(SbForestBroadcast(sf, 3, MPIU_REAL, own, got));
  for (PetscInt i = 0; i < 3 * npoint; i++)
    SB_CHECK(PetscAbsReal(own[i] - got[i]) < 1e-14, "point %d is elsewhere at its owner",
             (int)(i / 3));
  PetscCall(PetscFree2(own, got));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vertices, cells and, where they are points, faces in a label as in the arrays. */
static PetscErrorCode test_labels(SbMesh mesh)
{
  static const char *const labels[NSET] = {"set_body", "set1_body", "corner", "hull"};
  DMLabel label;
  PetscInt value;

  PetscFunctionBeginUser;
  for (int k = 0; k < NSET; k++) {
    PetscCall(DMGetLabel(mesh->dm, labels[k], &label));
    SB_CHECK(label != NULL, "there is a label %s", labels[k]);
    if (!label)
      continue;
    for (PetscInt c = 0; c < mesh->ncell; c++) {
      PetscCall(DMLabelGetValue(label, c, &value));
      SB_CHECK((value == 1) == !!(mesh->cell_set[c] & SB_SET_BIT(k)), "%s: cell %d", labels[k],
               (int)c);
      for (int f = 0; mesh->face_point && f < 4; f++) {
        PetscCall(DMLabelGetValue(label, mesh->face_point[4 * c + f], &value));
        SB_CHECK((value == 1) == !!(mesh->face_set[4 * c + f] & SB_SET_BIT(k)),
                 "%s: face %d of cell %d", labels[k], f, (int)c);
      }
    }
    for (PetscInt v = 0; v < mesh->nvert; v++) {
      PetscCall(DMLabelGetValue(label, mesh->ncell + v, &value));
      SB_CHECK((value == 1) == !!(mesh->vert_set[v] & SB_SET_BIT(k)), "%s: vertex %d", labels[k],
               (int)v);
    }
  }
  PetscCall(DMGetLabel(mesh->dm, "body", &label));
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    PetscCall(DMLabelGetValue(label, c, &value));
    SB_CHECK(value == mesh->cell_body[c], "body of cell %d", (int)c);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_plex(PetscBool sides)
{
  SbBody body[2];
  SbSet set[NSET];
  SbMesh mesh;
  PetscInt n[4] = {0, 0, 0, 0};

  PetscFunctionBeginUser;
  PetscCall(create(sides, body, set, &mesh));
  PetscCall(SbMeshValidate(mesh)); /* with DMPlexCheck() */
  for (PetscInt d = 0; d < (sides ? 4 : 2); d++)
    PetscCall(count_owned(mesh->dm, d, &n[d]));
  SB_CHECK(n[0] == mesh->Nvert, "%d vertices of %d", (int)n[0], (int)mesh->Nvert);
  SB_CHECK(n[sides ? 3 : 1] == mesh->Ncell, "%d cells of %d", (int)n[sides ? 3 : 1],
           (int)mesh->Ncell);

  // Euler's formula for two balls
  SB_CHECK(!sides || n[0] - n[1] + n[2] - n[3] == 2, "%d - %d + %d - %d is not 2", (int)n[0],
           (int)n[1], (int)n[2], (int)n[3]);
  PetscCall(test_cells(mesh));
  PetscCall(test_forest(mesh));
  PetscCall(test_labels(mesh));
  PetscCall(SbMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Types of PETSc cut the mesh, too, whatever is on which rank then; and what is no type is an
   error. */
static PetscErrorCode test_types(void)
{
  static const char *const types[] = {"simple", "gather", "ptscotch"};
  SbBody body[2];
  SbSet set[NSET];
  SbMesh mesh;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(types); i++) {
    PetscBool has = PETSC_TRUE;

    if (!strcmp(types[i], "ptscotch"))
      PetscCall(SbHasPackage(types[i], &has));
    if (!has)
      continue;
    PetscCall(PetscOptionsSetValue(NULL, "-petscpartitioner_type", types[i]));
    PetscCall(create(PETSC_TRUE, body, set, &mesh));
    PetscCall(SbMeshValidate(mesh));
    SB_CHECK(strcmp(types[i], "gather") || mesh->ncell_owned == (test_rank ? 0 : mesh->Ncell),
             "%s: %d cells here", types[i], (int)mesh->ncell_owned);
    PetscCall(SbMeshDestroy(&mesh));
  }
  PetscCall(PetscOptionsSetValue(NULL, "-petscpartitioner_type", "metiss"));
  SB_CHECK_ERROR(create(PETSC_TRUE, body, set, &mesh), PETSC_ERR_USER_INPUT,
                 "-petscpartitioner_type|metis");

  // shell needs random parts
  PetscCall(PetscOptionsSetValue(NULL, "-petscpartitioner_type", "shell"));
  SB_CHECK_ERROR(create(PETSC_TRUE, body, set, &mesh), PETSC_ERR_USER_INPUT,
                 "shell|-petscpartitioner_shell_random");
  PetscCall(PetscOptionsSetValue(NULL, "-petscpartitioner_shell_random", "1"));
  PetscCall(create(PETSC_TRUE, body, set, &mesh));
  PetscCall(SbMeshValidate(mesh));
  PetscCall(SbMeshDestroy(&mesh));
  PetscCall(PetscOptionsClearValue(NULL, "-petscpartitioner_shell_random"));
  PetscCall(PetscOptionsClearValue(NULL, "-petscpartitioner_type"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbOptionsRegister("", "", PETSC_DECIDE, SbMeshRows));
  PetscCall(test_plex(PETSC_FALSE));
  PetscCall(test_plex(PETSC_TRUE));
  PetscCall(test_types());
  PetscCall(SbOptionsReset());
  SB_TEST_END();
}
