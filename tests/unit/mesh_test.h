/*
  mesh_test.h - what the tests of the mesh layer share: bodies and sets in one line, and the text of an error.
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

static inline PetscErrorCode test_keep_message(MPI_Comm comm, int line, const char *function,
                                               const char *file, PetscErrorCode code, PetscErrorType kind,
                                               const char *text, void *ctx)
{
  (void)comm, (void)line, (void)function, (void)file;
  if (kind == PETSC_ERROR_INITIAL) (void)snprintf((char *)ctx, 2048, "%s", text ? text : "");
  return code;
}

/* The call must fail with this code, and its message must hold these words. */
#define TEST_MESSAGE(call, expected_code, words)                                                            \
  do {                                                                                                      \
    char test_text[2048] = "";                                                                              \
    PetscErrorCode test_ierr;                                                                               \
    PetscCall(PetscPushErrorHandler(test_keep_message, test_text));                                         \
    test_ierr = call;                                                                                       \
    PetscCall(PetscPopErrorHandler());                                                                      \
    SB_CHECK(test_ierr == expected_code, "code %d instead of %d: '%s'", (int)test_ierr, (int)expected_code, \
             test_text);                                                                                    \
    SB_CHECK(strstr(test_text, words), "'%s' instead of '%s'", test_text, words);                           \
    SB_CHECK(!strchr(test_text, '\n'), "more than one line: '%s'", test_text);                              \
  } while (0)
