/*
  Probes: what history.csv follows at a point, or as a mean over facets or tets. Each is a list of
  nodes with weights for vectors, sum_i w_i x_i, and one of tets with weights for what tets have.

  At a point: the vertex, or node of P2, nearest to it in the rest state; of equally near ones that
  with the smallest original number. Vectors are what vertex fields show there: the unknown of P1
  and P2, the mean of the cells around it for CR and DG; stresses are recovered
  (fem/nodal_stress.c), other quantities of tets are means over the tets around it, by volume. On a
  set: the mean over its boundary facets, by area at rest; in a set: over its tets, by volume at
  rest. Both integrate the basis functions, so they are exact for each element; a facet has what its
  tet has.

  A probe at a point follows the material that is there. When its body is re-meshed and the vertex
  is gone, it shows what the tet has that holds the position at rest. Checkpoints carry the position
  (SbProbesWrite).
*/
#include <ctype.h>
#include <math.h>
#include <stddef.h>
#include "output_impl.h"

/* Numbers of a probe in a checkpoint: the position, the body. */
#define NNUMBER 4
static const char *const number_names[NNUMBER] = {"x", "y", "z", "body"};

static const char *const keys[] = {"at", "on",
                                   "in"}; /* options that say where it is, by SbProbeKind */

const SbOption SbProbeRows[] = {
  {"at", SB_OPTION_REALS, 3, "m", NULL, "(-inf, inf)",
   "position of the probe in the reference configuration (after scale, rotate, translate); the "
   "nearest "
   "vertex is taken, of p2 also the middle of an edge"},
  {"on", SB_OPTION_STRING, 1, "", "", "",
   "instead of a position: mean over the boundary facets of this set (of -sets, a physical group, "
   "a body, "
   "boundary), weighted by reference area"},
  {"in", SB_OPTION_STRING, 1, "", "", "",
   "instead of a position: mean over the tets of this set, weighted by reference volume"},
  {"fields", SB_OPTION_NAMES, 1, "", "displacement", "",
   "columns of history.csv: displacement, position, velocity, acceleration, stress, von_mises, "
   "pressure, "
   "mean_pressure, J, energy_density; stresses at a vertex are recovered ones, other quantities of "
   "tets averaged over the tets around it, or behind the facets"},
  {0},
};

