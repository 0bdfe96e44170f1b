/*
  validate.c - checks of the guarantees of SbMesh: index ranges, order, ownership, sums over the
  ranks.

  Every cell with an owned vertex is local if and only if the number of pairs (owned vertex, local
  cell that has it), summed over all ranks, is four times the global number of cells. Original
  numbers are a permutation if each occurs once; this is checked by the sums of the numbers and of
  their hashes.
*/
#include <petscdmplex.h>
#include "mesh_impl.h"

#define CHECK(cond, ...) PetscCheck(cond, PETSC_COMM_SELF, PETSC_ERR_PLIB, __VA_ARGS__)

static PetscInt lowest(const PetscInt v[4])
{
  return PetscMin(PetscMin(v[0], v[1]), PetscMin(v[2], v[3]));
}

/* Checks of global sums, equal on all ranks. */
static PetscErrorCode check_sums(SbMesh m)
{
  enum {
    VERT,
    CELL,
    PAIR,
    VERT_MIX,
    CELL_MIX,
    FACET,
    NSUM
  };
  uint64_t mine[NSUM] = {0};
  uint64_t all[NSUM];
  uint64_t expected[NSUM] = {0};
  PetscReal volume = 0;
  PetscReal volumes = 0;
  PetscReal rest = 0;

  PetscFunctionBeginUser;

  // sums over owned vertices and cells
  mine[VERT] = (uint64_t)m->nvert_owned;
  mine[CELL] = (uint64_t)m->ncell_owned;
  for (PetscInt v = 0; v < m->nvert_owned; v++)
    mine[VERT_MIX] += SbMix(m->vert_orig[v]);
  for (PetscInt c = 0; c < m->ncell; c++) {
    for (int a = 0; a < 4; a++)
      mine[PAIR] += m->cell[4 * c + a] < m->nvert_owned;
    if (c >= m->ncell_owned)
      continue;
    mine[CELL_MIX] += SbMix(m->cell_orig[c]);
    for (int f = 0; f < 4; f++)
      mine[FACET] += m->face_set[4 * c + f] & SB_ON_BOUNDARY;
    volume += m->cell_set[c] & SB_CURVED
                ? SbTetCurvedVolume(m->x, m->cell + 4 * c, m->edge_off + 18 * c)
                : SbTetDeterminant(m->x, m->cell + 4 * c) / 6;
  }
  PetscCallMPI(MPI_Allreduce(mine, all, NSUM, MPI_UINT64_T, MPI_SUM, m->comm));
  PetscCallMPI(MPI_Allreduce(&volume, &volumes, 1, MPIU_REAL, MPI_SUM, m->comm));

  // expected: each vertex and cell once
  expected[VERT] = (uint64_t)m->Nvert;
  expected[CELL] = (uint64_t)m->Ncell;
  expected[PAIR] = 4 * (uint64_t)m->Ncell;
  for (PetscInt v = 0; v < m->Nvert; v++)
    expected[VERT_MIX] += SbMix(v);
  for (PetscInt c = 0; c < m->Ncell; c++)
    expected[CELL_MIX] += SbMix(c);
  for (PetscInt b = 0; b < m->nbody; b++) {
    expected[FACET] += (uint64_t)m->body[b].nfacet;
    rest += m->body[b].volume;
  }

  // comparison; volumes up to rounding
  for (int i = 0; i < NSUM; i++) {
    static const char *const what[NSUM] = {
      "owned vertices",          "owned cells",           "cells around owned vertices",
      "original vertex numbers", "original cell numbers", "boundary facets"};

    PetscCheck(all[i] == expected[i], m->comm, PETSC_ERR_PLIB, "Sum of %s is %llu, expected %llu",
               what[i], (unsigned long long)all[i], (unsigned long long)expected[i]);
  }
  PetscCheck(PetscAbsReal(volumes - rest) <= 1e-10 * rest, m->comm, PETSC_ERR_PLIB,
             "Volume %g, expected %g", (double)volumes, (double)rest);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeshValidate(SbMesh mesh)
{
  PetscReal *x;
  PetscInt *orig;
  PetscBool all;

  PetscFunctionBeginUser;
  CHECK(0 <= mesh->nvert_owned && mesh->nvert_owned <= mesh->nvert && mesh->nvert <= mesh->Nvert,
        "Bad numbers of vertices");
  for (PetscInt v = 0; v < mesh->nvert; v++) {
    const PetscInt body = mesh->vert_body[v];

    if (v < mesh->nvert_owned)
      CHECK(mesh->gvert[v] == mesh->gvert_start + v,
            "Owned vertex %" PetscInt_FMT " has global number %" PetscInt_FMT, v, mesh->gvert[v]);
    else {
      CHECK(mesh->gvert[v] < mesh->gvert_start ||
              mesh->gvert[v] >= mesh->gvert_start + mesh->nvert_owned,
            "Ghost vertex %" PetscInt_FMT " has an owned number", v);
      CHECK(v == mesh->nvert_owned || mesh->gvert[v] > mesh->gvert[v - 1],
            "Ghost vertices are not ascending at %" PetscInt_FMT, v);
    }
    CHECK(0 <= mesh->gvert[v] && mesh->gvert[v] < mesh->Nvert,
          "Global vertex number %" PetscInt_FMT " out of range", mesh->gvert[v]);
    CHECK(0 <= mesh->vert_orig[v] && mesh->vert_orig[v] < mesh->Nvert,
          "Original vertex number %" PetscInt_FMT " out of range", mesh->vert_orig[v]);
    CHECK(0 <= body && body < mesh->nbody, "Vertex %" PetscInt_FMT " in body %" PetscInt_FMT, v,
          body);
    CHECK(!(mesh->vert_set[v] & SB_ON_BOUNDARY),
          "Vertex %" PetscInt_FMT " carries the bit of faces", v);
    for (int i = 0; i < 3; i++)
      CHECK(mesh->body[body].bbox[i] <= mesh->x[3 * v + i] &&
              mesh->x[3 * v + i] <= mesh->body[body].bbox[3 + i],
            "Vertex %" PetscInt_FMT " outside its body", v);
  }
  all = PETSC_FALSE;
  for (PetscInt b = 0; b < mesh->nbody; b++)
    all = (PetscBool)(all || mesh->body[b].other_nodes);
  CHECK(0 <= mesh->ncell_owned && mesh->ncell_owned <= mesh->ncell && mesh->ncell <= mesh->Ncell,
        "Bad numbers of cells");
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    const PetscInt *v = mesh->cell + 4 * c;

    for (int a = 0; a < 4; a++) {
      CHECK(0 <= v[a] && v[a] < mesh->nvert, "Cell %" PetscInt_FMT " has vertex %" PetscInt_FMT, c,
            v[a]);
      CHECK(mesh->vert_body[v[a]] == mesh->cell_body[c],
            "Cell %" PetscInt_FMT " and its vertex %" PetscInt_FMT " are in different bodies", c,
            v[a]);
    }
    CHECK(SbTetDeterminant(mesh->x, v) > 0, "Cell %" PetscInt_FMT " is not positively oriented", c);
    CHECK(0 <= mesh->cell_orig[c] && mesh->cell_orig[c] < mesh->Ncell,
          "Original cell number %" PetscInt_FMT " out of range", mesh->cell_orig[c]);
    if (c >= mesh->ncell_owned && !all)
      CHECK(lowest(v) < mesh->nvert_owned, "Ghost cell %" PetscInt_FMT " touches no owned vertex",
            c);
    if (c == 0 || c == mesh->ncell_owned)
      continue;
    CHECK(mesh->cell_body[c - 1] < mesh->cell_body[c] ||
            (mesh->cell_body[c - 1] == mesh->cell_body[c] &&
             (mesh->cell_material[c - 1] != mesh->cell_material[c] ||
              (mesh->cell_set[c - 1] & SB_CURVED) < (mesh->cell_set[c] & SB_CURVED) ||
              lowest(v - 4) <= lowest(v))),
          "Cells are out of order at %" PetscInt_FMT, c);
  }
  PetscCall(check_sums(mesh));
  PetscCall(DMPlexCheck(mesh->dm));

  // ghost vertices have the data of their owners
  PetscCall(PetscMalloc2(3 * (size_t)mesh->nvert, &x, mesh->nvert, &orig));
  PetscCall(PetscArraycpy(x, mesh->x, 3 * (size_t)mesh->nvert_owned));
  PetscCall(PetscArraycpy(orig, mesh->vert_orig, mesh->nvert_owned));
  PetscCall(SbForestBroadcast(mesh->vert_sf, 3, MPIU_REAL, x, x));
  PetscCall(SbForestBroadcast(mesh->vert_sf, 1, MPIU_INT, orig, orig));
  for (PetscInt v = 0; v < mesh->nvert; v++) {
    CHECK(orig[v] == mesh->vert_orig[v], "Ghost vertex %" PetscInt_FMT " differs from its owner's",
          v);
    for (int i = 0; i < 3; i++)
      CHECK(x[3 * v + i] == mesh->x[3 * v + i],
            "Ghost vertex %" PetscInt_FMT " lies elsewhere than its owner's", v);
  }
  PetscCall(PetscFree2(x, orig));
  PetscFunctionReturn(PETSC_SUCCESS);
}
