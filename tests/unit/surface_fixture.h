/*
  surface_fixture.h - surfaces for tests: the scene, the surface of a set of it, displacements that no partition changes.
*/
#pragma once
#include "../scene.h"
#include <sbdetect.h>

#define BODY(name, element, mesh, at)                                                               \
  " -body_" name "_mesh " mesh " -body_" name "_translate " at " -body_" name "_material corotated" \
  " -body_" name "_young 1e5 -body_" name "_poisson 0.3 -body_" name "_density 1000 -body_" name    \
  "_element " element
#define SETS " -sets skin,low -set_skin_at boundary -set_low_at plane:0,0,1,0 "
#define PAIR(first, second)                                       \
  SETS "-bodies a,b" BODY("a", first, "box:1,0.8,0.3:3", "0,0,0") \
    BODY("b", second, "box:0.6,0.5,0.4:2", "0.2,0.1,0.32")
/* Two bars, one across the other. */
#define CROSS(first, second)                                      \
  SETS "-bodies a,b" BODY("a", first, "box:1,0.3,0.3:3", "0,0,0") \
    BODY("b", second, "box:0.3,1,0.3:3", "0.35,-0.35,0.32")

/* A surface with displacements at the start of the step and now. */
typedef struct {
  SbModel m;
  SbContactSurface s;
  PetscReal *u0, *u; /* [nnode][3] */
} Case;

static inline PetscErrorCode open_on(MPI_Comm comm, const char *options, PetscInt set, Case *c)
{
  SbFacet *facet;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(SbOptionsReset());
  PetscCall(SbRegisterAll());
  PetscCall(PetscOptionsInsertString(NULL, options));
  PetscCall(SbSceneCreate(comm, &c->m));
  PetscCall(SbModelSetUp(c->m));
  PetscCall(SbSpaceGetSetFacets(c->m->space, set, &n, &facet));
  PetscCall(SbContactSurfaceCreate(c->m->space, n, facet, &c->s));
  PetscCall(PetscFree(facet));
  PetscCall(PetscCalloc2(3 * c->m->space->nnode, &c->u0, 3 * c->m->space->nnode, &c->u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode close_case(Case *c)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree2(c->u0, c->u));
  PetscCall(SbContactSurfaceDestroy(&c->s));
  PetscCall(SbModelDestroy(&c->m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A number in [-1, 1] that belongs to a node, not to a partition. */
static inline PetscReal noise(PetscInt id, int k, int seed)
{
  const PetscReal x = 43758.5453 * PetscSinReal(12.9898 * (PetscReal)id + 78.233 * k + 37.719 * seed);

  return 2 * (x - PetscFloorReal(x)) - 1;
}

/* Local displacements: noise, and bodies moved by lift times their number along z. */
static inline PetscErrorCode fill(const Case *c, int seed, PetscReal amplitude, PetscReal shift,
                                  PetscReal lift, PetscReal u[])
{
  const SbSpace s = c->m->space;
  const PetscReal *read;
  PetscReal *write;
  Vec U;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateVec(s, &U));
  PetscCall(SbSpaceGetLocalWrite(s, U, &write));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    for (int k = 0; k < 3; k++) write[3 * i + k] = amplitude * noise(s->node_orig[i], k, seed);
    write[3 * i] += shift * (PetscReal)s->node_body[i];
    write[3 * i + 2] += lift * (PetscReal)s->node_body[i];
  }
  PetscCall(SbSpaceRestoreLocalWrite(s, U, &write));
  PetscCall(SbSpaceGetLocalRead(s, U, &read));
  PetscCall(PetscArraycpy(u, read, 3 * s->nnode));
  PetscCall(SbSpaceRestoreLocalRead(s, U, &read));
  PetscCall(VecDestroy(&U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers of all ranks one after the other: n of this rank, *total in all. */
static inline PetscErrorCode gather_numbers(MPI_Comm comm, PetscInt n, const PetscReal mine[],
                                            PetscInt *total, PetscReal **all)
{
  PetscMPIInt size, *count, *start, own;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(PetscMalloc2(size, &count, size + 1, &start));
  PetscCall(PetscMPIIntCast(n, &own));
  PetscCallMPI(MPI_Allgather(&own, 1, MPI_INT, count, 1, MPI_INT, comm));
  start[0] = 0;
  for (PetscMPIInt r = 0; r < size; r++) start[r + 1] = start[r] + count[r];
  *total = start[size];
  PetscCall(PetscMalloc1(*total, all));
  PetscCallMPI(MPI_Allgatherv(mine, own, MPIU_REAL, *all, count, start, MPIU_REAL, comm));
  PetscCall(PetscFree2(count, start));
  PetscFunctionReturn(PETSC_SUCCESS);
}