/* Names are parts of columns of history.csv: letters, digits and underscores, each once. */
static PetscErrorCode check_name(PetscInt p, const char (*names)[SB_NAME_MAX])
{
  PetscBool fine = (PetscBool)(isalpha((unsigned char)names[p][0]) != 0);

  PetscFunctionBeginUser;
  for (const char *c = names[p]; *c; c++)
    fine = (PetscBool)(fine && (isalnum((unsigned char)*c) || *c == '_'));
  PetscCheck(fine, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-probes: the name '%s' may hold letters, digits and underscores only, a letter first",
             names[p]);
  for (PetscInt i = 0; i < p; i++)
    PetscCheck(strcasecmp(names[i], names[p]), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
               "-probes: two are named '%s'", names[p]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbProbesSetFromOptions(SbOutput out, PetscBool dynamic)
{
  char(*names)[SB_NAME_MAX], (*fields)[SB_NAME_MAX], option[2 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(SbOptionNames(&SbRunScope, "probes", &out->nprobe, &names));
  PetscCall(PetscCalloc1(out->nprobe, &out->probe));
  for (PetscInt p = 0; p < out->nprobe; p++) {
    SbProbe *probe = &out->probe[p];
    PetscInt n = 0;
    PetscBool given;
    SbScope scope;

    /* its position or set */
    PetscCall(PetscStrncpy(probe->name, names[p], SB_NAME_MAX));
    PetscCall(check_name(p, (const char(*)[SB_NAME_MAX])names));
    SbScopeSet(&scope, "probe", "", probe->name);
    for (int k = 0; k < 3; k++) {
      PetscCall(SbOptionGiven(&scope, keys[k], &given));
      if (given)
        probe->kind = (SbProbeKind)k;
      n += given;
    }
    PetscCheck(n == 1, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
               "-probe_%s_at, _on, _in: give one of them, the position of a vertex, or a set over "
               "whose facets "
               "or tets the mean is taken",
               probe->name);
    if (probe->kind == SB_PROBE_POINT)
      PetscCall(SbOptionReals(&scope, "at", probe->at));
    else
      PetscCall(SbOptionString(&scope, keys[probe->kind], sizeof(probe->set), probe->set));

    /* the fields */
    SbOptionName(&scope, "fields", sizeof(option), option);
    PetscCall(SbOptionNames(&scope, "fields", &n, &fields));
    PetscCheck(n > 0 && n <= SB_FIELD_MAX, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
               "%s: %" PetscInt_FMT " fields; 1 to %d are possible", option, n, SB_FIELD_MAX);
    for (PetscInt i = 0; i < n; i++) {
      const SbField *f;

      PetscCall(SbFieldFind(option, fields[i], &f));
      PetscCheck(SbFieldIsProbed(f), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
                 "%s: probes do not follow '%s'; forces of supports and of contact have columns of "
                 "their effects",
                 option, fields[i]);
      PetscCheck(dynamic || !f->dynamic, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
                 "%s: a static run has no '%s'", option, fields[i]);
      probe->field[probe->nfield++] = f;
    }
    PetscCall(PetscFree(fields));
  }
  PetscCall(PetscFree(names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers of nodes at edges, SbSpace.node_orig, begin here. */
static PetscInt first_edge(const SbSpace s)
{
  return s->mesh->Nvert + 8 * s->mesh->Ncell;
}

/* The nearest of all ranks, by the lowest number if equal: its local number on its rank, -1 on the
   others. */
static PetscErrorCode agree(SbOutput out, PetscReal mine, PetscInt original, PetscInt *local,
                            PetscInt *winner, PetscReal *best)
{
  PetscInt candidate = PETSC_MAX_INT;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(&mine, best, 1, MPIU_REAL, MPI_MIN, out->comm));
  if (*local >= 0 && mine == *best)
    candidate = original;
  PetscCallMPI(MPI_Allreduce(&candidate, winner, 1, MPIU_INT, MPI_MIN, out->comm));
  if (candidate != *winner || *winner == PETSC_MAX_INT)
    *local = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The vertex or node at an edge nearest to a probe, of its body once that is known: squared
   distance, and into the probe its original and, on its owner, its local number: of a vertex, or
   nvert_owned behind a node's. */
static PetscErrorCode find_nearest(const SbSpace s, SbOutput out, SbProbe *probe, PetscReal *best)
{
  const SbMesh mesh = s->mesh;
  PetscReal mine = PETSC_MAX_REAL;
  PetscInt original = -1;

  PetscFunctionBeginUser;
  probe->local = -1;
  for (PetscInt i = 0; i < mesh->nvert_owned + (s->edge_node ? s->nnode_owned : 0); i++) {
    const PetscInt node = i - mesh->nvert_owned;
    const PetscInt number = node < 0 ? mesh->vert_orig[i] : s->node_orig[node];
    const PetscReal d2 = SbDistance2(node < 0 ? mesh->x + 3 * i : s->node_x + 3 * node,
                                     probe->found ? probe->x : probe->at);

    if (node >= 0 && number < first_edge(s))
      continue;
    if (probe->found && (node < 0 ? mesh->vert_body[i] : s->node_body[node]) != probe->body)
      continue;
    if (d2 < mine || (d2 == mine && number < original)) {
      mine = d2;
      original = number;
      probe->local = i;
    }
  }
  PetscCall(agree(out, mine, original, &probe->local, &probe->original, best));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The owned cell of a probe's body with its point, or the nearest: distance (negative inside),
   weights. */
static PetscReal deepest_owned(const SbMesh mesh, const SbProbe *probe, PetscInt *cell,
                               PetscReal weight[4])
{
  PetscReal best = PETSC_MAX_REAL;

  *cell = -1;
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    PetscReal w[4], outside;

    if (mesh->cell_body[c] != probe->body)
      continue;
    SbTetBarycentric(mesh->x, mesh->cell + 4 * c, probe->x, w);
    if (mesh->cell_set[c] & SB_CURVED &&
        !SbTetCurvedBarycentric(mesh->x, mesh->cell + 4 * c, mesh->edge_off + 18 * c, probe->x, w))
      continue;
    outside = -PetscMin(PetscMin(w[0], w[1]), PetscMin(w[2], w[3]));
    if (outside > best || (outside == best && mesh->cell_orig[c] > mesh->cell_orig[*cell]))
      continue;
    best = outside;
    *cell = c;
    for (int a = 0; a < 4; a++)
      weight[a] = w[a];
  }
  return best;
}

static PetscErrorCode add(SbSum *sum, PetscInt number, PetscReal weight)
{
  PetscFunctionBeginUser;
  PetscCall(SbReserve(sum->n + 1, sizeof(*sum->item), &sum->size, &sum->item));
  sum->item[sum->n].number = number;
  sum->item[sum->n++].weight = weight;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a cell and its nodes: L weights of its corners, Q those of the nodes of P2. */
static PetscErrorCode add_cell(const SbSpace s, SbProbe *probe, PetscInt cell, PetscReal weight,
                               const PetscReal L[4], const PetscReal Q[SB_CELL_NODES])
{
  const SbElement e = SbSpaceCellElement(s, cell);
  const PetscBool quadratic = (PetscBool)(e->nodes_per[1] > 0);

  PetscFunctionBeginUser;
  PetscCall(add(&probe->cells, cell, weight));
  for (PetscInt a = 0; a < (quadratic ? SB_CELL_NODES : 4); a++) {
    PetscReal w = quadratic ? Q[a] : 0.;

    for (int c = 0; c < 4 && !quadratic; c++)
      w += SbSpaceCornerBasis(s, cell, c)[a] * L[c];
    PetscCall(add(&probe->nodes, SbSpaceCellNode(s, cell, a), w));
    if (probe->kind == SB_PROBE_POINT)
      PetscCall(add(&probe->stresses, SB_CELL_NODES * cell + a, quadratic ? w : L[a]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Integrals over the facets or tets of a set; each tet on its owner. */
static PetscErrorCode sum_set(SbRun run, SbProbe *probe)
{
  const SbSpace s = run->model->space;
  const SbMesh mesh = s->mesh;
  SbFacet *facet = NULL;
  PetscInt k;
  PetscInt n = mesh->ncell_owned;
  char option[2 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(option, sizeof(option), "-probe_%s_%s", probe->name, keys[probe->kind]));
  PetscCall(SbSpaceFindSet(s, probe->set, option, &k));
  if (probe->kind == SB_PROBE_FACETS)
    PetscCall(SbSpaceGetSetFacets(s, k, &n, &facet));
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt cell = facet ? facet[i].cell : i;
    PetscReal L[4] = {0., 0., 0., 0.};
    PetscReal Q[SB_CELL_NODES] = {0.};
    PetscReal measure = 0.;

    if (cell >= mesh->ncell_owned || (!facet && !(mesh->cell_set[cell] & SB_SET_BIT(k))))
      continue;

    /* integrals of the basis functions: over a facet of P2 they are those of its edges alone */
    if (facet) {
      measure = facet[i].area;
      for (int c = 0; c < 3; c++)
        L[facet[i].corner[c]] = measure / 3.;
      for (int e = 0; e < 6; e++)
        Q[4 + e] =
          SbTetEdge[e][0] == facet[i].face || SbTetEdge[e][1] == facet[i].face ? 0. : measure / 3.;
    } else {
      measure = SbTetDeterminant(mesh->x, mesh->cell + 4 * cell) / 6.;
      for (int c = 0; c < 4; c++)
        L[c] = measure / 4.;
      for (int a = 0; a < SB_CELL_NODES; a++)
        Q[a] = measure * (a < 4 ? -0.05 : 0.2);
    }
    if (mesh->cell_set[cell] & SB_CURVED)
      measure = SbSpaceCurvedIntegrals(s, cell, facet ? &facet[i] : NULL, Q);
    PetscCall(add_cell(s, probe, cell, measure, L, Q));
  }
  PetscCall(PetscFree(facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On the first mesh the nearest vertex or node; later that at the probe's rest position, or the tet
   there. */
static PetscErrorCode find_point(const SbSpace s, SbOutput out, SbProbe *probe)
{
  const SbMesh mesh = s->mesh;
  PetscReal mine, best;
  PetscReal here[3] = {0., 0., 0.};
  PetscReal L[4] = {0., 0., 0., 0.};
  PetscReal Q[SB_CELL_NODES];
  PetscInt cell, tet;
  PetscInt body = -1;

  PetscFunctionBeginUser;
  PetscCall(find_nearest(s, out, probe, &best));
  if (!probe->found) {
    if (probe->local >= 0) {
      const PetscInt node = probe->local - mesh->nvert_owned;

      PetscCall(
        PetscArraycpy(here, node < 0 ? mesh->x + 3 * probe->local : s->node_x + 3 * node, 3));
      body = node < 0 ? mesh->vert_body[probe->local] : s->node_body[node];
    }
    PetscCallMPI(MPI_Allreduce(here, probe->x, 3, MPIU_REAL, MPI_SUM, out->comm));
    PetscCallMPI(MPI_Allreduce(&body, &probe->body, 1, MPIU_INT, MPI_MAX, out->comm));
    probe->found = PETSC_TRUE;
    if (SbBodyFarFrom(mesh->nbody, mesh->body, probe->at, &best))
      PetscCall(SbWarning(out->comm,
                          "-probe_%s_at %g,%g,%g is %.3g m outside of the nearest body's box: the "
                          "probe follows the nearest vertex",
                          probe->name, (double)probe->at[0], (double)probe->at[1],
                          (double)probe->at[2], (double)best));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (best == 0.)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* the basis functions in the tet */
  probe->local = probe->original = -1;
  mine = deepest_owned(mesh, probe, &cell, L);
  PetscCall(agree(out, mine, cell < 0 ? 0 : mesh->cell_orig[cell], &cell, &tet, &best));
  if (best > 1e-6)
    PetscCall(
      SbWarning(out->comm,
                "probe '%s': no tet of the re-meshed body holds its position any more; it follows "
                "the nearest one, from %.2g of its size outside",
                probe->name, best));
  if (cell < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbQuadraticBasis(L, Q);
  PetscCall(add_cell(s, probe, cell, 1., L, Q));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbProbesFind(SbRun run, SbOutput out)
{
  const SbSpace s = run->model->space;
  const SbMesh mesh = s->mesh;

  PetscFunctionBeginUser;
  for (PetscInt p = 0; p < out->nprobe; p++) {
    SbProbe *probe = &out->probe[p];
    PetscBool cells = PETSC_FALSE;
    PetscReal total = 0.;

    probe->nodes.n = probe->cells.n = probe->stresses.n = 0;
    for (PetscInt i = 0; i < probe->nfield; i++) {
      PetscCall(SbFieldPrepare(run, out, probe->field[i]));
      cells = (PetscBool)(cells || probe->field[i]->cell);
      if (probe->kind == SB_PROBE_POINT && SbFieldIsRecovered(probe->field[i]) && !out->nodal)
        PetscCall(SbNodalStressCreate(s, &out->nodal));
    }
    probe->local = -1;
    if (probe->kind != SB_PROBE_POINT)
      PetscCall(sum_set(run, probe));
    else
      PetscCall(find_point(s, out, probe));

    /* the tets around a vertex or a node at an edge, by volume */
    if (cells && probe->kind == SB_PROBE_POINT && probe->original >= 0) {
      const PetscBool vertex = (PetscBool)(probe->original < first_edge(s));
      const PetscInt local = probe->local;
      const PetscInt per = vertex ? 4 : 6;
      PetscInt here = -1; /* its global number */

      if (local >= 0)
        here = vertex ? mesh->gvert[local] : s->gnode[local - mesh->nvert_owned];
      PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &here, 1, MPIU_INT, MPI_MAX, out->comm));
      for (PetscInt i = 0; i < per * mesh->ncell_owned; i++) {
        PetscInt there = -1;

        if (vertex)
          there = mesh->gvert[mesh->cell[i]];
        else if (s->edge_node[i] >= 0)
          there = s->gnode[s->edge_node[i]];
        if (there == here) {
          const PetscReal V = SbTetDeterminant(mesh->x, mesh->cell + 4 * (i / per)) / 6.;

          PetscCall(add(&probe->cells, i / per, V));
          PetscCall(
            add(&probe->stresses, SB_CELL_NODES * (i / per) + i % per + (vertex ? 0 : 4), V));
        }
      }
    }

    /* integrals to means */
    for (PetscInt i = 0; i < probe->cells.n; i++)
      total += probe->cells.item[i].weight;
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPIU_REAL, MPI_SUM, out->comm));
    PetscCheck(total > 0. || probe->kind == SB_PROBE_POINT, out->comm, PETSC_ERR_USER_INPUT,
               "-probe_%s_%s %s: the set has no %s", probe->name, keys[probe->kind], probe->set,
               probe->kind == SB_PROBE_FACETS
                 ? "boundary facets; a mean over tets is asked for by _in"
                 : "tetrahedra; a mean over facets is asked for by _on");
    for (PetscInt i = 0; i < probe->cells.n; i++)
      probe->cells.item[i].weight /= total;
    for (PetscInt i = 0; i < probe->stresses.n; i++)
      probe->stresses.item[i].weight /= total;
    for (PetscInt i = 0; i < probe->nodes.n; i++)
      probe->nodes.item[i].weight /= total;

    /* a node at an edge is one of a sum */
    if (probe->local >= mesh->nvert_owned) {
      PetscCall(add(&probe->nodes, probe->local - mesh->nvert_owned, 1.));
      probe->local = -1;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbProbesAdd(SbRun run, SbOutput out, const SbStep *step, const SbStage *stage,
                           PetscReal values[])
{
  PetscFunctionBeginUser;
  out->state_valid = out->nodal_valid = PETSC_FALSE;
  for (const SbProbe *probe = out->probe; probe < out->probe + out->nprobe; probe++) {
    for (PetscInt i = 0; i < probe->nfield; values += probe->field[i++]->ncomp) {
      const SbField *f = probe->field[i];
      const PetscReal *x = stage->u;
      const PetscBool position = (PetscBool)!strcmp(f->name, "position");

      if (f->from == offsetof(SbStep, V))
        x = stage->v;
      else if (f->from == offsetof(SbStep, A))
        x = stage->a;
      if (probe->kind == SB_PROBE_POINT && SbFieldIsRecovered(f)) {
        PetscCall(SbFieldAddNodal(f, run, step, &probe->stresses, values));
        continue;
      }
      if (f->cell) {
        PetscCall(SbFieldAddCells(f, run, step, &probe->cells, values));
        continue;
      }

      /* at the vertex, or over the nodes; positions are displacements and where that is at rest */
      if (probe->local >= 0)
        SbPointsVertex(run, out, probe->local, x, values);
      for (int k = 0; k < 3; k++) {
        if (position && probe->local >= 0)
          values[k] += probe->x[k];
        for (PetscInt a = 0; a < probe->nodes.n; a++) {
          const PetscInt at = 3 * probe->nodes.item[a].number + k;

          values[k] +=
            probe->nodes.item[a].weight * (x[at] + (position ? run->model->space->node_x[at] : 0.));
        }
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbProbesWrite(SbRun run, SbOutput out, SbH5 *h)
{
  char name[2 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  if (!SbOutputMeshStep(run))
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt p = 0; p < out->nprobe; p++) {
    const SbProbe *probe = &out->probe[p];

    for (int k = 0; k < NNUMBER && probe->found && probe->kind == SB_PROBE_POINT; k++) {
      PetscCall(PetscSNPrintf(name, sizeof(name), "probe_%s_%s", probe->name, number_names[k]));
      PetscCall(SbH5PutReal(h, h->file, name, k < 3 ? probe->x[k] : (PetscReal)probe->body));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbProbesRead(SbRun run, SbOutput out, SbH5 *h)
{
  char name[2 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  for (PetscInt p = 0; p < out->nprobe; p++) {
    SbProbe *probe = &out->probe[p];
    PetscReal number[NNUMBER];
    PetscBool there = PETSC_TRUE;

    for (int k = 0; k < NNUMBER; k++) {
      PetscCall(PetscSNPrintf(name, sizeof(name), "probe_%s_%s", probe->name, number_names[k]));
      SbH5GetReal(h->file, name, &number[k], &there);
    }
    if (!there || number[3] < 0. || number[3] >= (PetscReal)run->model->nbody)
      continue;
    PetscCall(PetscArraycpy(probe->x, number, 3));
    probe->body = (PetscInt)number[3];
    probe->found = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
