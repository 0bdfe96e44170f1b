/*
  sets.c - named sets: their definition, and their members (vertices, facets, cells) as bit masks.

  A shape contains the vertices inside it, the boundary facets with all three vertices inside, and
  the tets with all four. The tolerance is 1e-6 times the diagonal of the body's bounding box, so
  that a plane contains the nodes of a curved or rotated side. A group of points or curves contains
  vertices; a group of surfaces contains its triangles (interior ones as faces of both tets) and
  their vertices; a group of volumes contains its tets, their vertices and their boundary facets.
  Groups with equal names and different dimensions are one set.
*/
#include "mesh_impl.h"

/* The kinds of sets, with what to write for them. */
static const struct {
  const char *name, *form;
  int least, most; /* range of the number of parameters; 0: a name; -1: none */
} shapes[] = {
  [SB_SET_GROUP] = {"group", "group:NAME or group:BODY.NAME", 0, 0},
  [SB_SET_BOX] = {"box", "box:xmin,ymin,zmin,xmax,ymax,zmax (m)", 6, 6},
  [SB_SET_PLANE] = {"plane", "plane:nx,ny,nz,d or plane:nx,ny,nz,d,tolerance (m)", 4, 5},
  [SB_SET_SPHERE] = {"sphere", "sphere:cx,cy,cz,radius (m)", 4, 4},
  [SB_SET_HALFSPACE] = {"halfspace", "halfspace:nx,ny,nz,d (m)", 4, 4},
  [SB_SET_BODY] = {"body", "body:NAME", 0, 0},
  [SB_SET_BOUNDARY] = {"boundary", "boundary", -1, -1},
};
enum {
  NSHAPE = (int)PETSC_STATIC_ARRAY_LENGTH(shapes)
};

