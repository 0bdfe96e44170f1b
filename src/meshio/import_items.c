/*
  import_items.c - what readers fill: vertices, simplices of each dimension, edge nodes, physical
  groups.

  An entity of a file may belong to several physical groups. Each distinct set of groups is stored
  once (a "tag set"), and items refer to it by number; set 0 is the empty set.
*/
#include <stdarg.h>
#include "meshio_impl.h"

#define STRAIGHT 1e-6 /* offset of the node of a straight edge over its length, at most */

/* Header before each scratch array. */
struct _p_SbScratch {
  struct _p_SbScratch *next, *before;
};

PetscErrorCode SbImportScratch(SbImport *im, size_t bytes, void *array)
{
  struct _p_SbScratch *block = NULL;
  void *old = *(void **)array;

  PetscFunctionBeginUser;
  if (old)
    block = (struct _p_SbScratch *)old - 1;
  PetscCall(PetscRealloc(sizeof(*block) + bytes, &block));
  if (!old)
    *block = (struct _p_SbScratch){im->scratch, NULL};
  if (block->next)
    block->next->before = block;
  *(block->before ? &block->before->next : &im->scratch) = block;
  *(void **)array = block + 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportGrow(SbImport *im, SbCount *count, size_t unit, void *array)
{
  PetscFunctionBeginUser;
  if (count->n == count->capacity) {
    count->capacity = PetscMax(64, 2 * count->capacity);
    PetscCall(SbImportScratch(im, (size_t)count->capacity * unit, array));
  }
  count->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportForget(SbImport *im)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(im->scan.data));
  im->scan.npiece = 0;
  PetscCall(SbNumbersDestroy(&im->nodes));
  PetscCall(SbNumbersDestroy(&im->elements));
  while (im->scratch) {
    struct _p_SbScratch *block = im->scratch;

    im->scratch = block->next;
    PetscCall(PetscFree(block));
  }
  im->member = NULL;
  im->nmember = (SbCount){0, 0};
  im->skipped = NULL;
  im->nskipped = (SbCount){0, 0};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportSetVertices(SbImport *im, PetscInt n)
{
  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * (size_t)n, &im->x));
  PetscCall(PetscMalloc1(n, &im->vert_number));
  for (PetscInt v = 0; v < n; v++)
    im->vert_number[v] = v + 1;
  im->nvert = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode resize_items(SbItems *item, int dim, PetscInt n)
{
  PetscFunctionBeginUser;
  PetscCall(PetscRealloc((size_t)n * (size_t)(dim + 1) * sizeof(PetscInt), &item->vert));
  PetscCall(PetscRealloc((size_t)n * sizeof(PetscInt), &item->tags));
  PetscCall(PetscRealloc((size_t)n * sizeof(int64_t), &item->number));
  item->capacity = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportAddItem(SbImport *im, int dim, const PetscInt vert[], PetscInt tags,
                               int64_t number)
{
  SbItems *item = &im->item[dim];

  PetscFunctionBeginUser;
  if (item->n == item->capacity)
    PetscCall(resize_items(item, dim, PetscMax(64, 2 * item->capacity)));
  for (int i = 0; i <= dim; i++)
    item->vert[(dim + 1) * item->n + i] = vert[i];
  item->tags[item->n] = tags;
  item->number[item->n++] = number;
  if (im->progress && !(item->n & 0xffff))
    PetscCall(im->progress(dim == 3 ? "tets" : "triangles", item->n, 0, im->progress_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportSetItems(SbImport *im, int dim, PetscInt n)
{
  SbItems *item = &im->item[dim];

  PetscFunctionBeginUser;
  PetscCall(resize_items(item, dim, n));
  for (PetscInt i = 0; i < n; i++)
    item->number[i] = i + 1;
  item->n = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbItemsMove(SbItems *item, int dim, PetscInt to, PetscInt from)
{
  memmove(item->vert + (dim + 1) * (size_t)to, item->vert + (dim + 1) * (size_t)from,
          (size_t)(dim + 1) * sizeof(*item->vert));
  item->tags[to] = item->tags[from];
  item->number[to] = item->number[from];
}

PetscErrorCode SbItemsFree(SbItems *item)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(item->vert));
  PetscCall(PetscFree(item->tags));
  PetscCall(PetscFree(item->number));
  item->n = item->capacity = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportAddElement(SbImport *im, int type, const PetscInt vert[], PetscInt tags,
                                  int64_t number)
{
  PetscBool keep = PETSC_FALSE;

  PetscFunctionBeginUser;
  im->count[type]++;
  if (type == SB_GMSH_TET10) {
    PetscCall(SbImportAddMiddles(im, vert));
    PetscCall(SbImportAddItem(im, 3, vert, tags, number));
  }
  if (type == SB_GMSH_LINE3)
    type = SB_GMSH_LINE;
  if (type == SB_GMSH_TRIANGLE6 && !im->surface)
    type = SB_GMSH_TRIANGLE;

  // what the mesh is made of, and lower items that are in groups
  if (type == SB_GMSH_TET)
    keep = PETSC_TRUE;
  else if (type == SB_GMSH_TRIANGLE)
    keep = (PetscBool)(im->surface || tags);
  else if (type == SB_GMSH_POINT || type == SB_GMSH_LINE)
    keep = (PetscBool)(tags != 0);
  if (keep)
    PetscCall(SbImportAddItem(im, SbGmshTypes[type].dim, vert, tags, number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbImportDropVertices(SbImport *im, PetscInt keep[])
{
  PetscInt n = 0;
  PetscInt nmiddle = 0;

  for (PetscInt v = 0; v < im->nvert; v++)
    keep[v] = keep[v] ? n++ : -1;
  if (n == im->nvert)
    return;
  for (PetscInt v = 0; v < im->nvert; v++) {
    if (keep[v] < 0)
      continue;
    for (int k = 0; k < 3; k++)
      im->x[3 * keep[v] + k] = im->x[3 * v + k];
    im->vert_number[keep[v]] = im->vert_number[v];
  }
  im->nvert = n;
  for (PetscInt i = 0; i < im->nmiddle.n; i++) {
    SbMiddle m = im->middle[i];

    for (int k = 0; k < 2; k++)
      m.end[k] = keep[m.end[k]];
    if (m.end[0] >= 0 && m.end[1] >= 0)
      im->middle[nmiddle++] = m;
  }
  im->nmiddle.n = nmiddle;
  for (int d = 0; d < 4; d++) {
    PetscInt kept = 0;

    // renumber the vertices of items, and drop items with a dropped vertex
    for (PetscInt i = 0; i < im->item[d].n; i++) {
      PetscInt *v = im->item[d].vert + (d + 1) * i;
      PetscBool gone = PETSC_FALSE;

      for (int k = 0; k <= d; k++) {
        v[k] = keep[v[k]];
        gone = (PetscBool)(gone || v[k] < 0);
      }
      if (!gone)
        SbItemsMove(&im->item[d], d, kept++, i);
    }
    if (d == 2)
      im->nlost += im->item[d].n - kept;
    im->item[d].n = kept;
  }
}

PetscErrorCode SbImportAddMiddles(SbImport *im, const PetscInt vert[])
{
  static const int place[6] = {4, 6, 7, 5, 9, 8}; /* nodes of the edges 01 02 03 12 13 23 */

  PetscFunctionBeginUser;
  for (int a = 0, e = 0; a < 4; a++) {
    for (int b = a + 1; b < 4; b++, e++) {
      if (vert[place[e]] < 0)
        continue;
      PetscCall(
        SbReserve(++im->nmiddle.n, sizeof(*im->middle), &im->nmiddle.capacity, &im->middle));
      im->middle[im->nmiddle.n - 1] = (SbMiddle){
        .end = {PetscMin(vert[a], vert[b]), PetscMax(vert[a], vert[b])}, .node = vert[place[e]]};
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportLostMiddle(const SbImport *im, const SbMiddle *m)
{
  PetscFunctionBeginUser;
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
          "%s: /mesh/curved_edges holds %lld and %lld in row %lld, which is no edge of a "
          "tetrahedron; remove "
          "the row, also of /mesh/edge_offsets",
          im->where, (long long)m->end[0], (long long)m->end[1], (long long)(-1 - m->node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Drops nodes of edges that no tet has; when a file lists them an error, unless found[] returns
   it. */
static PetscErrorCode drop_lost(SbImport *im, PetscBool found[])
{
  SbMiddle lost = {.node = -1};
  PetscInt n = 0;
  PetscInt *low, *start, *at;
  PetscBool *of_tet;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc2(im->nmiddle.n, &low, im->nmiddle.n, &of_tet));
  for (PetscInt i = 0; i < im->nmiddle.n; i++)
    low[i] = im->middle[i].end[0];
  PetscCall(SbBucketByKey(im->nmiddle.n, low, im->nvert, &start, &at));

  // only few edges have the same lower vertex
  for (PetscInt i = 0; i < 6 * im->item[3].n; i++) {
    const PetscInt *v = im->item[3].vert + 4 * (i / 6);
    const PetscInt a = v[SbTetEdge[i % 6][0]];
    const PetscInt b = v[SbTetEdge[i % 6][1]];

    for (PetscInt k = start[PetscMin(a, b)]; k < start[PetscMin(a, b) + 1]; k++)
      if (im->middle[at[k]].end[1] == PetscMax(a, b))
        of_tet[at[k]] = PETSC_TRUE;
  }
  if (found)
    PetscCall(PetscArraycpy(found, of_tet, im->nmiddle.n));
  for (PetscInt i = 0; i < im->nmiddle.n; i++)
    if (of_tet[i])
      im->middle[n++] = im->middle[i];
    else if (lost.node == -1)
      lost = im->middle[i];
  im->nmiddle.n = n;
  PetscCall(PetscFree2(low, of_tet));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(at));
  if (!found && lost.node < -1)
    PetscCall(SbImportLostMiddle(im, &lost));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportMiddles(SbImport *im, PetscBool found[], PetscReal *largest)
{
  SbMiddle *last = NULL;
  PetscReal most = 0;
  PetscInt n = 0;
  PetscInt row = 0;
  PetscInt *keep = NULL;

  PetscFunctionBeginUser;
  *largest = 0;
  if (!im->nmiddle.n)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (im->middle[0].node >= 0) {
    PetscCall(SbImportScratch(im, (size_t)im->nvert * sizeof(*keep), &keep));
    for (PetscInt v = 0; v < im->nvert; v++)
      keep[v] = 1;
  } else {
    PetscCall(drop_lost(im, found));
  }
  PetscCall(SbSortByKeys(im->nmiddle.n, sizeof(*im->middle), 3, im->middle));
  for (PetscInt i = 0; i < im->nmiddle.n; i++) {
    SbMiddle m = im->middle[i];
    const PetscReal *a = im->x + 3 * m.end[0];
    const PetscReal *b = im->x + 3 * m.end[1];
    const PetscInt before = row;
    PetscReal length = 0;
    PetscReal off = 0;
    PetscReal apart = 0;

    row = -1 - m.node;
    if (keep)
      keep[m.node] = 0;
    for (int k = 0; k < 3; k++) {
      if (m.node >= 0)
        m.off[k] = im->x[3 * m.node + k] - 0.5 * (a[k] + b[k]);
      length += PetscSqr(b[k] - a[k]);
      off += PetscSqr(m.off[k]);
    }

    // each edge once; its nodes in different tets must be at the same position
    if (last && last->end[0] == m.end[0] && last->end[1] == m.end[1]) {
      PetscCheck(row <= 0, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
                 "%s: /mesh/curved_edges holds the same edge in rows %lld and %lld; remove one of "
                 "them, also of "
                 "/mesh/edge_offsets",
                 im->where, (long long)row, (long long)before);
      for (int k = 0; k < 3; k++)
        apart += PetscSqr(m.off[k] - last->off[k]);
      PetscCheck(
        apart <= PetscSqr(STRAIGHT) * length, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
        "%s: the edge between nodes %lld and %lld has two nodes, at different places; make it one "
        "(gmsh: Coherence Mesh)",
        im->where, (long long)im->vert_number[m.end[0]], (long long)im->vert_number[m.end[1]]);
      continue;
    }
    m.node = -1;
    im->middle[n] = m;
    last = &im->middle[n];
    if (off > PetscSqr(STRAIGHT) * length && m.end[0] < m.end[1])
      n++;
    if (length > 0)
      most = PetscMax(most, off / length);
  }
  im->nmiddle.n = n;
  *largest = PetscSqrtReal(most);

  // drop vertices that are only edge nodes
  for (PetscInt i = 0; keep && i < 4 * im->item[3].n; i++)
    keep[im->item[3].vert[i]] = 1;
  if (keep)
    SbImportDropVertices(im, keep);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbImportNoteMiddles(SbImport *im, PetscInt n, PetscReal largest)
{
  if (n)
    SbImportRemark(im,
                   "edges with their node off the middle: %lld, by %.2g of their length at most",
                   (long long)n, (double)largest);
}

void SbImportRemark(SbImport *im, const char *format, ...)
{
  char text[sizeof(im->note)];
  va_list arguments;

  va_start(arguments, format);
  (void)vsnprintf(text, sizeof(text), format, arguments);
  va_end(arguments);
  SbAppend(sizeof(im->note), im->note, "%s%s", im->note[0] ? ", " : "", text);
}

PetscErrorCode SbImportSkip(SbImport *im, const char *format, ...)
{
  char name[SB_NAME_MAX];
  va_list arguments;
  PetscInt k = 0;

  PetscFunctionBeginUser;
  va_start(arguments, format);
  (void)vsnprintf(name, sizeof(name), format, arguments);
  va_end(arguments);
  SbCleanName(name, '?');
  while (k < im->nskipped.n && strcmp(im->skipped[k].name, name) != 0)
    k++;

  // a note names few kinds, what is left counts together
  if (k == im->nskipped.n && k < 8) {
    PetscCall(SbImportGrow(im, &im->nskipped, sizeof(*im->skipped), &im->skipped));
    (void)snprintf(im->skipped[k].name, sizeof(name), "%s", name);
    im->skipped[k].n = 0;
  } else if (k == im->nskipped.n) {
    (void)snprintf(im->skipped[--k].name, sizeof(name), "others");
  }
  im->skipped[k].n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbImportNoteSkipped(SbImport *im)
{
  if (im->nskipped.n)
    SbImportRemark(im, "not needed and left out: ");
  for (PetscInt k = 0; k < im->nskipped.n; k++)
    SbAppend(sizeof(im->note), im->note, "%s%s (%lld)", k ? ", " : "", im->skipped[k].name,
             (long long)im->skipped[k].n);
}

/* Number of a group among those of all dimensions. */
static int64_t number_of(PetscInt dim, int64_t tag)
{
  return (int64_t)((uint64_t)tag * 4 + (uint64_t)dim);
}

const char *const SbGroupKinds[4] = {"point", "curve", "surface", "volume"};

PetscErrorCode SbImportGroup(SbImport *im, PetscInt dim, int64_t tag, const char *name,
                             PetscInt *group)
{
  PetscInt g = SbNumbersFind(&im->groups, number_of(dim, tag));

  PetscFunctionBeginUser;
  if (g < 0) {
    g = im->ngroup++;
    PetscCall(SbNumbersAdd(&im->groups, number_of(dim, tag)));
    PetscCall(SbReserve(g + 1, sizeof(SbGroup), &im->capacity[0], &im->group));
    im->group[g] = (SbGroup){.dim = dim, .tag = tag, .alone = -1};
    (void)snprintf(im->group[g].name, SB_GROUP_MAX, "%s_%lld", SbGroupKinds[dim], (long long)tag);
  }
  if (name)
    PetscCall(PetscStrncpy(im->group[g].name, name, SB_GROUP_MAX));
  *group = g;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbImportNameGroup(SbImport *im, PetscInt dim, int64_t tag, const char *name)
{
  const PetscInt g = SbNumbersFind(&im->groups, number_of(dim, tag));

  if (g >= 0)
    (void)snprintf(im->group[g].name, SB_GROUP_MAX, "%s", name);
}

/* Appends a tag set. */
static PetscErrorCode add_tag_set(SbImport *im, PetscInt n, const PetscInt groups[], PetscInt *tags)
{
  const PetscInt start = im->tags_start[im->ntags];

  PetscFunctionBeginUser;
  PetscCall(SbReserve(start + n, sizeof(PetscInt), &im->capacity[2], &im->tags_group));
  PetscCall(SbReserve(im->ntags + 2, sizeof(PetscInt), &im->capacity[1], &im->tags_start));
  for (PetscInt i = 0; i < n; i++)
    im->tags_group[start + i] = groups[i];
  *tags = im->ntags;
  im->tags_start[++im->ntags] = start + n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportTagsAlone(SbImport *im, PetscInt dim, int64_t tag, const char *name,
                                 PetscInt *tags)
{
  PetscInt group;

  PetscFunctionBeginUser;
  PetscCall(SbImportGroup(im, dim, tag, name, &group));
  PetscCall(SbImportTagSet(im, 1, &group, tags));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportTagSet(SbImport *im, PetscInt n, PetscInt groups[], PetscInt *tags)
{
  PetscFunctionBeginUser;
  PetscCall(PetscSortRemoveDupsInt(&n, groups));

  /* set 0 is created by the first call */
  if (!im->ntags) {
    PetscCall(SbReserve(2, sizeof(PetscInt), &im->capacity[1], &im->tags_start));
    im->tags_start[0] = im->tags_start[1] = 0;
    im->ntags = 1;
  }
  if (n == 1 && im->group) {
    PetscInt *alone = &im->group[groups[0]].alone;

    if (*alone < 0)
      PetscCall(add_tag_set(im, 1, groups, alone));
    *tags = *alone;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (*tags = 0; *tags < im->ntags; (*tags)++) {
    const PetscInt start = im->tags_start[*tags];

    if (im->tags_start[*tags + 1] - start != n)
      continue;
    if (!n || !memcmp(groups, im->tags_group + start, (size_t)n * sizeof(PetscInt)))
      PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(add_tag_set(im, n, groups, tags));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportAddMember(SbImport *im, PetscInt dim, PetscInt item, PetscInt group)
{
  PetscFunctionBeginUser;
  PetscCall(SbImportGrow(im, &im->nmember, sizeof(*im->member), &im->member));
  im->member[im->nmember.n - 1] = (SbGroupMember){dim, item, group};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportJoinGroups(SbImport *im)
{
  const SbGroupMember *m, *end;
  PetscInt *group = NULL;

  PetscFunctionBeginUser;
  if (!im->nmember.n)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSortByKeys(im->nmember.n, sizeof(*m), 3, im->member));
  PetscCall(SbImportScratch(im, (size_t)(im->nmember.n + im->ngroup) * sizeof(*group), &group));
  end = im->member + im->nmember.n;
  for (m = im->member; m < end;) {
    const SbGroupMember *first = m;
    PetscInt *tags = &im->item[m->dim].tags[m->item];
    PetscInt n = 0;

    for (PetscInt i = im->tags_start[*tags]; i < im->tags_start[*tags + 1]; i++)
      group[n++] = im->tags_group[i];
    for (; m < end && m->dim == first->dim && m->item == first->item; m++)
      group[n++] = m->group;
    PetscCall(SbImportTagSet(im, n, group, tags));
  }
  im->nmember.n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportJoinRepeats(SbImport *im, int dim, PetscBool all, PetscInt *ndropped)
{
  SbItems *item = &im->item[dim];
  PetscInt *head, *next, *group;
  PetscInt kept = 0;

  PetscFunctionBeginUser;

  // linked lists of items by their lowest vertex
  PetscCall(PetscMalloc3(im->nvert, &head, item->n, &next, 2 * (size_t)im->ngroup, &group));
  for (PetscInt v = 0; v < im->nvert; v++)
    head[v] = -1;
  for (PetscInt i = 0; i < item->n; i++) {
    const PetscInt *v = item->vert + (dim + 1) * (size_t)i;
    PetscInt low = v[0];
    PetscInt same;
    PetscInt n = 0;
    PetscBool join = PETSC_FALSE;

    for (int a = 1; a <= dim; a++)
      low = PetscMin(low, v[a]);

    // an earlier item with the same vertices
    for (same = head[low]; same >= 0; same = next[same]) {
      const PetscInt *w = item->vert + (dim + 1) * (size_t)same;
      int nequal = 0;

      for (int a = 0; a <= dim; a++) {
        int b = 0;

        while (b <= dim && v[a] != w[b])
          b++;
        nequal += b <= dim;
      }
      if (nequal == dim + 1)
        break;
    }

    // join the groups of both items, unless they have one in common
    if (same >= 0) {
      const PetscInt *start = im->tags_start;
      const PetscInt own = item->tags[i];
      const PetscInt its = item->tags[same];

      for (PetscInt k = start[own]; k < start[own + 1]; k++)
        group[n++] = im->tags_group[k];
      join = (PetscBool)(all || n);
      for (PetscInt k = start[its]; k < start[its + 1]; k++) {
        for (PetscInt j = start[own]; j < start[own + 1]; j++)
          join = (PetscBool)(join && (all || im->tags_group[j] != im->tags_group[k]));
        group[n++] = im->tags_group[k];
      }
      if (join)
        PetscCall(SbImportTagSet(im, n, group, &item->tags[same]));
    }
    if (join)
      continue;
    SbItemsMove(item, dim, kept, i);
    next[kept] = head[low];
    head[low] = kept++;
  }
  if (ndropped)
    *ndropped += item->n - kept;
  item->n = kept;
  PetscCall(PetscFree3(head, next, group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const char *SbImportOption(const SbImport *im, const char *key, char name[SB_IMPORT_OPTION_MAX])
{
  const PetscBool alone = (PetscBool)!im->body[0];

  (void)snprintf(name, SB_IMPORT_OPTION_MAX, alone ? "-%s%s" : "-body_%s_%s", im->body,
                 alone && !strncmp(key, "tet_", 4) ? key + 4 : key);
  return name;
}

void SbImportParts(SbImport *im, SbImportPart part[SB_IMPORT_NPART])
{
  SbNumbers *groups = &im->groups;
  int n = 0;

  part[n++] = (SbImportPart){(void **)&im->x, 3 * (size_t)im->nvert * sizeof(*im->x)};
  part[n++] =
    (SbImportPart){(void **)&im->vert_number, (size_t)im->nvert * sizeof(*im->vert_number)};
  for (SbItems *item = im->item; item < im->item + 4; item++) {
    const size_t m = (size_t)item->n;
    const size_t nodes = (size_t)(item - im->item) + 1;

    part[n++] = (SbImportPart){(void **)&item->vert, m * nodes * sizeof(*item->vert)};
    part[n++] = (SbImportPart){(void **)&item->tags, m * sizeof(*item->tags)};
    part[n++] = (SbImportPart){(void **)&item->number, m * sizeof(*item->number)};
  }
  part[n++] = (SbImportPart){(void **)&im->middle, (size_t)im->nmiddle.n * sizeof(*im->middle)};
  part[n++] = (SbImportPart){(void **)&im->group, (size_t)im->ngroup * sizeof(*im->group)};
  part[n++] = (SbImportPart){(void **)&im->tags_start, (size_t)(im->ntags + 1) * sizeof(PetscInt)};
  part[n++] =
    (SbImportPart){(void **)&im->tags_group,
                   (size_t)(im->tags_start ? im->tags_start[im->ntags] : 0) * sizeof(PetscInt)};
  part[n++] = (SbImportPart){(void **)&groups->number, (size_t)groups->n * sizeof(*groups->number)};
  part[n++] = (SbImportPart){(void **)&groups->slot, (size_t)groups->nslot * sizeof(*groups->slot)};
}

PetscErrorCode SbImportKeep(SbImport *im, PetscInt n, const int64_t number[], int64_t first,
                            const double value[])
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree2(im->field_number, im->field_value));
  PetscCall(PetscMalloc2(n, &im->field_number, im->field_width * n, &im->field_value));
  im->nfield = n;
  for (PetscInt i = 0; i < n; i++)
    im->field_number[i] = number ? number[i] : first + i;
  for (PetscInt i = 0; i < im->field_width * n; i++)
    im->field_value[i] = value[i];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportDestroy(SbImport *im)
{
  SbImportPart part[SB_IMPORT_NPART];

  PetscFunctionBeginUser;
  PetscCall(SbImportForget(im));
  SbImportParts(im, part);
  for (int i = 0; i < SB_IMPORT_NPART; i++)
    PetscCall(PetscFree(*part[i].array));
  PetscCall(PetscFree2(im->field_number, im->field_value));
  PetscCall(PetscMemzero(im, sizeof(*im)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
