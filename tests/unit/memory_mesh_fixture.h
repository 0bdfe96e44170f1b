/*
  memory_mesh_fixture.h - a body of two tets in memory, with a triangle in a group and a tet in an
  inclusion that differs from its shape.
*/
#pragma once
#include "output_fixture.h"

#define GIVEN_STEP 3
#define GIVEN_MASS 7.25
#define GIVEN_BOUND (1. / 3.)
#define GIVEN_SIDE SB_SET_BIT(0)
#define GIVEN_CORE SB_SET_BIT(1)
/* the sphere holds no tet of the body in memory, and one corner of the box */
#define GIVEN_SCENE                                                                               \
  BOX                                                                                             \
    " -sets side,core -set_side_at group:xmin -set_core_at sphere:0.2,0.2,0.2,0.3 "               \
    "-body_a_inclusions "                                                                         \
    "core -inclusion_core_material linear -inclusion_core_young 1e4 -inclusion_core_poisson 0.3 " \
    "-inclusion_core_density 20 "

static const PetscReal given_x[5][3] = {
  {0., 0., 0.}, {1., 0., 0.}, {0., 1., 0.}, {0., 0., 1. / 3.}, {1., 1., 1.}};
static const PetscInt given_cell[2][4] = {{0, 1, 2, 3}, {1, 2, 3, 4}};

/* On rank 0; other ranks get one without arrays. */
static inline PetscErrorCode fixture_given(SbMemoryMesh **in_memory)
{
  static const PetscInt tri[3] = {0, 2, 3};
  PetscMPIInt rank;
  SbMemoryMesh *g;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(SbMemoryMeshCreate(rank ? 0 : 5, rank ? 0 : 2, rank ? 0 : 1, 0, in_memory));
  g = *in_memory;
  g->step = GIVEN_STEP;
  g->mass = GIVEN_MASS;
  g->bound = GIVEN_BOUND;
  if (rank)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArraycpy(g->x, &given_x[0][0], 15));
  PetscCall(PetscArraycpy(g->cell, &given_cell[0][0], 8));
  PetscCall(PetscArraycpy(g->tri, tri, 3));
  g->tri_set[0] = GIVEN_SIDE;
  for (int k = 0; k < 3; k++)
    g->vert_set[tri[k]] = GIVEN_SIDE;
  g->cell_set[1] = GIVEN_CORE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A scene on the mesh in memory (NULL: on that of a checkpoint, or its own), set up as the program
   does it. */
static inline PetscErrorCode fixture_open_given(const char *dir, const char *options,
                                                SbMemoryMesh *in_memory, TestScene *scene)
{
  PetscFunctionBeginUser;
  *scene = (TestScene){NULL, NULL, NULL, NULL};
  PetscCall(test_options(options));
  PetscCall(PetscOptionsSetValue(NULL, "-output_dir", dir));
  PetscCall(PetscOptionsSetValue(NULL, "-output_overwrite", "yes"));
  PetscCall(SbSceneCreate(PETSC_COMM_WORLD, &scene->model));
  PetscCall(test_scene_run(scene));
  PetscCall(SbOutputSetFromOptions(scene->run, ""));
  PetscCall(SbOptionsCheck());
  scene->model->body[0].in_memory = in_memory;
  if (!in_memory)
    PetscCall(SbOutputRestoreMeshes(scene->run));
  PetscCall(SbModelSetUp(scene->model));
  PetscCall(SbRunSetUp(scene->run));
  PetscCall(SbOutputAttach(scene->run));
  PetscCall(SbMeshValidate(scene->model->mesh));
  PetscCall(SbSpaceValidate(scene->model->space));
  PetscFunctionReturn(PETSC_SUCCESS);
}
