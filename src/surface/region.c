/*
  region.c - regions: the parts of space that are bounded by closed surfaces, including non-manifold
  ones, in which more than two triangles share an edge.

  Steps: orient the triangles of each surface consistently; join sides of triangles that face each
  other to shells; compute shell volumes; find the nesting of surfaces by winding numbers; mark
  cavities and holes as empty; number and name the remaining regions.

  Every triangle f has two sides, 2 f in front and 2 f + 1 behind. Around an edge triangles are
  sorted by angle; the two sides that face each other between consecutive triangles bound the same
  region and are joined. A connected set of sides is a shell: one with a positive volume is the
  outer boundary of a region, one with a negative volume is a surface seen from the region around
  it. That region is bounded by the smallest positive shell with a nonzero winding number there (sum
  of solid angles, van Oosterom and Strackee 1983).

  Material. In formats with oriented triangles (.stl, .obj, .off, .ply) the triangles of a surface
  are first oriented consistently, by majority. A surface with outward normals encloses material,
  also inside another one (then a separate region); one with inward normals inside material is a
  cavity; an outermost one with inward normals is reversed. For non-manifold surfaces, and in
  formats without orientation (.poly, .smesh), every region is material except the holes given in
  the file.
*/
#include "surface_impl.h"

#define OUTSIDE (-1)
#define PARTS_MAX 1000 /* largest number of parts, as each is tested against all others */

typedef struct {
  PetscInt first;   /* a triangle of the shell */
  PetscInt surface; /* surface of its triangles */
  PetscReal volume, area;
  PetscReal box[6];
  PetscBool empty; /* positive shell without material */
  PetscInt region; /* region number of a positive shell with material */
} Shell;

typedef struct {
  PetscInt first;
  PetscBool branched; /* non-manifold: an edge has more than two triangles */
  PetscInt parent;    /* positive shell around the surface, or OUTSIDE */
  PetscInt outer;     /* its shell of negative volume */
} Surface;

typedef struct {
  SbTriangleFile *f;
  SbTriangles *t;
  SbSurfaceRepairs *m;
  SbKey *edge;       /* [3 ntri] edges, sorted */
  PetscInt *shell;   /* [2 ntri] shell of each side */
  PetscInt *surface; /* [ntri] surface of each triangle */
  PetscInt
    *across; /* [3 ntri] slot on the other side of an edge; -1: more than two triangles share it */
  PetscInt
    *list; /* [3 ntri] triangles that a search has reached, slots of the triangles around an edge */
  PetscReal
    *angle; /* [3 ntri] dihedral angles of the latter about their edge from the first one, rad */
  int *
    sense; /* [ntri] 1: oriented as the first triangle that the search for its surface reached, else -1 */
  PetscInt nshell, nsurface;
  Shell *shells;
  Surface *surfaces;
} Arrangement;

/* Orients the triangles of each set connected by manifold edges consistently: the minority is
   reversed. */
