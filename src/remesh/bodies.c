/*
  On rank 0: new meshes for some bodies of a scene, and the state on these.

  The vectors are functions of the position at rest, linear in each tet, quadratic in those of P2: a
  new node gets the value at its rest position (body.c). A node on a kept vertex, edge or triangle
  of the surface gets the old value bitwise. A DG cell takes the value from its own side of a face.

  A new tet is in the file's groups of the old tet around its centroid; on the surface groups keep
  their triangles and vertices.
*/
#include "remesh_impl.h"

#define INWARDS 1e-6 /* fraction of the way from a face to the centre of its DG cell */

/* Key of edge e of a cell, at = 6 cell + e. */
static SbKey edge_of(const PetscInt v[], PetscInt at)
{
  return (SbKey){SbKeyOfPair(v[SbTetEdge[at % 6][0]], v[SbTetEdge[at % 6][1]]), at};
}

/* Lists the edges of tets, sorted, each with its first slot 6 cell + e. */
static PetscErrorCode list_edges(PetscInt ncell, const PetscInt cell[], PetscInt *n, SbKey **edge)
{
  const PetscInt all = 6 * ncell;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(all, edge));
  for (PetscInt i = 0; i < all; i++)
    (*edge)[i] = edge_of(cell + 4 * (i / 6), i);
  SbKeysSort(all, *edge);
  *n = 0;
  for (PetscInt i = 0; i < all; i++)
    if (!i || (*edge)[i].key != (*edge)[*n - 1].key)
      (*edge)[(*n)++] = (*edge)[i];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Data of one body during the transfer. Vertices and tets are numbered from the body's first. */
typedef struct {
  SbModel model;
  const SbGathered *g;
  PetscInt body, vert0, cell0;
  SbElement element;
  PetscInt each; /* numbers per node: 3 nfield */
  SbOldMesh old;
  PetscInt *at; /* [nvert] a corner 4 cell + a of each old vertex */
  SbKey *edge;  /* [nedge] edges of the old P2 tets, ascending */
  PetscInt nedge;
  PetscBool done;      /* the body has a new mesh */
  SbNewMesh mesh;      /* the new mesh, or the old one: then its arrays are borrowed */
  PetscInt *own;       /* [max(nvert, ncell)] 0, 1, ...: `kept` and `within` of the old mesh */
  uint64_t groups;     /* bits of the sets that are groups */
  uint64_t inclusions; /* bits of those groups that are inclusions of the body */
} Work;

/* The sets of the face `slot` = 4 cell + face of the old mesh. */
static uint64_t face_set(const Work *w, PetscInt slot)
{
  return w->g->cell_set[5 * (w->cell0 + slot / 4) + 1 + slot % 4];
}

/* The face of the old surface that equals a face of the next mesh, -1: it is inside. */
static PetscInt old_slot(const Work *w, PetscInt slot)
{
  PetscInt vert[3], slots[2];

  for (int k = 0; k < 3; k++) {
    vert[k] = w->mesh.cell[4 * (slot / 4) + SbFaceVertex[slot % 4][k]];
    if (vert[k] >= w->mesh.nkept)
      return -1;
    vert[k] = w->mesh.kept[vert[k]];
  }
  return SbFacesFind(&w->old.faces, vert, slots) == 1 ? slots[0] : -1;
}