PetscErrorCode SbSetParse(const char *option, const char *text, SbSet *set)
{
  const char *colon = strchr(text, ':');
  const size_t n = strcspn(text, ":");
  PetscReal *p = set->p;
  PetscBool good;
  int i;

  PetscFunctionBeginUser;
  for (i = 0; i < NSHAPE; i++)
    if (strlen(shapes[i].name) == n && !strncmp(shapes[i].name, text, n))
      break;
  if (i == NSHAPE) {
    const char *names[NSHAPE];
    char all[512], word[64];

    for (int k = 0; k < NSHAPE; k++)
      names[k] = shapes[k].name;
    (void)snprintf(word, sizeof(word), "%.*s", (int)n, text);
    SbSuggestName(word, NSHAPE, names, sizeof(all), all);
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s '%s': a set begins with one of %s", option,
            text, all);
  }
  set->shape = (SbSetShape)i;
  set->group[0] = 0;
  PetscCall(PetscArrayzero(p, 8));
  if (shapes[i].least < 0)
    good = (PetscBool)!colon;
  else if (shapes[i].least == 0)
    good = (PetscBool)(colon && colon[1] && strlen(colon + 1) < sizeof(set->group));
  else
    good = (PetscBool)(colon && SbParseNumbers(colon + 1, shapes[i].most, p) >= shapes[i].least);
  PetscCheck(good, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s '%s': write %s", option, text,
             shapes[i].form);
  if (shapes[i].least == 0)
    PetscCall(PetscStrncpy(set->group, colon + 1, sizeof(set->group)));

  // normalise plane normals (and distances); an empty shape is an error
  PetscCheck(set->shape != SB_SET_BOX || (p[0] <= p[3] && p[1] <= p[4] && p[2] <= p[5]),
             PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s '%s': the first corner must lie below the second in x, y and z", option, text);
  PetscCheck(set->shape != SB_SET_SPHERE || p[3] > 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s '%s': the radius must be above 0 m", option, text);
  if (set->shape == SB_SET_PLANE || set->shape == SB_SET_HALFSPACE) {
    const PetscReal length = PetscSqrtReal(SbDot3(p, p));

    PetscCheck(length > 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s '%s': the normal must have a length above 0", option, text);
    PetscCheck(set->shape == SB_SET_HALFSPACE || p[4] >= 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s '%s': the tolerance must not be below 0 m", option, text);
    for (int k = 0; k < 4; k++)
      p[k] /= length;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a point is in a shape. */
static PetscBool inside(const SbSet *set, const PetscReal x[3], PetscReal slack)
{
  const PetscReal *p = set->p;

  switch (set->shape) {
  case SB_SET_BOX:
    for (int i = 0; i < 3; i++)
      if (x[i] < p[i] - slack || x[i] > p[3 + i] + slack)
        return PETSC_FALSE;
    return PETSC_TRUE;
  case SB_SET_PLANE:
    return (PetscBool)(PetscAbsReal(SbDot3(p, x) - p[3]) <= PetscMax(p[4], slack));
  case SB_SET_SPHERE:
    return (PetscBool)(PetscSqrtReal(SbDistance2(x, p)) <= p[3] + slack);
  case SB_SET_HALFSPACE:
    return (PetscBool)(SbDot3(p, x) <= p[3] + slack);
  default:
    return PETSC_FALSE;
  }
}

/* Name of the set's group in body b; NULL if the set names a group of another body. */
static const char *group_in_body(const SbSet *set, PetscInt nbody, const SbBody body[], PetscInt b)
{
  for (PetscInt i = 0; i < nbody; i++) {
    const size_t n = strlen(body[i].name);

    if (!strncmp(set->group, body[i].name, n) && set->group[n] == '.')
      return i == b ? set->group + n + 1 : NULL;
  }
  return set->group;
}

PetscBool SbGroupIsNamed(const SbGroup *group, const char *name)
{
  const char *p = group->name;

  for (; *p && (*p == *name || (*p == ' ' && *name == '_')); p++)
    name++;
  return (PetscBool)(!*p && !*name);
}

void SbSetsBits(const SbImport *im, PetscInt nbody, const SbBody body[], PetscInt b, PetscInt nset,
                const SbSet set[], uint64_t bits[])
{
  for (PetscInt t = 0; t < im->ntags; t++)
    bits[t] = 0;
  for (PetscInt k = 0; k < nset; k++) {
    const char *name = set[k].shape == SB_SET_GROUP ? group_in_body(&set[k], nbody, body, b) : NULL;

    for (PetscInt t = 0; name && t < im->ntags; t++)
      for (PetscInt i = im->tags_start[t]; i < im->tags_start[t + 1]; i++)
        if (SbGroupIsNamed(&im->group[im->tags_group[i]], name))
          bits[t] |= SB_SET_BIT(k);
  }
}

static void count_bits(uint64_t mask, PetscInt nset, PetscInt *count)
{
  for (PetscInt k = 0; mask && k < nset; k++)
    count[3 * k] += (mask & SB_SET_BIT(k)) != 0;
}

PetscErrorCode SbSetsMark(const SbImport *im, const SbFaces *faces, PetscInt nbody,
                          const SbBody body[], PetscInt b, PetscInt nset, const SbSet set[],
                          SbMasks *m)
{
  uint64_t *bits;
  uint64_t all = 0;
  uint64_t hull = 0;
  PetscInt slots[2];
  const PetscReal slack = 1e-6 * SbBoxDiagonal(body[b].bbox);

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc3(im->nvert, &m->vert, im->item[3].n, &m->cell, 4 * (size_t)im->item[3].n,
                         &m->face));

  // shapes, bodies, the boundary; `all`: bits of sets that contain the whole body, `hull`: its
  // boundary
  for (PetscInt k = 0; k < nset; k++) {
    if (set[k].shape == SB_SET_BODY &&
        (!strcmp(set[k].group, body[b].name) ||
         (body[b].copy_of[0] && !strcmp(set[k].group, body[b].copy_of))))
      all |= SB_SET_BIT(k);
    else if (set[k].shape == SB_SET_BOUNDARY)
      hull |= SB_SET_BIT(k);
    else if (set[k].shape != SB_SET_BODY && set[k].shape != SB_SET_GROUP)
      for (PetscInt v = 0; v < im->nvert; v++)
        m->vert[v] |= inside(&set[k], im->x + 3 * v, slack) ? SB_SET_BIT(k) : 0;
  }
  for (PetscInt c = 0; c < im->item[3].n; c++) {
    const PetscInt *v = im->item[3].vert + 4 * c;

    m->cell[c] = all | (m->vert[v[0]] & m->vert[v[1]] & m->vert[v[2]] & m->vert[v[3]]);
    for (int f = 0; f < 4; f++) {
      const int *w = SbFaceVertex[f];

      if (faces->neighbour[4 * c + f] < 0)
        m->face[4 * c + f] =
          SB_ON_BOUNDARY | hull | all | (m->vert[v[w[0]]] & m->vert[v[w[1]]] & m->vert[v[w[2]]]);
    }
  }
  for (PetscInt v = 0; v < im->nvert; v++)
    m->vert[v] |= all;
  for (PetscInt s = 0; hull && s < 4 * im->item[3].n; s++) {
    if (faces->neighbour[s] >= 0)
      continue;
    for (int i = 0; i < 3; i++)
      m->vert[im->item[3].vert[4 * (s / 4) + SbFaceVertex[s % 4][i]]] |= hull;
  }
  PetscCall(PetscMalloc1(im->ntags, &bits));
  SbSetsBits(im, nbody, body, b, nset, set, bits);

  // members of groups: vertices, faces of tets, tets with their boundary faces
  for (int d = 0; d < 4; d++) {
    const SbItems *item = &im->item[d];

    for (PetscInt i = 0; i < item->n; i++) {
      const uint64_t bit = bits[item->tags[i]];

      if (!bit)
        continue;
      for (int k = 0; k <= d; k++)
        m->vert[item->vert[(d + 1) * i + k]] |= bit;
      if (d == 2) {
        const PetscInt n = SbFacesFind(faces, item->vert + 3 * i, slots);

        for (PetscInt k = 0; k < n; k++)
          m->face[slots[k]] |= bit;
      } else if (d == 3) {
        m->cell[i] |= bit;
        for (int f = 0; f < 4; f++)
          m->face[4 * i + f] |= faces->neighbour[4 * i + f] < 0 ? bit : 0;
      }
    }
  }
  PetscCall(PetscFree(bits));
  if (body[b].in_memory)
    SbMemoryMeshMark(&body[b], faces, m);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSetsCount(MPI_Comm comm, PetscInt nvert, PetscInt ncell, const SbMasks *m,
                           PetscInt nset, SbSet set[])
{
  PetscInt *count;

  PetscFunctionBeginUser;
  if (!nset)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(3 * nset, &count));
  for (PetscInt v = 0; v < nvert; v++)
    count_bits(m->vert[v], nset, count);
  for (PetscInt c = 0; c < ncell; c++)
    count_bits(m->cell[c], nset, count + 2);
  for (PetscInt s = 0; s < 4 * ncell; s++)
    if (m->face[s] & SB_ON_BOUNDARY)
      count_bits(m->face[s] & ~SB_ON_BOUNDARY, nset, count + 1);
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, count, (PetscMPIInt)(3 * nset), MPIU_INT, MPI_SUM, comm));
  for (PetscInt k = 0; k < nset; k++) {
    set[k].nvert += count[3 * k];
    set[k].nfacet += count[3 * k + 1];
    set[k].ncell += count[3 * k + 2];
  }
  PetscCall(PetscFree(count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Raises the error of a group without members. */
static PetscErrorCode empty_group(PetscInt nbody, const SbBody body[], const SbImport import[],
                                  const SbSet *set)
{
  const char **names;
  const char *wanted = strchr(set->group, '.') ? strchr(set->group, '.') + 1 : set->group;
  char groups[1024] = "";
  char near[256];
  PetscInt n = 0;
  PetscInt exists = 0;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < nbody; b++)
    n += import[b].ngroup;
  PetscCall(PetscMalloc1(n, &names));
  n = 0;
  for (PetscInt b = 0; b < nbody; b++) {
    const char *name = group_in_body(set, nbody, body, b);

    for (PetscInt g = 0; g < import[b].ngroup; g++) {
      names[n++] = import[b].group[g].name;
      exists += name && SbGroupIsNamed(&import[b].group[g], name);
    }
  }
  SbSuggestNames(wanted, n, names, sizeof(near), near);
  PetscCall(PetscFree(names));

  // "liver: wall, ligament; stone: none"
  for (PetscInt b = 0; b < nbody; b++) {
    const SbImport *im = &import[b];

    SbAppend(sizeof(groups), groups, "%s%s: %s", b ? "; " : "", body[b].name,
             im->ngroup ? "" : "none");
    for (PetscInt g = 0; g < im->ngroup; g++) {
      PetscBool known = PETSC_FALSE;

      for (PetscInt h = 0; h < g; h++)
        known = (PetscBool)(known || !strcmp(im->group[h].name, im->group[g].name));
      if (!known)
        SbAppend(sizeof(groups), groups, "%s%s", g ? ", " : "", im->group[g].name);
    }
  }
  PetscCheck(
    !exists, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "set '%s': the physical group '%s' holds no vertex, facet or tet of the mesh; the mesh and its "
    "groups do not belong together",
    set->name, set->group);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
          "set '%s': there is no physical group '%s'%s%s%s; groups by body: %s", set->name,
          set->group, near[0] ? ", did you mean " : "", near, near[0] ? "?" : "", groups);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Warns where a set that the scenario has by itself hides a group of the same name: `all`,
   `boundary`, or a body's name where the group is not just that body. */
static PetscErrorCode hidden_groups(PetscInt nbody, const SbBody body[], const SbImport import[],
                                    const SbSet *set)
{
  const PetscBool of_body =
    (PetscBool)(set->shape == SB_SET_BODY && !strcmp(set->name, set->group));
  const PetscBool all = (PetscBool)(set->shape == SB_SET_HALFSPACE && !strcmp(set->name, "all") &&
                                    set->p[3] == PETSC_MAX_REAL);
  const PetscBool hull =
    (PetscBool)(set->shape == SB_SET_BOUNDARY && !strcmp(set->name, "boundary"));

  const char *what = all ? "every point" : "the boundary of all bodies";

  PetscFunctionBeginUser;
  if (!of_body && !all && !hull)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (of_body)
    what = "that body";
  for (PetscInt b = 0; b < nbody; b++) {
    const PetscBool own = (PetscBool)(of_body && (!strcmp(body[b].name, set->name) ||
                                                  !strcmp(body[b].copy_of, set->name)));

    for (PetscInt g = 0; g < import[b].ngroup; g++) {
      const SbGroup *group = &import[b].group[g];

      if (!SbGroupIsNamed(group, set->name) || (own && group->dim == 3))
        continue;
      PetscCall(SbWarning(PETSC_COMM_SELF,
                          "the name '%s' is %s; the group '%s' in the mesh of body '%s' is another "
                          "set: -sets NAME -set_NAME_at group:%s",
                          set->name, what, set->name, body[b].name, set->name));
      PetscFunctionReturn(PETSC_SUCCESS);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSetsCheck(PetscInt nbody, const SbBody body[], const SbImport import[],
                           PetscInt nset, const SbSet set[])
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < nset; k++) {
    PetscReal box[6];

    PetscCall(hidden_groups(nbody, body, import, &set[k]));
    if (set[k].nvert || set[k].nfacet || set[k].ncell)
      continue;
    if (set[k].shape == SB_SET_GROUP)
      PetscCall(empty_group(nbody, body, import, &set[k]));
    if (set[k].shape == SB_SET_BODY) {
      const char **names;
      char near[256];

      PetscCall(PetscMalloc1(nbody, &names));
      for (PetscInt b = 0; b < nbody; b++)
        names[b] = body[b].name;
      SbSuggestNames(set[k].group, nbody, names, sizeof(near), near);
      PetscCall(PetscFree(names));
      SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "set '%s': there is no body '%s'%s%s%s",
              set[k].name, set[k].group, near[0] ? "; did you mean " : "", near,
              near[0] ? "?" : "");
    }

    // a shape outside the bodies
    SbBoxClear(box);
    for (PetscInt b = 0; b < nbody; b++)
      SbBoxMerge(box, body[b].bbox);
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
            "set '%s': no vertex lies in the %s; the placed bodies reach from (%.6g, %.6g, %.6g) "
            "to (%.6g, "
            "%.6g, %.6g) m",
            set[k].name, shapes[set[k].shape].name, (double)box[0], (double)box[1], (double)box[2],
            (double)box[3], (double)box[4], (double)box[5]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
