/*
  Elements with four nodes; creation of all by name. With e_a = x_a - x_0 and d = e_1 . (e_2 x e_3):

  P1 and P2 at vertices (P2: p2.c): grad phi_1 = e_2 x e_3 / d, and cyclic; V = d / 6;
    mass / (density V): consistent M_aa = 1/10, M_ab = 1/20; lumped (row sums) 1/4.

  Crouzeix-Raviart, and piecewise linear DG in the same basis, have their nodes at the centroids of
  the faces. With the barycentric coordinates l_a the basis is psi_a = 1 - 3 l_a, node a on the face
  opposite vertex a: one at the centroid of its face, zero at the three others. Hence

    grad psi_a = -3 grad l_a;   psi_a(vertex v) = 1 - 3 delta_av;
    mass / (density V): consistent M_aa = 2/5, M_ab = -1/20; lumped (row sums) 1/4.

  The mean of a function over a face is its value at the node there, so the mean jump is a
  difference of two nodes. (Crouzeix and Raviart 1973; Hansbo and Larson 2003.)
*/
#include <sbelement.h>
#include "sblog.h"

PetscFunctionList SbElementList = NULL;

/* of DG; CR has the second one */
static const SbOption face_rows[] = {
  {"gamma0", SB_OPTION_REAL, 1, "", "4", "(0, inf)",
   "penalty factor on the mean of the jump over a face"},
  {"gamma1", SB_OPTION_REAL, 1, "", "0.6", "(0, inf)",
   "penalty factor on the full jump across faces; smaller values are softer, much larger ones "
   "lock"},
  {"dirichlet", SB_OPTION_CHOICE, 1, "", "weak", "weak|strong",
   "boundary faces that are fixed in all directions: weak, by a penalty, or strong, by their mean "
   "displacement"},
};
static const SbOption p2_rows[] = {
  {"volume", SB_OPTION_CHOICE, 1, "", "mean", "mean|pointwise",
   "volumetric energy: of the mean dilatation of a tet (P2/P0), or fully integrated, which locks "
   "when "
   "poisson is near 0.5"},
};

static PetscErrorCode destroy_list(void)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFunctionListDestroy(&SbElementList));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void tabulate_vertex(const PetscReal x[4][3], PetscReal g[3][3], PetscReal *V)
{
  PetscReal e[3][3];

  for (int a = 0; a < 3; a++)
    SbSubtract(x[a + 1], x[0], e[a]);
  for (int a = 0; a < 3; a++)
    SbCross(e[(a + 1) % 3], e[(a + 2) % 3], g[a]);
  const PetscReal d = SbDot3(e[0], g[0]);
  for (int a = 0; a < 3; a++)
    for (int i = 0; i < 3; i++)
      g[a][i] /= d;
  *V = d / 6;
}

static void tabulate_face(const PetscReal x[4][3], PetscReal g[3][3], PetscReal *V)
{
  tabulate_vertex(x, g, V);
  for (int a = 0; a < 3; a++)
    for (int i = 0; i < 3; i++)
      g[a][i] *= -3.;
}

static PetscErrorCode create_p1(SbElement e)
{
  PetscFunctionBeginUser;
  e->nodes_per[0] = 1;
  e->ops = (SbElementOps){tabulate_vertex, 1. / 4, 1. / 10, 1. / 20, 0., {{0.}}};
  for (int a = 0; a < 4; a++)
    e->ops.vertex[a][a] = 1.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create_p2(SbElement e)
{
  PetscFunctionBeginUser;
  PetscCall(create_p1(e));
  e->nodes_per[1] = 1;
  e->mean_volume = PETSC_TRUE;
  e->ops.mass_lumped = 1. / 36;
  e->ops.mass_lumped_edge = 4. / 27;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create_cr(SbElement e)
{
  PetscFunctionBeginUser;
  e->nodes_per[2] = 1;
  e->gamma1 = 0.6; /* chosen in docs/reports/locking.md */
  e->ops = (SbElementOps){tabulate_face, 1. / 4, 2. / 5, -1. / 20, 0., {{0.}}};
  for (int k = 0; k < 16; k++)
    e->ops.vertex[k / 4][k % 4] = k / 4 == k % 4 ? -2. : 1.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create_dg(SbElement e)
{
  PetscFunctionBeginUser;
  PetscCall(create_cr(e));
  e->nodes_per[2] = 0;
  e->nodes_per[3] = 4;
  e->gamma0 = 4.;
  e->weak = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbElementRegister(const char *name, PetscErrorCode (*create)(SbElement),
                                 PetscInt nrows, const SbOption rows[])
{
  PetscFunctionBeginUser;
  if (!SbElementList)
    PetscCall(PetscRegisterFinalize(destroy_list));
  PetscCall(PetscFunctionListAdd(&SbElementList, name, create));
  if (nrows)
    PetscCall(SbOptionsRegister("body", name, nrows, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbElementRegisterAll(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbElementRegister("p1", create_p1, 0, NULL));
  PetscCall(SbElementRegister("p2", create_p2, PETSC_STATIC_ARRAY_LENGTH(p2_rows), p2_rows));
  PetscCall(SbElementRegister("cr", create_cr, 1, face_rows + 1));
  PetscCall(SbElementRegister("dg", create_dg, PETSC_STATIC_ARRAY_LENGTH(face_rows), face_rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbElementCreate(const char *name, const SbScope *body, SbElement *element)
{
  PetscErrorCode (*create)(SbElement) = NULL;
  int choice;
  SbScope scope;
  SbElement e;

  PetscFunctionBeginUser;
  PetscCall(PetscFunctionListFind(SbElementList, name, &create));
  if (!create) {
    char all[256];

    PetscCall(SbListAdvise(SbElementList, name, sizeof(all), all));
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "there is no element \"%s\": choose one of %s", name,
            all);
  }
  PetscCall(PetscNew(&e));
  PetscCall(PetscStrncpy(e->name, name, sizeof(e->name)));
  PetscCall(SbLogNamed("Elem", name, &e->event));
  PetscCall((*create)(e));
  *element = e;
  if (!body)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbScopeSet(&scope, "body", e->name, body->instance);
  if (e->gamma0 > 0.)
    PetscCall(SbOptionReal(&scope, "gamma0", &e->gamma0));
  if (e->gamma1 > 0.)
    PetscCall(SbOptionReal(&scope, "gamma1", &e->gamma1));
  if (e->mean_volume) {
    PetscCall(SbOptionChoice(&scope, "volume", &choice));
    e->mean_volume = (PetscBool)!choice;
  }
  if (e->weak) {
    PetscCall(SbOptionChoice(&scope, "dirichlet", &choice));
    e->weak = (PetscBool)!choice;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbElementDestroy(SbElement *e)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(*e));
  PetscFunctionReturn(PETSC_SUCCESS);
}