/* Makes the new mesh. */
static PetscErrorCode make_mesh(Work *w, const SbRemeshing *how)
{
  const SbGathered *g = w->g;
  char where[3 * SB_NAME_MAX];
  PetscInt nkind = 0;
  uint64_t(*kind)[2], lost = 0, *volume;
  PetscBool *surface;

  PetscFunctionBeginUser;

  // error for sets with inner points, curves or triangles of a file, which would be lost
  PetscCall(PetscCalloc2(w->old.nvert, &volume, w->old.nvert, &surface));
  for (PetscInt i = 0; i < 4 * w->old.ncell; i++) {
    volume[w->old.cell[i]] |= g->cell_set[5 * (w->cell0 + i / 4)];
    if (!(face_set(w, i) & SB_ON_BOUNDARY))
      lost |= face_set(w, i) & w->groups;
    for (int k = 1; k < 4 && face_set(w, i) & SB_ON_BOUNDARY; k++)
      surface[w->old.cell[4 * (i / 4) + (i % 4 + k) % 4]] = PETSC_TRUE;
  }
  for (PetscInt v = 0; v < w->old.nvert; v++)
    lost |= surface[v] ? 0 : g->vert_set[w->vert0 + v] & w->groups & ~volume[v];
  PetscCall(PetscFree2(volume, surface));
  for (PetscInt k = 0; k < w->model->nset; k++)
    PetscCheck(!(lost & SB_SET_BIT(k)), PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "the group '%s' holds triangles, curves or points inside the body, which would be "
               "lost: use a "
               "shape (-sets) or a group of the surface or of volumes",
               w->model->set[k].group);
  PetscCall(
    PetscSNPrintf(where, sizeof(where), "body '%s', re-meshed", w->model->body[w->body].name));

  // tets of different materials or groups must be separated by faces
  PetscCall(PetscMalloc1(w->old.ncell, &kind));
  for (PetscInt c = 0; c < w->old.ncell; c++) {
    const uint64_t material = (uint64_t)g->cell_material[w->cell0 + c];
    const uint64_t sets = g->cell_set[5 * (w->cell0 + c)] & (w->groups | w->inclusions);
    PetscInt k = 0;

    while (k < nkind && (kind[k][0] != material || kind[k][1] != sets))
      k++;
    if (k == nkind) {
      kind[nkind][0] = material;
      kind[nkind++][1] = sets;
    }
    w->old.region[c] = k;
  }
  PetscCall(PetscFree(kind));
  PetscCall(SbRemeshBody(where, &w->old, how, &w->mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts triangles in groups, or writes them; for an old mesh also inner ones. */
static PetscInt list_triangles(const Work *w, SbMemoryMesh *in_memory)
{
  PetscInt n = 0;

  for (PetscInt i = 0; i < 4 * w->mesh.ncell; i++) {
    const PetscInt slot = w->done ? old_slot(w, i) : i;
    const uint64_t bits = slot < 0 ? 0 : face_set(w, slot) & w->groups;

    if (!bits)
      continue;
    if (in_memory) {
      for (int k = 0; k < 3; k++)
        in_memory->tri[3 * n + k] = w->mesh.cell[4 * (i / 4) + (i % 4 + 1 + k) % 4];
      in_memory->tri_set[n] = bits;
    }
    n++;
  }
  return n;
}

/* A value of an old cell. */
static const PetscReal *old_value(const Work *w, PetscInt cell, PetscInt k)
{
  return w->g->value +
         ((size_t)(w->cell0 + cell) * (size_t)w->g->width + (size_t)k) * (size_t)w->each;
}

/* First slot of the old edge that equals an edge of the next mesh, -1: it is a new one. */
static PetscInt old_edge(const Work *w, uint64_t key)
{
  const PetscInt low = (PetscInt)(key >> 32);
  const PetscInt high = (PetscInt)(key & 0xffffffff);
  PetscInt at;

  if (high >= w->mesh.nkept)
    return -1;
  at = SbKeysFind(w->nedge, w->edge, SbKeyOfPair(w->mesh.kept[low], w->mesh.kept[high]));
  return at < 0 ? -1 : w->edge[at].slot;
}

/* The old fields at a rest position X, from the tet that contains `near`. */
static PetscErrorCode interpolate_old(const Work *w, const PetscReal X[3], const PetscReal near[3],
                                      PetscReal value[])
{
  PetscReal weight[4];
  PetscReal psi[SB_CELL_NODES] = {0.};
  PetscInt cell;

  PetscFunctionBeginUser;
  PetscCall(SbOldTetFind(w->old.rest, near, &cell, weight));
  if (near != X)
    SbTetBarycentric(w->g->X + 3 * w->vert0, w->old.cell + 4 * cell, X, weight);
  if (w->edge)
    SbQuadraticBasis(weight, psi);
  for (int i = 0; i < 16 && !w->edge; i++)
    psi[i % 4] += weight[i / 4] * w->element->ops.vertex[i / 4][i % 4];
  for (PetscInt k = 0; k < w->each; k++)
    value[k] = 0.;
  for (int a = 0; a < (w->edge ? SB_CELL_NODES : 4); a++) {
    const PetscReal *from = old_value(w, cell, a < 4 ? a : SB_EDGES + a - 4);

    for (PetscInt k = 0; k < w->each; k++)
      value[k] += psi[a] * from[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode new_values(const Work *w, PetscInt c, PetscReal value[])
{
  PetscFunctionBeginUser;
  for (PetscInt a = 0; a < 4; a++) {
    const PetscInt v = w->mesh.cell[4 * c + a];
    const PetscInt slot = old_slot(w, 4 * c + a);
    PetscReal *to = value + a * w->each;
    PetscReal *support = value + (4 + a) * w->each;
    PetscReal X[3], inside[3];
    const PetscReal *from = NULL;

    if (w->element->nodes_per[0] && v < w->mesh.nkept)
      from = old_value(w, w->at[w->mesh.kept[v]] / 4, w->at[w->mesh.kept[v]] % 4);
    else if (w->element->nodes_per[0])
      for (int k = 0; k < 3; k++)
        X[k] = w->mesh.X[3 * v + k];
    else if (slot >= 0)
      from = old_value(w, slot / 4, slot % 4);
    else {
      const PetscReal *at = w->mesh.X;
      const PetscReal *apex = at + 3 * v;
      PetscInt face[3];

      // the centroid of the face, bitwise equal from both cells, and a point slightly inside
      for (int k = 0; k < 3; k++)
        face[k] = w->mesh.cell[4 * c + SbFaceVertex[a][k]];
      (void)PetscSortInt(3, face);
      for (int k = 0; k < 3; k++) {
        X[k] = (at[3 * face[0] + k] + at[3 * face[1] + k] + at[3 * face[2] + k]) / 3.;
        inside[k] = X[k] + INWARDS * 0.25 * (apex[k] - X[k]);
      }
    }
    if (!from)
      PetscCall(interpolate_old(w, X, w->element->nodes_per[3] ? inside : X, to));
    for (PetscInt k = 0; k < w->each && from; k++)
      to[k] = from[k];
    for (PetscInt k = 0; k < w->each && w->g->width >= 8; k++)
      support[k] = slot < 0 ? PETSC_MAX_REAL : old_value(w, slot / 4, 4 + slot % 4)[k];
  }
  for (PetscInt e = 0; e < w->g->width - SB_EDGES; e++) {
    const PetscInt *v = w->mesh.cell + 4 * c;
    const PetscInt at = w->edge ? old_edge(w, edge_of(v, e).key) : -1;
    PetscReal *to = value + (SB_EDGES + e) * w->each;
    PetscReal X[3];

    for (int k = 0; k < 3; k++)
      X[k] = 0.5 * (w->mesh.X[3 * v[SbTetEdge[e][0]] + k] + w->mesh.X[3 * v[SbTetEdge[e][1]] + k]) +
             (w->mesh.edge_off ? w->mesh.edge_off[18 * (size_t)c + 3 * e + k] : 0.);
    for (PetscInt k = 0; k < w->each; k++)
      to[k] = at < 0 ? PETSC_MAX_REAL : old_value(w, at / 6, SB_EDGES + at % 6)[k];
    if (w->edge && at < 0)
      PetscCall(interpolate_old(w, X, X, to));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a renumbered node; the arrays hold two nodes per corner of the surfaces of all bodies. */
static void rename_node(SbRenamed *r, PetscInt from, PetscInt to)
{
  r->from[r->n] = from;
  r->to[r->n++] = to;
}

/* Mesh, values and renumbered nodes of one body. */
static PetscErrorCode finish_body(const Work *w, PetscInt step, SbRemeshResult *result)
{
  SbGathered *next = &result->next;
  const SbMemoryMesh *before = w->model->body[w->body].in_memory;
  SbMemoryMesh *p;
  const size_t each = (size_t)next->width * (size_t)w->each;
  const PetscInt N = w->g->nvert;
  const PetscInt C = w->g->ncell;
  const PetscInt N1 = next->nvert;
  const PetscInt C1 = next->ncell;
  const PetscInt cell1 = next->cell0[w->body];
  PetscReal *value = next->value + each * (size_t)cell1;
  const SbGathered *g = w->g;
  SbRenamed *r = &result->renamed;
  const SbNewMesh *m = &w->mesh;
  PetscInt nedge = 0;
  PetscInt ncurved = 0;
  SbKey *edge = NULL;

  PetscFunctionBeginUser;

  // renumbered nodes of the surface: old edges (P2) and vertices, or faces and their supports
  if (w->edge)
    PetscCall(list_edges(m->ncell, m->cell, &nedge, &edge));
  for (PetscInt i = 0; i < nedge; i++) {
    const PetscInt at = old_edge(w, edge[i].key);

    if (at >= 0)
      rename_node(r, N + 8 * C + 6 * w->cell0 + at, N1 + 8 * C1 + 6 * cell1 + edge[i].slot);
  }
  for (PetscInt v = 0; v < m->nkept && w->element->nodes_per[0]; v++)
    rename_node(r, w->vert0 + m->kept[v], next->vert0[w->body] + v);
  for (PetscInt i = 0; i < 4 * m->ncell && !w->element->nodes_per[0]; i++) {
    const PetscInt slot = old_slot(w, i);

    if (slot < 0)
      continue;
    rename_node(r, N + 4 * w->cell0 + slot, N1 + 4 * cell1 + i);
    rename_node(r, N + 4 * (C + w->cell0) + slot, N1 + 4 * (C1 + cell1) + i);
  }

  // curved edges of the next mesh
  for (PetscInt i = 0; i < nedge && m->edge_off; i++) {
    const PetscReal *off = m->edge_off + 3 * (size_t)edge[i].slot;

    if (off[0] != 0. || off[1] != 0. || off[2] != 0.)
      edge[ncurved++] = edge[i];
  }
  PetscCall(SbMemoryMeshCreate(m->nvert, m->ncell, list_triangles(w, NULL), ncurved, &p));
  result->in_memory[w->body] = p;
  PetscCall(PetscArraycpy(p->x, m->X, 3 * (size_t)m->nvert));
  PetscCall(PetscArraycpy(p->cell, m->cell, 4 * (size_t)m->ncell));
  (void)list_triangles(w, p);
  for (PetscInt i = 0; i < ncurved; i++) {
    p->edge[2 * i] = (PetscInt)(edge[i].key >> 32);
    p->edge[2 * i + 1] = (PetscInt)(edge[i].key & 0xffffffff);
    PetscCall(PetscArraycpy(p->edge_off + 3 * i, m->edge_off + 3 * (size_t)edge[i].slot, 3));
  }
  PetscCall(PetscFree(edge));
  for (PetscInt v = 0; v < m->nkept; v++)
    p->vert_set[v] = g->vert_set[w->vert0 + m->kept[v]] & w->groups;
  for (PetscInt c = 0; c < m->ncell; c++) {
    p->cell_set[c] = g->cell_set[5 * (w->cell0 + m->within[c])] & (w->groups | w->inclusions);
    for (int a = 0; a < 4; a++)
      p->vert_set[m->cell[4 * c + a]] |= p->cell_set[c] & w->groups;
  }
  for (PetscInt c = 0; c < m->ncell; c++)
    result->from[cell1 + c] = w->cell0 + m->within[c];
  if (w->done) {
    for (PetscInt c = 0; c < m->ncell; c++)
      PetscCall(new_values(w, c, value + each * (size_t)c));
    p->step = step;
    p->mass = g->mass[w->body];
    p->bound =
      m->quality; /* quality of the worst tet; the caller derives the bound for re-meshing */
  } else {
    PetscCall(
      PetscArraycpy(value, g->value + each * (size_t)w->cell0, each * (size_t)w->old.ncell));
    if (before) {
      p->step = before->step;
      p->mass = before->mass;
      p->bound = before->bound;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRemeshResultCreate(const SbGathered *g, SbRemeshResult *r)
{
  PetscFunctionBeginUser;
  *r = (SbRemeshResult){.next = {.nbody = g->nbody, .nfield = g->nfield, .width = g->width}};
  PetscCall(PetscCalloc2(g->nbody, &r->in_memory, g->nbody, &r->outcome));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRemeshResultDestroy(SbRemeshResult *r)
{
  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < r->next.nbody; b++)
    PetscCall(SbMemoryMeshDestroy(&r->in_memory[b]));
  PetscCall(PetscFree2(r->in_memory, r->outcome));
  PetscCall(SbGatheredDestroy(&r->next));
  PetscCall(PetscFree2(r->renamed.from, r->renamed.to));
  PetscCall(PetscFree(r->from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRemeshBodies(SbModel m, const SbGathered *g, const PetscBool due[], PetscInt step,
                              const SbRemeshing *how, SbRemeshResult *r)
{
  PetscInt room = 0;
  Work *work;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(m->nbody, &work));
  PetscCall(PetscCalloc3(g->nbody + 1, &r->next.vert0, g->nbody + 1, &r->next.cell0, g->nbody,
                         &r->next.mass));
  for (PetscInt b = 0; b < m->nbody; b++) {
    Work *w = &work[b];
    SbOldMesh *old = &w->old;
    SbCaughtError caught = {0, ""};

    *w = (Work){.model = m,
                .g = g,
                .body = b,
                .vert0 = g->vert0[b],
                .cell0 = g->cell0[b],
                .element = m->element[b],
                .each = 3 * g->nfield,
                .old = {.nvert = g->vert0[b + 1] - g->vert0[b],
                        .ncell = g->cell0[b + 1] - g->cell0[b],
                        .X = g->X + 3 * g->vert0[b],
                        .x = g->x + 3 * g->vert0[b]}};
    for (PetscInt k = 0; k < m->nset; k++)
      w->groups |= m->set[k].shape == SB_SET_GROUP ? SB_SET_BIT(k) : 0;
    for (PetscInt k = 0; k < m->body[b].ninclusion; k++)
      w->inclusions |= SB_SET_BIT(m->body[b].inclusion[k].set);
    PetscCall(PetscMalloc4(4 * (size_t)old->ncell, &old->cell, old->ncell, &old->region, old->nvert,
                           &w->at, PetscMax(old->nvert, old->ncell), &w->own));
    for (PetscInt i = 0; i < 4 * old->ncell; i++) {
      old->cell[i] = g->cell[4 * w->cell0 + i] - w->vert0;
      w->at[old->cell[i]] = i;
    }
    for (PetscInt i = 0; i < PetscMax(old->nvert, old->ncell); i++)
      w->own[i] = i;
    if (w->element->nodes_per[1])
      PetscCall(list_edges(old->ncell, old->cell, &w->nedge, &w->edge));
    if (w->edge && g->edge_off)
      old->edge_off = g->edge_off + 18 * (size_t)w->cell0;
    PetscCall(SbFacesCreate(old->nvert, old->ncell, old->cell, &old->faces));
    PetscCall(SbLocatorCreate(old->ncell, old->cell, old->X, old->edge_off, &old->rest));

    // re-mesh the body; an error becomes the message
    if (due[b]) {
      SB_CATCH(&caught, make_mesh(w, how));
      w->done = (PetscBool)!caught.code;
      if (caught.code)
        PetscCall(SbNewMeshDestroy(&w->mesh));
    }
    if (!w->done)
      w->mesh = (SbNewMesh){.nvert = old->nvert,
                            .ncell = old->ncell,
                            .nkept = old->nvert,
                            .X = (PetscReal *)old->X,
                            .cell = old->cell,
                            .kept = w->own,
                            .within = w->own,
                            .edge_off = (PetscReal *)old->edge_off};
    r->outcome[b] = (SbRemeshOutcome){{old->nvert, w->mesh.nvert},
                                      {old->ncell, w->mesh.ncell},
                                      w->mesh.nmoved,
                                      w->mesh.quality,
                                      ""};
    (void)snprintf(r->outcome[b].message, sizeof(r->outcome[b].message), "%.511s", caught.text);
    r->next.vert0[b + 1] = r->next.vert0[b] + w->mesh.nvert;
    r->next.cell0[b + 1] = r->next.cell0[b] + w->mesh.ncell;
    room += old->nvert + 2 * old->faces.nboundary + w->nedge;
  }

  // arrays for the values on the next meshes
  r->next.nvert = r->next.vert0[g->nbody];
  r->next.ncell = r->next.cell0[g->nbody];
  PetscCall(PetscMalloc1((size_t)(r->next.width * r->next.nfield * 3) * (size_t)r->next.ncell,
                         &r->next.value));
  PetscCall(PetscMalloc1(r->next.ncell, &r->from));
  PetscCall(PetscMalloc2(room, &r->renamed.from, room, &r->renamed.to));
  for (PetscInt b = 0; b < m->nbody; b++) {
    PetscCall(finish_body(&work[b], step, r));
    if (work[b].done)
      PetscCall(SbNewMeshDestroy(&work[b].mesh));
    PetscCall(SbLocatorDestroy(&work[b].old.rest));
    PetscCall(PetscFree4(work[b].old.cell, work[b].old.region, work[b].at, work[b].own));
    PetscCall(PetscFree(work[b].edge));
    PetscCall(SbFacesDestroy(&work[b].old.faces));
  }
  PetscCall(PetscSortIntWithArray(r->renamed.n, r->renamed.from, r->renamed.to));
  PetscCall(PetscFree(work));
  PetscFunctionReturn(PETSC_SUCCESS);
}
