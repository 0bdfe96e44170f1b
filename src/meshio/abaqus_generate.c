/*
  abaqus_generate.c - nodes and elements that an Abaqus input file describes by rules (Abaqus
  Keywords Reference Guide): *NGEN (between two nodes, on a line, or with LINE=C at equal angles on
  the shorter arc around a centre), *NFILL (between two sets, at
  equal distances), *NCOPY (shifted), *ELGEN and *ELCOPY.

  Sets and nodes that a rule uses are defined before it. Errors: *NGEN on parabolas, and on arcs
  of half a circle and more, *NFILL with bias,
  *NCOPY turned or reflected, *ELCOPY reflected: files of these write the nodes instead.
*/
#include <stdlib.h>
#include <strings.h>
#include "abaqus.h"

#define SAME_RADIUS 1e-3       /* largest difference of two radii over their sum: printed digits */
#define STRAIGHT 1e-3          /* rad, below half a circle: the plane is lost in printed digits */
#define GENERATED_MOST 4000000 /* nodes and elements that all rules of a file make, at most */

/* Counts what a rule makes: a line of a damaged file may ask for any number. */
static PetscErrorCode count(SbAbaqus *a, int64_t n)
{
  PetscFunctionBeginUser;
  if (n < 0 || n > GENERATED_MOST || (a->generated += n) > GENERATED_MOST)
    SB_SCAN_ERROR(a->scan, "%s makes more than %d nodes or elements; write them instead",
                  a->keyword, GENERATED_MOST);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Labels stay below those of the next instance. */
static PetscErrorCode check_label(SbAbaqus *a, int64_t label)
{
  PetscFunctionBeginUser;
  if (label < a->scope || (label - a->scope) >> SB_ABAQUS_SCOPE)
    SB_SCAN_ERROR(a->scan, "%s makes the number %lld, which is too large", a->keyword,
                  (long long)(label - a->scope));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Error of a parameter that changes what the rule makes. */
static PetscErrorCode refuse(SbAbaqus *a, int n, const char *const names[])
{
  PetscFunctionBeginUser;
  for (int i = 0; i < n; i++)
    if (SbAbaqusParameter(a, names[i])) {
      a->scan->token = a->line;
      SB_SCAN_ERROR(a->scan,
                    "%s with %s: supple does not know this rule; write its nodes and elements "
                    "instead (Abaqus/CAE: import, then export the mesh)",
                    a->keyword, names[i]);
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Set that a parameter names, or -1. */
static PetscErrorCode named_set(SbAbaqus *a, PetscBool of_nodes, const char *parameter,
                                PetscInt *set)
{
  const char *name = SbAbaqusParameter(a, parameter);

  PetscFunctionBeginUser;
  *set = -1;
  if (name)
    PetscCall(SbAbaqusSet(a, of_nodes, name, set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode add_to(SbAbaqus *a, PetscInt set, int64_t label)
{
  PetscFunctionBeginUser;
  if (set >= 0)
    PetscCall(SbDeckAddRange(&a->deck, set, -1, label, label, 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Index of a node that is there already. */
static PetscErrorCode find_node(SbAbaqus *a, int64_t label, PetscInt *v)
{
  PetscFunctionBeginUser;
  *v = SbNumbersFind(&a->deck.im->nodes, a->scope + label);
  if (*v < 0)
    SB_SCAN_ERROR(a->scan, "%s uses node %lld, which no line above gives", a->keyword,
                  (long long)label);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The angle between two points on a circle, rad, below pi. */
static PetscErrorCode arc_angle(SbAbaqus *a, const PetscReal x[3], const PetscReal y[3],
                                const PetscReal centre[3], PetscReal *angle)
{
  PetscReal p[3], q[3], n[3], r[2];

  PetscFunctionBeginUser;
  SbSubtract(x, centre, p);
  SbSubtract(y, centre, q);
  SbCross(p, q, n);
  r[0] = PetscSqrtReal(SbDot3(p, p));
  r[1] = PetscSqrtReal(SbDot3(q, q));
  *angle = PetscAtan2Real(PetscSqrtReal(SbDot3(n, n)), SbDot3(p, q));
  if (!(PetscAbsReal(r[0] - r[1]) <= SAME_RADIUS * (r[0] + r[1])))
    SB_SCAN_ERROR(a->scan,
                  "*NGEN on an arc with the radii %g and %g at its ends; expected the same",
                  (double)r[0], (double)r[1]);
  if (*angle > PETSC_PI - STRAIGHT)
    SB_SCAN_ERROR(a->scan, "*NGEN on half a circle, whose plane is not known; generate two halves "
                           "of it, or write its nodes instead");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the nodes between u and v, in n steps, the number increasing by `step` each; centre: of the
   circle that they are on, NULL: a line. */
static PetscErrorCode fill(SbAbaqus *a, PetscInt u, PetscInt v, int64_t n, int64_t step,
                           const PetscReal centre[3], PetscInt set)
{
  SbImport *im = a->deck.im;
  const int64_t first = im->vert_number[u];
  PetscReal angle = 0.;

  PetscFunctionBeginUser;
  PetscCall(count(a, n));
  if (centre)
    PetscCall(arc_angle(a, im->x + 3 * u, im->x + 3 * v, centre, &angle));
  for (int64_t k = 1; k < n; k++) {
    const PetscReal s = (PetscReal)k / (PetscReal)n;
    PetscReal part[2] = {1 - s, s};
    PetscReal *x;

    // on an arc the two radii have other parts (spherical interpolation)
    if (centre && angle > 0)
      for (int i = 0; i < 2; i++)
        part[i] = PetscSinReal((i ? s : 1 - s) * angle) / PetscSinReal(angle);

    PetscCall(check_label(a, first + k * step));
    PetscCall(SbDeckAddNode(&a->deck, first + k * step, &x));
    for (int i = 0; i < 3; i++)
      x[i] = part[0] * im->x[3 * u + i] + part[1] * im->x[3 * v + i] +
             (centre ? (1 - part[0] - part[1]) * centre[i] : 0);
    PetscCall(add_to(a, set, first + k * step));
  }
  PetscCall(add_to(a, set, first));
  PetscCall(add_to(a, set, im->vert_number[v]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The centre of an arc: a node, or 0 and coordinates. */
static PetscErrorCode read_centre(SbAbaqus *a, PetscReal centre[3])
{
  int64_t node = 0;
  PetscReal value[6];
  PetscInt v;

  PetscFunctionBeginUser;
  PetscCall(SbAbaqusNumber(a, "centre of an arc", &node));
  PetscCall(SbAbaqusReals(a, "coordinate or normal", 6, value));
  if (value[3] != 0 || value[4] != 0 || value[5] != 0)
    SB_SCAN_ERROR(a->scan,
                  "*NGEN on an arc with a normal, of half a circle or more; generate parts "
                  "of it, or write its nodes instead");
  if (node) {
    PetscCall(find_node(a, node, &v));
    PetscCall(PetscArraycpy(centre, a->deck.im->x + 3 * v, 3));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  // coordinates are placed as those of nodes
  for (int i = 0; i < 3; i++)
    centre[i] = SbDot3(a->S[i], value) + a->o[i];
  for (int i = 0; i < 3; i++)
    value[i] = SbDot3(a->R[i], centre) + a->t[i];
  PetscCall(PetscArraycpy(centre, value, 3));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *NGEN: first node, last node, increment; on an arc: node in its centre, or 0 and its coordinates,
   and for half a circle and more the normal. */
static PetscErrorCode line_of_nodes(SbAbaqus *a)
{
  const char *line = SbAbaqusParameter(a, "LINE");
  const PetscBool arc = (PetscBool)(line && !strcasecmp(line, "C"));
  PetscInt set, u, v;

  PetscFunctionBeginUser;
  PetscCall(refuse(a, 2, (const char *const[]){"SYSTEM", arc ? "SYSTEM" : "LINE"}));
  PetscCall(named_set(a, PETSC_TRUE, "NSET", &set));
  while (SbAbaqusDataLine(a)) {
    int64_t first = 0;
    int64_t last = 0;
    int64_t step = 1;
    PetscReal centre[3];

    PetscCall(SbAbaqusNumber(a, "first node", &first));
    PetscCall(SbAbaqusNumber(a, "last node", &last));
    PetscCall(SbAbaqusNumber(a, "increment", &step));
    if (step < 1 || (last - first) % step || last <= first)
      SB_SCAN_ERROR(a->scan, "*NGEN from node %lld to %lld by %lld; expected whole steps upwards",
                    (long long)first, (long long)last, (long long)step);
    PetscCall(find_node(a, first, &u));
    PetscCall(find_node(a, last, &v));
    if (arc)
      PetscCall(read_centre(a, centre));
    PetscCall(fill(a, u, v, (last - first) / step, step, arc ? centre : NULL, set));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Labels of the members of a set so far, ascending, each once; free them. */
static PetscErrorCode members(SbAbaqus *a, PetscBool of_nodes, const char *name, PetscInt *n,
                              PetscInt64 **label)
{
  const SbNumbers *numbers = of_nodes ? &a->deck.im->nodes : &a->deck.im->elements;
  const char *token = a->scan->token;
  PetscInt set, m;

  PetscFunctionBeginUser;
  PetscCall(SbAbaqusSet(a, of_nodes, name, &set));
  PetscCall(SbDeckFind(&a->deck, set));
  a->scan->token = token;
  m = a->deck.nfound.n;
  if (!m)
    SB_SCAN_ERROR(a->scan, "%s uses the set '%s', which has no members in the lines above",
                  a->keyword, name);
  PetscCall(PetscMalloc1(m, label));
  for (PetscInt i = 0; i < m; i++)
    (*label)[i] = (PetscInt64)numbers->number[a->deck.found[i]];
  PetscCall(PetscSortInt64(m, *label));
  *n = 1;
  for (PetscInt i = 1; i < m; i++)
    if ((*label)[i] != (*label)[*n - 1])
      (*label)[(*n)++] = (*label)[i];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *NFILL: set of nodes, opposite set, number of intervals, increment. */
static PetscErrorCode between_sets(SbAbaqus *a)
{
  PetscInt set;

  PetscFunctionBeginUser;
  PetscCall(refuse(a, 3, (const char *const[]){"BIAS", "SINGULAR", "TWO STEP"}));
  PetscCall(named_set(a, PETSC_TRUE, "NSET", &set));
  while (SbAbaqusDataLine(a)) {
    char name[2][SB_ABAQUS_WORD] = {"", ""};
    PetscInt64 *label[2] = {NULL, NULL};
    PetscInt n[2] = {0, 0};
    int64_t nstep = 0;
    int64_t step = 1;
    PetscErrorCode ierr = PETSC_SUCCESS;

    (void)SbAbaqusNext(a, name[0]);
    (void)SbAbaqusNext(a, name[1]);
    PetscCall(SbAbaqusNumber(a, "number of intervals", &nstep));
    PetscCall(SbAbaqusNumber(a, "increment", &step));
    for (int k = 0; k < 2 && !ierr; k++)
      ierr = members(a, PETSC_TRUE, name[k], &n[k], &label[k]);
    for (PetscInt i = 0; i < n[0] && n[0] == n[1] && !ierr; i++)
      ierr = fill(a, SbNumbersFind(&a->deck.im->nodes, label[0][i]),
                  SbNumbersFind(&a->deck.im->nodes, label[1][i]), nstep, step, NULL, set);
    PetscCall(PetscFree(label[0]));
    PetscCall(PetscFree(label[1]));
    PetscCall(ierr);
    if (n[0] != n[1] || nstep < 1 || step < 1)
      SB_SCAN_ERROR(a->scan,
                    "*NFILL between %lld and %lld nodes in %lld intervals by %lld; expected equal "
                    "numbers, and at least one",
                    (long long)n[0], (long long)n[1], (long long)nstep, (long long)step);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *NCOPY, SHIFT: translation on the first line; a rotation on the second one is refused. */
static PetscErrorCode copy_nodes(SbAbaqus *a)
{
  SbImport *im = a->deck.im;
  const char *old = SbAbaqusParameter(a, "OLD SET");
  const char *by = SbAbaqusParameter(a, "CHANGE NUMBER");
  const char *multiple = SbAbaqusParameter(a, "MULTIPLE");
  const int64_t change = by ? strtoll(by, NULL, 10) : 0;
  const int64_t most = multiple ? strtoll(multiple, NULL, 10) : 1;
  PetscReal shift[3] = {0, 0, 0};
  PetscReal turn[7] = {0};
  PetscReal moved[3] = {0, 0, 0};
  PetscInt64 *label = NULL;
  PetscInt set;
  PetscInt n = 0;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBeginUser;
  PetscCall(refuse(a, 2, (const char *const[]){"REFLECT", "POLE"}));
  if (!old || !SbAbaqusParameter(a, "SHIFT") || change < 1 || change >> 31 || most < 1 ||
      most > GENERATED_MOST)
    SB_SCAN_ERROR(a->scan, "*NCOPY needs OLD SET, CHANGE NUMBER of 1 and more, and SHIFT");
  PetscCall(named_set(a, PETSC_TRUE, "NEW SET", &set));
  if (SbAbaqusDataLine(a)) {
    PetscCall(SbAbaqusReals(a, "shift", 3, shift));
    if (SbAbaqusDataLine(a))
      PetscCall(SbAbaqusReals(a, "rotation", 7, turn));
  }
  if (turn[6] != 0)
    SB_SCAN_ERROR(a->scan, "*NCOPY with a rotation: supple knows shifts only; write its nodes "
                           "instead");
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      moved[i] += a->R[i][j] * shift[j];
  PetscCall(members(a, PETSC_TRUE, old, &n, &label));
  for (int64_t c = 1; c <= most && !ierr; c++)
    for (PetscInt i = 0; i < n && !ierr; i++) {
      const PetscInt v = SbNumbersFind(&im->nodes, label[i]);
      PetscReal *x;

      ierr = count(a, 1);
      if (!ierr)
        ierr = check_label(a, label[i] + c * change);
      if (!ierr)
        ierr = SbDeckAddNode(&a->deck, label[i] + c * change, &x);
      for (int k = 0; k < 3 && !ierr; k++)
        x[k] = im->x[3 * v + k] + (PetscReal)c * moved[k];
      if (!ierr)
        ierr = add_to(a, set, label[i] + c * change);
    }
  PetscCall(PetscFree(label));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a copy of element e, its number and those of its nodes increased. */
static PetscErrorCode copy_element(SbAbaqus *a, PetscInt e, int64_t number, int64_t nodes,
                                   PetscInt set)
{
  SbDeckElement copy = a->deck.element[e];

  PetscFunctionBeginUser;
  PetscCall(count(a, 1));
  copy.label += number;
  copy.at = a->scan->token;
  PetscCall(check_label(a, copy.label));
  for (int k = 0; k < PetscMin(10, SbGmshTypes[copy.type].nnode); k++)
    copy.node[k] += nodes;
  PetscCall(SbDeckAddElement(&a->deck, &copy));
  PetscCall(add_to(a, set, copy.label));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *ELGEN: master element, then for rows, columns and layers: number, increment of the nodes, of
   the elements. */
static PetscErrorCode rows_of_elements(SbAbaqus *a)
{
  PetscInt set;

  PetscFunctionBeginUser;
  PetscCall(named_set(a, PETSC_FALSE, "ELSET", &set));
  while (SbAbaqusDataLine(a)) {
    int64_t master = 0;
    int64_t value[3][3] = {{1, 1, 1}, {1, 0, 0}, {1, 0, 0}};
    PetscInt e;

    PetscCall(SbAbaqusNumber(a, "master element", &master));
    for (int k = 0; k < 9; k++)
      PetscCall(SbAbaqusNumber(a, "number or increment", &value[k / 3][k % 3]));
    e = SbNumbersFind(&a->deck.im->elements, a->scope + master);
    if (e < 0)
      SB_SCAN_ERROR(a->scan, "*ELGEN copies element %lld, which no line above gives",
                    (long long)master);
    for (int k = 0; k < 3; k++) {
      value[k][0] = PetscMax(value[k][0], 1);
      PetscCall(count(a, value[k][0] > GENERATED_MOST ? value[k][0] : 0));
    }
    for (int64_t i = 0; i < value[0][0]; i++)
      for (int64_t j = 0; j < value[1][0]; j++)
        for (int64_t k = 0; k < value[2][0]; k++)
          if (i || j || k)
            PetscCall(copy_element(a, e, i * value[0][2] + j * value[1][2] + k * value[2][2],
                                   i * value[0][1] + j * value[1][1] + k * value[2][1], set));
    PetscCall(add_to(a, set, a->scope + master));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode copy_elements(SbAbaqus *a)
{
  const char *old = SbAbaqusParameter(a, "OLD SET");
  const char *number = SbAbaqusParameter(a, "ELEMENT SHIFT");
  const char *nodes = SbAbaqusParameter(a, "SHIFT NODES");
  const int64_t shift[2] = {number ? strtoll(number, NULL, 10) : 0,
                            nodes ? strtoll(nodes, NULL, 10) : 0};
  PetscInt64 *label = NULL;
  PetscInt set;
  PetscInt n = 0;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBeginUser;
  PetscCall(refuse(a, 1, (const char *const[]){"REFLECT"}));
  if (!old || shift[0] < 1 || shift[1] < 0 || (shift[0] | shift[1]) >> 31)
    SB_SCAN_ERROR(a->scan, "*ELCOPY needs OLD SET, and ELEMENT SHIFT of 1 and more");
  PetscCall(named_set(a, PETSC_FALSE, "NEW SET", &set));
  PetscCall(members(a, PETSC_FALSE, old, &n, &label));
  for (PetscInt i = 0; i < n && !ierr; i++)
    ierr = copy_element(a, SbNumbersFind(&a->deck.im->elements, label[i]), shift[0], shift[1], set);
  PetscCall(PetscFree(label));
  PetscCall(ierr);
  SbScanEndOfLine(a->scan);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbAbaqusGenerate(SbAbaqus *a, PetscBool *known)
{
  static const struct {
    const char *keyword;
    PetscErrorCode (*make)(SbAbaqus *);
  } rules[] = {{"*NGEN", line_of_nodes},
               {"*NFILL", between_sets},
               {"*NCOPY", copy_nodes},
               {"*ELGEN", rows_of_elements},
               {"*ELCOPY", copy_elements}};

  PetscFunctionBeginUser;
  *known = PETSC_FALSE;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(rules) && !*known; i++)
    if (!strcasecmp(a->keyword, rules[i].keyword)) {
      *known = PETSC_TRUE;
      PetscCall((*rules[i].make)(a));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}
