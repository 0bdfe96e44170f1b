/*
  show.c - what -show prints: where bodies, sets, effects and obstacles are when the run begins.

  Boxes are those of the vertices at the start, of all ranks. Effects are printed with the options
  that were given for them, obstacles with the distance to the nearest vertex of each body that
  touches them. Copies of a body are one line, with the box around them.
*/
#include <ctype.h>
#include "scene_impl.h"

#define ROUNDING 1e-9 /* of a box's diagonal: coordinates below it are 0 */

/* "(0, 0, 0) to (1, 1, 1), 1 x 1 x 1" */
static void box_text(const PetscReal found[6], size_t size, char text[])
{
  const PetscReal least = ROUNDING * SbBoxDiagonal(found);
  PetscReal box[6];

  for (int i = 0; i < 6; i++)
    box[i] = PetscAbsReal(found[i]) < least ? 0 : found[i];
  SbFormat(size, text, "(%.5g, %.5g, %.5g) to (%.5g, %.5g, %.5g), size %.4g x %.4g x %.4g",
           (double)box[0], (double)box[1], (double)box[2], (double)box[3], (double)box[4],
           (double)box[5], (double)(box[3] - box[0]), (double)(box[4] - box[1]),
           (double)(box[5] - box[2]));
}

/* Boxes of the bodies, box[nbody], and of the sets, box[nbody + nset], at x[nvert][3]. */
static PetscErrorCode find_boxes(SbMesh mesh, const PetscReal x[], PetscReal (*box)[6])
{
  const PetscInt n = mesh->nbody + mesh->nset;
  PetscMPIInt count;

  PetscFunctionBeginUser;

  // as least values: coordinates, then their negatives
  for (PetscInt i = 0; i < 6 * n; i++)
    box[i / 6][i % 6] = PETSC_MAX_REAL;
  for (PetscInt v = 0; v < mesh->nvert_owned; v++) {
    for (PetscInt k = 0; k <= mesh->nset; k++) {
      PetscReal *b = box[k < mesh->nset ? mesh->nbody + k : mesh->vert_body[v]];

      if (k < mesh->nset && !(mesh->vert_set[v] & SB_SET_BIT(k)))
        continue;
      for (int i = 0; i < 3; i++) {
        b[i] = PetscMin(b[i], x[3 * v + i]);
        b[3 + i] = PetscMin(b[3 + i], -x[3 * v + i]);
      }
    }
  }
  PetscCall(PetscMPIIntCast(6 * n, &count));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, box, count, MPIU_REAL, MPI_MIN, mesh->comm));
  for (PetscInt i = 0; i < 3 * n; i++)
    box[i / 3][3 + i % 3] *= -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode print_bodies(SbModel m, const PetscReal (*box)[6])
{
  char text[256], name[2 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(m->comm, "\nbodies, at the start (m)\n"));
  for (PetscInt b = 0; b < m->nbody; b++) {
    const SbBody *body = &m->body[b];
    PetscReal all[6];
    PetscInt n = 0;
    PetscBool first = PETSC_TRUE;

    // copies: one line, with that of the first
    PetscCall(PetscArraycpy(all, box[b], 6));
    for (PetscInt k = 0; k < m->nbody && body->copy_of[0]; k++) {
      if (strcmp(m->body[k].copy_of, body->copy_of) != 0)
        continue;
      first = (PetscBool)(first && k >= b);
      n++;
      SbBoxAdd(all, box[k]);
      SbBoxAdd(all, box[k] + 3);
    }
    if (!first)
      continue;
    SbFormat(sizeof(name), name, "%s", body->name);
    if (n > 1)
      SbFormat(sizeof(name), name, "%" PetscInt_FMT " x %s", n, body->copy_of);
    box_text(all, sizeof(text), text);
    PetscCall(PetscPrintf(m->comm, "  %-15s %s, %" PetscInt_FMT " tets%s\n", name, text,
                          body->ncell, n > 1 ? " each" : ""));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode print_sets(SbModel m, const PetscReal (*box)[6])
{
  PetscFunctionBeginUser;
  if (m->nset)
    PetscCall(PetscPrintf(m->comm, "\nsets: vertices, facets of the surface, tets\n"));
  for (PetscInt k = 0; k < m->nset; k++) {
    const SbSet *set = &m->set[k];
    char text[256];

    box_text(box[m->nbody + k], sizeof(text), text);
    PetscCall(PetscPrintf(m->comm,
                          "  %-15s %" PetscInt_FMT " vertices, %" PetscInt_FMT
                          " facets, %" PetscInt_FMT " tets%s%s\n",
                          set->name, set->nvert, set->nfacet, set->ncell,
                          set->nvert ? "; " : ": nothing is there", set->nvert ? text : ""));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The options that were given for an effect, as "key value, key value", from the text of all. */
static void given_options(SbModel m, const char *name, const char *options, size_t size,
                          char text[])
{
  char begin[SB_NAME_MAX + 16];

  SbFormat(sizeof(begin), begin, "-effect_%s_", name);
  text[0] = 0;
  for (const char *p = options; (p = strstr(p, begin)) != NULL;) {
    const char *key = p + strlen(begin);
    const char *end = key;
    PetscBool own = (PetscBool)(p == options || isspace((unsigned char)p[-1]));

    // an effect a_b has options that begin as those of a do
    for (PetscInt e = 0; e < m->neffect; e++) {
      char longer[SB_NAME_MAX + 16];

      SbFormat(sizeof(longer), longer, "-effect_%s_", m->effect[e]->name);
      if (strlen(longer) > strlen(begin) && !strncmp(p, longer, strlen(longer)))
        own = PETSC_FALSE;
    }

    // its value ends at the next option
    while (*end &&
           !(isspace((unsigned char)*end) && end[1] == '-' && isalpha((unsigned char)end[2])))
      end++;
    if (own && strncmp(key, "type ", 5) != 0 && strncmp(key, "on ", 3) != 0)
      SbAppend(size, text, "%s%.*s", text[0] ? ", " : "", (int)(end - key), key);
    p = key;
  }
  for (size_t n = strlen(text); n && isspace((unsigned char)text[n - 1]);)
    text[--n] = 0;
}

static PetscErrorCode print_effects(SbModel m)
{
  char *options, text[2048], on[2048];

  PetscFunctionBeginUser;
  if (!m->neffect)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscOptionsGetAll(NULL, &options));
  PetscCall(PetscPrintf(m->comm, "\neffects, and what was given for them\n"));
  for (PetscInt e = 0; e < m->neffect; e++) {
    const SbEffect effect = m->effect[e];

    given_options(m, effect->name, options, sizeof(text), text);
    on[0] = 0;
    for (PetscInt i = 0; i < effect->on.n; i++)
      SbAppend(sizeof(on), on, "%s%s", i ? "," : " on ", effect->on.name[i]);
    PetscCall(PetscPrintf(m->comm, "  %-15s %s%s%s%s\n", effect->name, effect->type, on,
                          text[0] ? ": " : "", text));
  }
  PetscCall(PetscFree(options));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode print_obstacles(SbRun run)
{
  const SbModel m = run->model;
  PetscBool titled = PETSC_FALSE;
  PetscReal *least;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(m->nbody, &least));
  for (PetscInt k = 0; k < m->contacts.n; k++) {
    const SbContact contact = m->contacts.contact[k];
    char text[PETSC_MAX_PATH_LEN];
    SbScope scope;
    PetscInt near = 0;

    if (!SbContactHasObstacle(contact))
      continue;
    SbScopeSet(&scope, "effect", contact->effect->type, contact->effect->name);
    PetscCall(SbOptionString(&scope, "obstacle", sizeof(text), text));
    PetscCall(SbContactSetDistances(&m->contacts, k, run->clock.t0, run->state.U, least));
    for (PetscInt b = 1; b < m->nbody; b++)
      near = least[b] < least[near] ? b : near;
    if (!titled)
      PetscCall(PetscPrintf(m->comm, "\nobstacles (m), and the nearest vertex at the start\n"));
    titled = PETSC_TRUE;
    PetscCall(PetscPrintf(m->comm, "  %-15s %s: %s is %.4g m %s\n", contact->effect->name, text,
                          m->body[near].name, (double)PetscAbsReal(least[near]),
                          least[near] < 0 ? "inside" : "away"));
  }
  PetscCall(PetscFree(least));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSceneShow(SbRun run)
{
  const SbModel m = run->model;
  PetscReal *x, (*box)[6];

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(3 * m->mesh->nvert, &x, m->nbody + m->nset, &box));
  PetscCall(SbSpaceVertexPositions(m->space, run->state.U, x));
  PetscCall(find_boxes(m->mesh, x, box));
  PetscCall(print_bodies(m, (const PetscReal(*)[6])box));
  PetscCall(print_sets(m, (const PetscReal(*)[6])box));
  PetscCall(print_effects(m));
  PetscCall(print_obstacles(run));
  PetscCall(PetscFree2(x, box));
  PetscFunctionReturn(PETSC_SUCCESS);
}
