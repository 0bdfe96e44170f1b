/*
  deck.c - mesh from nodes, elements and sets listed by labels in any order: all are collected, then
  converted.

  Common part of the Abaqus, Nastran and universal file readers. A set may refer to nodes, elements
  and sets that are defined later, hence its members are found after the whole file has been read.
*/
#include "meshio_impl.h"

PetscErrorCode SbDeckAddNode(SbDeck *d, int64_t label, PetscReal **x)
{
  SbImport *im = d->im;

  PetscFunctionBeginUser;
  PetscCheck(im->nvert < PETSC_MAX_INT / 8, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: has more nodes than this build can number", im->where);
  if (SbNumbersFind(&im->nodes, label) >= 0)
    SB_SCAN_ERROR(&im->scan, "node %lld is given twice; %s", SbDeckShown(d, label), d->cure);
  PetscCall(SbNumbersAdd(&im->nodes, label));
  PetscCall(SbReserve(im->nvert + 1, 3 * sizeof(*im->x), &d->capacity[0], &im->x));
  PetscCall(SbReserve(im->nvert + 1, sizeof(*im->vert_number), &d->capacity[1], &im->vert_number));
  im->vert_number[im->nvert] = label;
  *x = im->x + 3 * im->nvert++;
  PetscCall(PetscArrayzero(*x, 3));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDeckAddElement(SbDeck *d, const SbDeckElement *element)
{
  PetscFunctionBeginUser;
  if (d->unique && SbNumbersFind(&d->im->elements, element->label) >= 0)
    SB_SCAN_ERROR(&d->im->scan, "element %lld is given twice; %s", SbDeckShown(d, element->label),
                  d->cure);
  PetscCall(SbNumbersAdd(&d->im->elements, element->label));
  d->im->count[element->type]++;
  PetscCall(SbImportGrow(d->im, &d->nelement, sizeof(*element), &d->element));
  d->element[d->nelement.n - 1] = *element;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDeckFindSet(SbDeck *d, PetscBool of_nodes, const char *name, PetscInt *set)
{
  PetscFunctionBeginUser;
  for (*set = 0; *set < d->nset.n; (*set)++)
    if (d->set[*set].of_nodes == of_nodes && !(*d->compare)(d->set[*set].name, name))
      PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbImportGrow(d->im, &d->nset, sizeof(*d->set), &d->set));
  d->set[*set] = (SbDeckSet){.of_nodes = of_nodes};
  (void)snprintf(d->set[*set].name, SB_GROUP_MAX, "%s", name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDeckAddRange(SbDeck *d, PetscInt set, PetscInt other, int64_t first, int64_t last,
                              int64_t step)
{
  SbDeckSet *s = &d->set[set];
  SbDeckRange *before = s->nrange.n ? &s->range[s->nrange.n - 1] : NULL;
  const PetscBool labels = (PetscBool)(other < 0 && step == 1);
  const PetscBool follows =
    (PetscBool)(before && before->set < 0 && before->step == 1 && first == before->last + 1);

  PetscFunctionBeginUser;

  /* merge consecutive labels into one range, unless messages need the line of each label */
  if (labels && follows && !d->strict)
    before->last = last;
  else {
    PetscCall(SbImportGrow(d->im, &s->nrange, sizeof(*s->range), &s->range));
    s->range[s->nrange.n - 1] = (SbDeckRange){first, last, step, other, d->im->scan.token};
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends the indices of the nodes or elements in a range to deck->found. */
static PetscErrorCode find_range(SbDeck *d, const SbDeckSet *set, const SbDeckRange *r)
{
  SbImport *im = d->im;
  const SbNumbers *numbers = set->of_nodes ? &im->nodes : &im->elements;
  const int64_t length = (r->last - r->first) / r->step + 1;
  const PetscBool all =
    (PetscBool)(length > numbers->n); /* then test nodes or elements, not labels */
  const int64_t n = all ? numbers->n : length;
  const PetscInt before = d->nfound.n;

  PetscFunctionBeginUser;

  /* nested sets could multiply the members of a damaged file: limit the number */
  im->scan.token = r->at;
  d->nlooked += n;
  if (d->nlooked > 64 * PetscSqr(PetscMax(d->nscope, 1)) * (int64_t)(im->scan.end - im->scan.data))
    SB_SCAN_ERROR(
      &im->scan,
      "the sets have more than %lld members, more than a file of this size can mean; it is damaged",
      (long long)(d->nlooked - n));
  for (int64_t i = 0; i < n; i++) {
    int64_t label = r->first + i * r->step;
    PetscInt at = (PetscInt)i;

    if (all) {
      label = numbers->number[i];
      if (label < r->first || label > r->last || (label - r->first) % r->step)
        continue;
    } else
      at = SbNumbersFind(numbers, label);
    if (at < 0 && d->strict && set->of_nodes)
      SB_SCAN_ERROR(&im->scan, "group '%s' lists node %lld, which is not there", set->name,
                    (long long)label);
    if (at < 0)
      continue;
    PetscCall(SbImportGrow(im, &d->nfound, sizeof(*d->found), &d->found));
    d->found[d->nfound.n - 1] = at;
  }

  // what a set lists and the file does not hold is not left out silently
  if (d->strict && length > d->nfound.n - before) {
    if (set->of_nodes)
      SB_SCAN_ERROR(&im->scan, "group '%s' lists nodes %lld to %lld, of which only %lld are there",
                    set->name, (long long)r->first, (long long)r->last,
                    (long long)(d->nfound.n - before));
    PetscCall(SbImportSkip(im, "list with missing elements of group '%.40s'", set->name));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDeckFind(SbDeck *d, PetscInt s)
{
  PetscInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(SbImportScratch(d->im, (size_t)d->nset.n * sizeof(*d->stack), &d->stack));
  PetscCall(SbImportScratch(d->im, (size_t)d->nset.n * sizeof(*d->seen), &d->seen));
  PetscCall(PetscArrayzero(d->seen, d->nset.n));
  d->nfound.n = 0;
  d->seen[s] = PETSC_TRUE;
  d->stack[n++] = s;
  while (n) {
    const SbDeckSet *set = &d->set[d->stack[--n]];

    for (PetscInt i = 0; i < set->nrange.n; i++) {
      const PetscInt other = set->range[i].set;

      if (other < 0)
        PetscCall(find_range(d, set, &set->range[i]));
      else if (!d->seen[other]) {
        d->seen[other] = PETSC_TRUE;
        d->stack[n++] = other;
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDeckBuild(SbDeck *d)
{
  SbImport *im = d->im;
  PetscInt *point = NULL; /* [nvert] item of each node that is in a set, -1: none */
  PetscInt group;

  PetscFunctionBeginUser;
  PetscCall(SbImportCheckTypes(im));

  // simplices, with the groups of their properties
  for (PetscInt e = 0; e < d->nelement.n; e++) {
    SbDeckElement *element = &d->element[e];
    const int dim = SbGmshTypes[element->type].dim;
    const PetscBool ten = (PetscBool)(element->type == SB_GMSH_TET10);
    PetscInt vert[10] = {0};
    PetscInt tags = 0;

    element->item = -1;
    if (!SbGmshIsSimplex(element->type))
      continue;
    im->scan.token = element->at;
    for (int k = 0; k < (ten ? 10 : dim + 1); k++) {
      const PetscInt v = SbNumbersFind(&im->nodes, element->node[k]);

      vert[SbGmshNode(k)] = v;
      if (v < 0 &&
          (k < 4 || element->node[k] || d->strict)) // Nastran may omit nodes of straight edges
        SB_SCAN_ERROR(&im->scan, "element %lld uses node %lld, which is not there",
                      SbDeckShown(d, element->label), SbDeckShown(d, element->node[k]));
    }
    if (element->property >= 0)
      PetscCall(SbImportTagsAlone(im, dim, element->property, NULL, &tags));
    element->item = im->item[dim].n;
    PetscCall(SbImportAddItem(im, dim, vert, tags, SbDeckShown(d, element->label)));
    if (ten)
      PetscCall(SbImportAddMiddles(im, vert));
  }

  // sets become groups of their members; each node of a set becomes a point item
  PetscCall(SbImportScratch(im, (size_t)im->nvert * sizeof(*point), &point));
  for (PetscInt v = 0; v < im->nvert; v++)
    point[v] = -1;
  for (PetscInt s = 0; s < d->nset.n; s++) {
    PetscCall(SbDeckFind(d, s));
    for (PetscInt i = 0; i < d->nfound.n; i++) {
      const PetscInt at = d->found[i];
      int dim = 0;

      if (!d->set[s].of_nodes) {
        dim = SbGmshTypes[d->element[at].type].dim;
        if (d->element[at].item < 0)
          continue;
      } else if (point[at] < 0) {
        point[at] = im->item[0].n;
        PetscCall(SbImportAddItem(im, 0, &at, 0, SbDeckShown(d, im->vert_number[at])));
      }
      PetscCall(SbImportGroup(im, dim, SB_DECK_TAG + s, d->set[s].name, &group));
      PetscCall(SbImportAddMember(im, dim, dim ? d->element[at].item : point[at], group));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
