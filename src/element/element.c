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
#include "sbbase.h"

static const SbElementType *types[SB_ELEMENT_TYPES];
static PetscInt ntype;
char SbElementNames[SB_ELEMENT_TYPES * SB_NAME_MAX];

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

/* values of basis functions at the vertices, and the mass, of elements with nodes at vertices and
   at faces */
#define VERTEX_BASIS                                      \
  {                                                       \
    {1., 0., 0., 0.}, {0., 1., 0., 0.}, {0., 0., 1., 0.}, \
    {                                                     \
      0., 0., 0., 1.                                      \
    }                                                     \
  }
#define FACE_BASIS                                           \
  {                                                          \
    {-2., 1., 1., 1.}, {1., -2., 1., 1.}, {1., 1., -2., 1.}, \
    {                                                        \
      1., 1., 1., -2.                                        \
    }                                                        \
  }
#define FACE_OPS                                            \
  {                                                         \
    tabulate_face, 1. / 4, 2. / 5, -1. / 20, 0., FACE_BASIS \
  }
#define GAMMA1 0.6 /* chosen in docs/reports/locking.md */

static const SbElementType elements[] = {
  {.element = {.name = "p1",
               .nodes_per = {1, 0, 0, 0},
               .ops = {tabulate_vertex, 1. / 4, 1. / 10, 1. / 20, 0., VERTEX_BASIS}}},
  {.nrow = PETSC_STATIC_ARRAY_LENGTH(p2_rows),
   .row = p2_rows,
   .element = {.name = "p2",
               .nodes_per = {1, 1, 0, 0},
               .mean_volume = PETSC_TRUE,
               .ops = {tabulate_vertex, 1. / 36, 1. / 10, 1. / 20, 4. / 27, VERTEX_BASIS}}},
  {.nrow = 1,
   .row = face_rows + 1,
   .element = {.name = "cr", .nodes_per = {0, 0, 1, 0}, .gamma1 = GAMMA1, .ops = FACE_OPS}},
  {.nrow = PETSC_STATIC_ARRAY_LENGTH(face_rows),
   .row = face_rows,
   .element = {.name = "dg",
               .nodes_per = {0, 0, 0, 4},
               .gamma0 = 4.,
               .gamma1 = GAMMA1,
               .weak = PETSC_TRUE,
               .ops = FACE_OPS}},
};

PetscErrorCode SbElementRegister(const SbElementType *type)
{
  PetscInt i = 0;

  PetscFunctionBeginUser;

  // Repeated registration is allowed: SbOptionsReset() may have removed the options.
  while (i < ntype && types[i] != type)
    i++;
  PetscCheck(i < SB_ELEMENT_TYPES, PETSC_COMM_SELF, PETSC_ERR_PLIB, "No room for element %s",
             type->element.name);
  if (i == ntype) {
    SbAppend(sizeof(SbElementNames), SbElementNames, "%s%s", ntype ? "|" : "", type->element.name);
    types[ntype++] = type;
  }
  if (type->nrow)
    PetscCall(SbOptionsRegister("body", type->element.name, type->nrow, type->row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbElementRegisterAll(void)
{
  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(elements); i++)
    PetscCall(SbElementRegister(&elements[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt SbElementTypes(const char *names[SB_ELEMENT_TYPES])
{
  for (PetscInt i = 0; i < ntype; i++)
    names[i] = types[i]->element.name;
  return ntype;
}

const SbElementType *SbElementFind(const char *name)
{
  for (PetscInt i = 0; i < ntype; i++)
    if (!strcmp(types[i]->element.name, name))
      return types[i];
  return NULL;
}

PetscErrorCode SbElementCreate(const char *name, const SbScope *body, SbElement *element)
{
  const SbElementType *type = SbElementFind(name);
  int choice;
  SbScope scope;
  SbElement e;

  PetscFunctionBeginUser;
  if (!type) {
    const char *names[SB_ELEMENT_TYPES];
    char all[256];

    SbAdviseSorted(name, SbElementTypes(names), names, sizeof(all), all);
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "there is no element \"%s\": choose one of %s", name,
            all);
  }
  PetscCall(PetscNew(&e));
  *e = type->element;
  PetscCall(SbLogNamed("Elem", name, &e->event));
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

PetscErrorCode SbElementCreateRigid(SbElement *e)
{
  /* V is that of a cell; masses are those of points at the nodes */
  static const SbElementOps ops = {tabulate_vertex, 1. / 4, 1. / 4, 0., 0., VERTEX_BASIS};

  PetscFunctionBeginUser;
  PetscCall(PetscNew(e));
  PetscCall(PetscStrncpy((*e)->name, SB_ELEMENT_RIGID, sizeof((*e)->name)));
  (*e)->rigid = PETSC_TRUE;
  (*e)->ops = ops;
  PetscCall(SbLogNamed("Elem", SB_ELEMENT_RIGID, &(*e)->event));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbElementDestroy(SbElement *e)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(*e));
  PetscFunctionReturn(PETSC_SUCCESS);
}
