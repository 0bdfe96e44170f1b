/*
  mesh_test.h - what the tests of the mesh layer share: bodies and sets in one line.
*/
#pragma once
#include "../../src/meshio/meshio_impl.h"
#include "../../src/mesh/mesh_impl.h"
#include "../test.h"

/* A body of this name and mesh, neither scaled nor moved. */
static inline SbBody test_body(const char *name, const char *mesh)
{
  SbBody body;

  memset(&body, 0, sizeof(body));
  (void)snprintf(body.name, sizeof(body.name), "%s", name);
  (void)snprintf(body.mesh, sizeof(body.mesh), "%s", mesh);
  body.scale = 1;
  body.density = 1;
  return body;
}

static inline PetscErrorCode test_set(const char *name, const char *text, SbSet *set)
{
  PetscFunctionBeginUser;
  memset(set, 0, sizeof(*set));
  (void)snprintf(set->name, sizeof(set->name), "%s", name);
  PetscCall(SbSetParse("-set", text, set));
  PetscFunctionReturn(PETSC_SUCCESS);
}