static PetscErrorCode orient_alike(Arrangement *s)
{
  SbTriangles *t = s->t;
  const PetscInt n = 3 * t->ntri;

  PetscFunctionBeginUser;
  for (PetscInt i = 0, m; i < n; i += m) {
    m = SbKeysAlike(n, s->edge, i);
    for (PetscInt k = 0; k < m; k++)
      s->across[s->edge[i + k].slot] = m == 2 ? s->edge[i + 1 - k].slot : -1;
  }
  PetscCall(PetscArrayzero(s->sense, t->ntri));
  for (PetscInt f = 0; f < t->ntri; f++) {
    PetscInt nfound = 0;
    PetscInt nother = 0;
    int wrong;

    if (s->sense[f])
      continue;

    // breadth-first search from this triangle
    s->list[nfound++] = f;
    s->sense[f] = 1;
    for (PetscInt done = 0; done < nfound; done++) {
      const PetscInt old = s->list[done];

      for (PetscInt k = 3 * old; k < 3 * old + 3; k++) {
        const PetscInt other = s->across[k];
        const PetscInt g = other / 3;
        int expected;

        if (other < 0)
          continue;

        // consistently oriented neighbours traverse their edge in opposite directions
        expected = t->tri[other] != t->tri[k] ? s->sense[old] : -s->sense[old];
        if (!s->sense[g]) {
          s->sense[g] = expected;
          s->list[nfound++] = g;
        }
        PetscCheck(s->sense[g] == expected, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
                   "%s: the surface has one side only (a Moebius strip or Klein bottle) around "
                   "triangles %lld "
                   "and %lld; it encloses nothing, cut it there",
                   s->f->where, (long long)s->f->number[old], (long long)s->f->number[g]);
      }
    }

    // reverse the smaller number of triangles
    for (PetscInt i = 0; i < nfound; i++)
      nother += s->sense[s->list[i]] < 0;
    wrong = 2 * nother > nfound ? 1 : -1;
    for (PetscInt i = 0; i < nfound; i++) {
      PetscInt *v = t->tri + 3 * s->list[i];
      const PetscInt keep = v[1];

      if (s->sense[s->list[i]] != wrong)
        continue;
      v[1] = v[2];
      v[2] = keep;
      s->m->nturned++;
    }
  }
  SbTrianglesEdges(t, s->edge); /* the order of corners has changed */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Side of a triangle that faces increasing (ahead) or decreasing angles around the edge from vertex
   p. */
static PetscInt facing(const SbTriangles *t, PetscInt slot, PetscInt p, PetscBool ahead)
{
  return 2 * (slot / 3) + ((t->tri[slot] == p) == ahead ? 0 : 1);
}

/* Joins the sides that face each other around one edge. */
static PetscErrorCode join_at_edge(Arrangement *s, PetscInt n, const SbKey edge[])
{
  const PetscInt p = (PetscInt)(edge[0].key >> 32);
  const PetscInt q = (PetscInt)(edge[0].key & 0xffffffff);
  const SbTriangles *t = s->t;
  PetscInt *slot = s->list;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < n; i++)
    slot[i] = edge[i].slot;

  // angles of triangles about the edge from p to q, relative to the first one
  if (n > 2) {
    PetscReal axis[3];
    PetscReal u[3] = {0};
    PetscReal v[3] = {0};
    PetscReal w[3], length;

    SbSubtract(t->x + 3 * q, t->x + 3 * p, axis);
    length = PetscSqrtReal(SbDot3(axis, axis));
    for (PetscInt i = 0; i < n; i++) {
      SbSubtract(t->x + 3 * t->tri[SbSlotNext(SbSlotNext(edge[i].slot))], t->x + 3 * p, w);
      if (!i) { /* v = axis x w is normal to the first triangle, u = v x axis lies in it */
        SbCross(axis, w, v);
        SbCross(v, axis, u);
        for (int k = 0; k < 3; k++)
          u[k] /= length;
      }
      s->angle[i] = i ? atan2(SbDot3(v, w), SbDot3(u, w)) : 0;
      if (s->angle[i] < 0)
        s->angle[i] += 2 * PETSC_PI;
    }
    PetscCall(PetscSortRealWithArrayInt(n, s->angle, slot));
  }

  // join facing sides of consecutive triangles
  for (PetscInt i = 0; i < n; i++)
    (void)SbUnionJoin(s->shell, facing(t, slot[i], p, PETSC_TRUE),
                      facing(t, slot[(i + 1) % n], p, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Shells: connected facing sides; their volumes, areas and boxes. Surfaces: triangles connected by
   edges. */
static PetscErrorCode find_shells(Arrangement *s)
{
  const SbTriangles *t = s->t;
  const PetscInt n = 3 * t->ntri;

  PetscFunctionBeginUser;

  // union-find over sides and over triangles, edge by edge
  for (PetscInt i = 0; i < 2 * t->ntri; i++)
    s->shell[i] = i;
  for (PetscInt f = 0; f < t->ntri; f++)
    s->surface[f] = f;
  for (PetscInt i = 0, m; i < n; i += m) {
    m = SbKeysAlike(n, s->edge, i);
    PetscCall(join_at_edge(s, m, s->edge + i));
    for (PetscInt k = 1; k < m; k++)
      (void)SbUnionJoin(s->surface, s->edge[i].slot / 3, s->edge[i + k].slot / 3);
  }

  // numbers from 0
  s->nshell = SbUnionLabel(2 * t->ntri, s->shell);
  s->nsurface = SbUnionLabel(t->ntri, s->surface);
  PetscCheck(
    s->nsurface <= PARTS_MAX, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "%s: the surface consists of %" PetscInt_FMT
    " parts; supple takes up to %d: remove the specks around it (meshlab: remove isolated pieces)",
    s->f->where, s->nsurface, PARTS_MAX);

  // sums over the sides; volumes relative to a vertex of the shell, to avoid cancellation far from
  // the origin
  PetscCall(PetscCalloc2(s->nshell, &s->shells, s->nsurface, &s->surfaces));
  for (PetscInt k = 0; k < s->nshell; k++)
    s->shells[k].first = -1;
  for (PetscInt k = 0; k < s->nsurface; k++)
    s->surfaces[k].first = s->surfaces[k].outer = -1;
  for (PetscInt i = 0; i < 2 * t->ntri; i++) {
    Shell *p = &s->shells[s->shell[i]];
    PetscReal box[6];

    SbTriangleBox(t->x, t->tri + 3 * (i / 2), box);
    if (p->first < 0) {
      p->first = i / 2;
      SbBoxClear(p->box);
    }
    SbBoxMerge(p->box, box);
    p->surface = s->surface[i / 2];
    p->volume +=
      (i % 2 ? 1 : -1) * SbTetVolumeTo(t->x, t->tri + 3 * (i / 2), t->x + 3 * t->tri[3 * p->first]);
    p->area += SbTriangleArea(t->x, t->tri + 3 * (i / 2), NULL);
    if (s->surfaces[s->surface[i / 2]].first < 0)
      s->surfaces[s->surface[i / 2]].first = i / 2;
  }

  // non-manifold surfaces
  for (PetscInt i = 0, m; i < n; i += m) {
    m = SbKeysAlike(n, s->edge, i);
    if (m > 2)
      s->surfaces[s->surface[s->edge[i].slot / 3]].branched = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Smallest positive shell around a point, but for those of the surface `except`; OUTSIDE if there
   is none. */
static PetscInt shell_around(const Arrangement *s, const PetscReal o[3], PetscInt except)
{
  PetscInt best = OUTSIDE;

  for (PetscInt k = 0; k < s->nshell; k++) {
    const Shell *p = &s->shells[k];
    PetscReal around = 0;
    PetscBool within = (PetscBool)(p->volume > 0 && p->surface != except);

    // test the bounding box, then the winding number
    for (int i = 0; i < 3; i++)
      within = (PetscBool)(within && o[i] >= p->box[i] && o[i] <= p->box[3 + i]);
    if (!within || (best >= 0 && s->shells[best].volume <= p->volume))
      continue;
    for (PetscInt i = 0; i < 2 * s->t->ntri; i++)
      if (s->shell[i] == k)
        around += (i % 2 ? 1 : -1) * SbTriangleSolidAngle(s->t->x, s->t->tri + 3 * (i / 2), o);
    if (around > 2 * PETSC_PI)
      best = k;
  }
  return best;
}

/* Whether the outer side of a surface is the front of its triangles. */
static PetscBool turned_outwards(const Arrangement *s, PetscInt k)
{
  return (PetscBool)(s->shell[2 * s->surfaces[k].first] == s->surfaces[k].outer);
}

/* Marks cavities, for formats with orientation. If an outermost surface has inward normals, it and
   all surfaces inside it are taken as reversed. */
static void empty_cavities(Arrangement *s)
{
  /* from outside to inside, so that it is known whether the region around a surface is material */
  for (PetscInt depth = 0; depth < s->nsurface; depth++) {
    for (PetscInt k = 0; k < s->nsurface; k++) {
      PetscInt top = k;
      PetscInt naround = 0;
      PetscBool outwards, cavity;

      // cavity: normals inward relative to the outermost surface around it, inside material
      for (; s->surfaces[top].parent != OUTSIDE; naround++)
        top = s->shells[s->surfaces[top].parent].surface;
      if (naround != depth || s->surfaces[k].branched)
        continue;
      outwards = (PetscBool)(turned_outwards(s, k) ==
                             (turned_outwards(s, top) || s->surfaces[top].branched));
      cavity = (PetscBool)(depth > 0 && !outwards && !s->shells[s->surfaces[k].parent].empty);

      // note reversed surfaces, count cavities
      s->t->turned = (PetscBool)(s->t->turned || (!turned_outwards(s, k) && !cavity));
      s->m->ncavity += cavity;
      for (PetscInt i = 0; cavity && i < s->nshell; i++)
        if (s->shells[i].surface == k && s->shells[i].volume > 0)
          s->shells[i].empty = PETSC_TRUE;
    }
  }
}

/* Groups that all triangles of a shell have in common: group[n], n at most 16. */
static void groups_of_shell(const Arrangement *s, PetscInt shell, PetscInt *n, PetscInt group[16])
{
  const SbImport *im = s->f->im;
  PetscInt last = -1; /* tag set of the previous triangle, already examined */

  *n = -1;
  for (PetscInt i = 0; i < 2 * s->t->ntri && *n; i++) {
    const PetscInt set = s->f->tags[i / 2];
    const PetscInt start = im->tags_start[set];
    const PetscInt end = im->tags_start[set + 1];
    PetscInt kept = 0;

    if (s->shell[i] != shell || set == last)
      continue;
    last = set;

    // intersection of the groups
    if (*n < 0) {
      *n = PetscMin(end - start, 16);
      for (PetscInt k = 0; k < *n; k++)
        group[k] = im->tags_group[start + k];
    }
    for (PetscInt k = 0; k < *n; k++) {
      PetscInt at = start;

      while (at < end && im->tags_group[at] != group[k])
        at++;
      if (at < end)
        group[kept++] = group[k];
    }
    *n = kept;
  }
}

/* Groups of each region: region_1, ...; NAME_region if its boundary is in the group NAME; as in the
   file. */
static PetscErrorCode name_regions(const Arrangement *s, SbSurface *out)
{
  SbImport *im = s->f->im;
  char name[SB_GROUP_MAX];

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < s->nshell; k++) {
    const Shell *p = &s->shells[k];
    PetscInt group[66], surface[16];
    PetscInt n = 0;
    PetscInt nsurface;

    if (p->volume < 0 || p->region < 0)
      continue;
    (void)snprintf(name, sizeof(name), "region_%" PetscInt_FMT, p->region + 1);
    PetscCall(SbImportGroup(im, 3, -1 - p->region, name, &group[n++]));
    groups_of_shell(s, k, &nsurface, surface);
    for (PetscInt i = 0; i < nsurface; i++) {
      (void)snprintf(name, sizeof(name), "%.100s_region", im->group[surface[i]].name);
      PetscCall(SbImportGroup(im, 3, -1 - s->nshell - surface[i], name, &group[n++]));
    }
    for (PetscInt i = 0; i < s->f->nregion && n < 66; i++) {
      const SbSeed *seed = &s->f->region[i];

      if (shell_around(s, seed->x, -1) == k)
        PetscCall(SbImportGroup(im, 3, seed->attribute, NULL, &group[n++]));
    }
    PetscCall(SbImportTagSet(im, n, group, &out->region_tags[p->region]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the regions in the steps of the file header. */
static PetscErrorCode find_regions(Arrangement *s, SbSurface *out)
{
  PetscInt n = 0;
  PetscInt kept = 0;
  const SbTriangles *t = s->t;

  PetscFunctionBeginUser;

  /* orientation, shells and their volumes */
  SbTrianglesEdges(s->t, s->edge);
  if (!s->f->sheets)
    PetscCall(orient_alike(s));
  PetscCall(find_shells(s));

  // each shell must enclose a volume, and each surface must have exactly one shell of negative
  // volume
  for (PetscInt k = 0; k < s->nshell; k++) {
    const Shell *p = &s->shells[k];
    PetscInt *outer = &s->surfaces[p->surface].outer;

    PetscCheck(
      PetscAbsReal(p->volume) > SB_TRIANGLE_EMPTY * PetscPowReal(p->area / 6, 1.5), PETSC_COMM_SELF,
      PETSC_ERR_USER_INPUT,
      "%s: the part with triangle %lld encloses no volume; give it a thickness, or remove it",
      s->f->where, (long long)s->f->number[p->first]);
    if (p->volume < 0)
      *outer = *outer == -1 ? k : -2; /* -2: several */
  }
  for (PetscInt k = 0; k < s->nsurface; k++)
    PetscCheck(s->surfaces[k].outer >= 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: the triangles around triangle %lld cut each other; join the parts into one",
               s->f->where, (long long)s->f->number[s->surfaces[k].first]);

  // shell around each surface, found from the centre of one of its triangles
  for (PetscInt k = 0; k < s->nsurface; k++) {
    const PetscInt *v = t->tri + 3 * s->surfaces[k].first;
    PetscReal middle[3];

    for (int i = 0; i < 3; i++)
      middle[i] = (t->x[3 * v[0] + i] + t->x[3 * v[1] + i] + t->x[3 * v[2] + i]) / 3;
    s->surfaces[k].parent = s->nsurface > 1 ? shell_around(s, middle, k) : OUTSIDE;
  }
  if (!s->f->sheets)
    empty_cavities(s);

  // points in the file: each must lie in a region; those of holes are empty
  for (PetscInt i = 0; i < s->f->nhole + s->f->nregion; i++) {
    const PetscBool hole = (PetscBool)(i < s->f->nhole);
    const SbSeed *seed = hole ? &s->f->hole[i] : &s->f->region[i - s->f->nhole];
    const PetscInt k = shell_around(s, seed->x, -1);

    PetscCheck(k != OUTSIDE, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s: %s %lld at (%.6g, %.6g, %.6g) m lies in no region; move it%s, or remove it",
               s->f->where, hole ? "hole" : "the point of region", (long long)seed->number,
               (double)seed->x[0], (double)seed->x[1], (double)seed->x[2],
               hole ? " into the cavity" : "");
    s->m->ncavity += hole && !s->shells[k].empty;
    if (hole)
      s->shells[k].empty = PETSC_TRUE;
  }

  // number the positive shells with material; a negative shell has the number of the region around
  // it
  for (Shell *p = s->shells; p < s->shells + s->nshell; p++)
    p->region = p->volume > 0 && !p->empty ? n++ : OUTSIDE;
  for (const Surface *u = s->surfaces; u < s->surfaces + s->nsurface; u++)
    if (u->parent != OUTSIDE)
      s->shells[u->outer].region = s->shells[u->parent].region;
  PetscCheck(n, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s: no region is left beside its holes; remove one of them", s->f->where);

  // output triangles with material on at least one side, and their vertices
  PetscCall(SbSurfaceCreate(t->nvert, t->ntri, n, out));
  PetscCall(PetscArraycpy(out->x, t->x, 3 * (size_t)t->nvert));
  for (PetscInt f = 0; f < t->ntri; f++) {
    const PetscInt front = s->shells[s->shell[2 * f]].region;
    const PetscInt back = s->shells[s->shell[2 * f + 1]].region;

    if (front == OUTSIDE && back == OUTSIDE) {
      s->m->nidle++;
      continue;
    }
    PetscCall(PetscArraycpy(out->tri + 3 * kept, t->tri + 3 * f, 3));
    out->side[2 * kept] = front;
    out->side[2 * kept + 1] = back;
    out->tags[kept] = s->f->tags[f];
    out->number[kept++] = s->f->number[f];
  }
  out->ntri = kept;
  PetscCall(SbDropUnusedPoints(&out->nvert, out->x, 3 * kept, out->tri));
  if (s->f->body)
    PetscCall(name_regions(s, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSurfaceFindRegions(SbTriangleFile *f, SbSurfaceRepairs *m, SbSurface *out)
{
  Arrangement s = {.f = f, .t = f->t, .m = m};
  const size_t n = (size_t)f->t->ntri;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc7(3 * n, &s.edge, 2 * n, &s.shell, n, &s.surface, 3 * n, &s.across, 3 * n,
                         &s.list, n, &s.sense, 3 * n, &s.angle));
  ierr = find_regions(&s, out);
  PetscCall(PetscFree2(s.shells, s.surfaces));
  PetscCall(PetscFree7(s.edge, s.shell, s.surface, s.across, s.list, s.sense, s.angle));
  PetscFunctionReturn(ierr);
}
