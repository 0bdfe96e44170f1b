/*
  The fields that a run can write: one table, a name, a unit and a function each.

  Vertex fields are interpolated from the vectors by points.c. Cell fields share one evaluation per
  frame.

  von Mises stress:  sqrt(3/2 s:s), s the deviator of the Cauchy stress
  reaction:          residual without constraints at prescribed unknowns, the force of the support
  on the body contact force:     of obstacles and other bodies on the body
  contact pressure:  -F . n / A . n, F the force of contact on a vertex, A the outward area of the
                     facets around it, n along the gap, or along F where that is 0: only the side of
                     a ridge that touches counts
  contact gap:       along the normal: a vertex minus gap times normal is the point of contact
  mean pressure:     -tr(sigma)/3 of the Cauchy stress, positive in compression
  pressure:          the law's -lambda theta, theta: its measure of the change of volume
  (SbMaterialOps); they
                     differ by 2/3 mu theta for small strains, little for nu near 0.5.
*/
#include <stddef.h>
#include "output_impl.h"

/* A vector of the step. */
static PetscErrorCode vector(const SbField *f, SbRun run, const SbStep *step, PetscReal *values)
{
  PetscFunctionBeginUser;
  PetscCall(SbPointsValues(run, (SbOutput)run->monitors.output,
                           *(const Vec *)((const char *)step + f->from), values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode position(const SbField *f, SbRun run, const SbStep *step, PetscReal *values)
{
  SbOutput out = (SbOutput)run->monitors.output;

  PetscFunctionBeginUser;
  PetscCall(vector(f, run, step, values));
  for (PetscInt i = 0; i < out->point.nowned; i++) {
    const PetscReal *x = SbPointsRest(run, out, i);

    for (int k = 0; k < 3; k++)
      values[3 * i + k] += x[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode reaction(const SbField *f, SbRun run, const SbStep *step, PetscReal *values)
{
  PetscFunctionBeginUser;
  (void)f;
  PetscCheck(step->R, PETSC_COMM_SELF, PETSC_ERR_PLIB,
             "The residual was asked for but not given to the monitors");
  PetscCall(SbPointsForces(run, (SbOutput)run->monitors.output, PETSC_TRUE, step->R, values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Not a number at the points of rigid bodies: what acts on a vertex of them is not known from their
   four nodes. */
static void blank_rigid(SbRun run, SbOutput out, PetscInt ncomp, PetscReal values[])
{
  const SbSpace s = run->model->space;

  for (PetscInt i = 0; s->rigid && i < out->point.nowned; i++) {
    const PetscInt vertex = SbPointsPlace(run, out, i).vertex;

    for (PetscInt k = 0; vertex >= 0 && s->element[s->mesh->vert_body[vertex]]->rigid && k < ncomp;
         k++)
      values[ncomp * i + k] = (PetscReal)NAN;
  }
}

/* Force, or gap: of obstacles and other bodies. */
static PetscErrorCode contact(const SbField *f, SbRun run, const SbStep *step, PetscReal *values)
{
  const SbOutput out = (SbOutput)run->monitors.output;
  Vec x;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(step->U, &x));
  if (!strcmp(f->name, "contact_force")) {
    PetscCall(SbContactSetForce(&run->model->contacts, step->t, step->U, x));
    PetscCall(SbPointsForces(run, out, PETSC_FALSE, x, values));
  } else {
    PetscCall(SbContactSetGap(&run->model->contacts, step->t, step->U, x));
    PetscCall(SbPointsValues(run, out, x, values));
    blank_rigid(run, out, 3, values);
  }
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The area vectors of nodes, m^2: of a third of each facet around a corner, where it is now, on the
   nodes of the corner; with P2 a twelfth, and a quarter in the middle of its sides. Collective. */
static PetscErrorCode find_areas(SbSpace s, Vec U, Vec A)
{
  const PetscReal *u;
  PetscReal *area;
  SbFacet *facet;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetSetFacets(s, -1, &n, &facet));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  PetscCall(VecSet(A, 0.));
  PetscCall(VecGetArray(A, &area));
  for (PetscInt i = 0; i < n; i++) {
    const SbFacet *f = &facet[i];
    const PetscBool quadratic = (PetscBool)(s->edge_node && s->edge_node[6 * f->cell] >= 0);
    PetscReal x[3][3], side[2][3], normal[3];

    for (int k = 0; k < 3; k++) {
      const PetscReal *w = SbSpaceCornerBasis(s, f->cell, f->corner[k]);

      for (int c = 0; c < 3; c++) {
        x[k][c] = s->mesh->x[3 * f->vertex[k] + c];
        for (int a = 0; a < 4; a++)
          x[k][c] += w[a] * u[3 * s->cell_node[4 * f->cell + a] + c];
      }
    }
    SbSubtract(x[1], x[0], side[0]);
    SbSubtract(x[2], x[0], side[1]);
    SbCross(side[0], side[1], normal);
    for (int a = 0; a < 10; a++) {
      const PetscInt node = a < 4 || quadratic ? SbSpaceCellNode(s, f->cell, a) : -1;
      PetscReal part = 0.;

      if (node < 0 || node >= s->nnode_owned)
        continue;
      if (a < 4)
        for (int k = 0; k < 3; k++)
          part += SbSpaceCornerBasis(s, f->cell, f->corner[k])[a] / (quadratic ? 12. : 3.);
      else if (SbTetEdge[a - 4][0] != f->face && SbTetEdge[a - 4][1] != f->face)
        part = 0.25;
      for (int c = 0; c < 3; c++)
        area[3 * node + c] += 0.5 * part * normal[c];
    }
  }
  PetscCall(VecRestoreArray(A, &area));
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCall(PetscFree(facet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode contact_pressure(const SbField *f, SbRun run, const SbStep *step,
                                       PetscReal *values)
{
  const SbOutput out = (SbOutput)run->monitors.output;
  const SbContactSet *contacts = &run->model->contacts;
  const PetscInt n = out->point.nowned;
  PetscReal *force, *area, *gap;
  Vec x;

  PetscFunctionBeginUser;
  (void)f;
  PetscCall(PetscMalloc3(3 * n, &force, 3 * n, &area, 3 * n, &gap));
  PetscCall(VecDuplicate(step->U, &x));
  PetscCall(SbContactSetForce(contacts, step->t, step->U, x));
  PetscCall(SbPointsForces(run, out, PETSC_FALSE, x, force));
  PetscCall(SbContactSetGap(contacts, step->t, step->U, x));
  PetscCall(SbPointsValues(run, out, x, gap));
  PetscCall(find_areas(run->model->space, step->U, x));
  PetscCall(SbPointsForces(run, out, PETSC_FALSE, x, area));
  PetscCall(VecDestroy(&x));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal *F = force + 3 * i;
    const PetscReal *A = area + 3 * i;
    PetscReal N[3] = {gap[3 * i], gap[3 * i + 1], gap[3 * i + 2]};
    PetscReal face;

    /* the normal, along the gap, where that is 0 along the force */
    for (int k = 0; k < 3 && SbDot3(gap + 3 * i, gap + 3 * i) == 0.; k++)
      N[k] = F[k];
    (void)SbNormalise(N);

    /* against the outward area, also where the surface is inside the other one */
    face = SbDot3(A, N);
    values[i] = face != 0. ? -SbDot3(F, N) / face : 0.;
  }
  blank_rigid(run, out, 1, values);
  PetscCall(PetscFree3(force, area, gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stress at nodes, once for all fields of a step. Collective. */
static PetscErrorCode nodal_stress(SbOutput out, const SbStep *step)
{
  PetscFunctionBeginUser;
  if (out->nodal_valid)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbNodalStressCompute(out->nodal, step->U));
  out->nodal_valid = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A function of the Cauchy stress at points. */
static PetscErrorCode nodal(const SbField *f, SbRun run, const SbStep *step, PetscReal *values)
{
  const SbOutput out = (SbOutput)run->monitors.output;
  PetscReal *sigma;

  PetscFunctionBeginUser;
  PetscCall(nodal_stress(out, step));
  PetscCall(PetscMalloc1(6 * out->point.nowned, &sigma));
  PetscCall(SbPointsStress(run, out, sigma));
  for (PetscInt i = 0; i < out->point.nowned; i++)
    (*f->of_stress)(sigma + 6 * i, values + f->ncomp * i);
  PetscCall(PetscFree(sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A quantity of the cells' state, which is computed once per frame: for stress six numbers, else
   one. */
static PetscErrorCode cell_state(const SbField *f, SbRun run, const SbStep *step,
                                 const PetscReal **array)
{
  SbOutput o = (SbOutput)run->monitors.output;
  const PetscReal *u;

  PetscFunctionBeginUser;
  if (!o->state_valid) {
    PetscCall(SbSpaceGetLocalRead(run->model->space, step->U, &u));
    SbSpaceCellState(run->model->space, u, o->sigma, o->J, o->psi, o->pressure);
    PetscCall(SbSpaceRestoreLocalRead(run->model->space, step->U, &u));
    o->state_valid = PETSC_TRUE;
  }
  *array = *(PetscReal **)((char *)o + f->from);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void stress(const PetscReal s[6], PetscReal value[])
{
  static const int position[6] = {0, 3, 5, 1, 4, 2}; // from xx yy zz xy yz xz to xx xy xz yy yz zz

  for (int k = 0; k < 6; k++)
    value[k] = s[position[k]];
}

static void von_mises(const PetscReal s[6], PetscReal value[])
{
  const PetscReal a = s[0] - s[1];
  const PetscReal b = s[1] - s[2];
  const PetscReal d = s[2] - s[0];

  value[0] =
    PetscSqrtReal(.5 * (a * a + b * b + d * d) + 3. * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

static void mean_pressure(const PetscReal s[6], PetscReal value[])
{
  value[0] = -(s[0] + s[1] + s[2]) / 3.;
}

/* The value in one cell, from that state: itself, or the function of the Cauchy stress. */
static void in_cell(const SbField *f, const PetscReal state[], PetscInt cell, PetscReal value[])
{
  if (f->of_stress)
    (*f->of_stress)(state + 6 * cell, value);
  else
    value[0] = state[cell];
}

static PetscErrorCode of_state(const SbField *f, SbRun run, const SbStep *step, PetscReal *values)
{
  const PetscReal *state = NULL;

  PetscFunctionBeginUser;
  PetscCall(cell_state(f, run, step, &state));
  for (PetscInt c = 0; c < run->model->mesh->ncell_owned; c++)
    in_cell(f, state, c, values + f->ncomp * c);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode space_error(const SbField *f, SbRun run, const SbStep *step,
                                  PetscReal *values)
{
  PetscFunctionBeginUser;
  (void)f;
  PetscCall((*run->monitors.cell_error)(run, step, values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the body that the cell is in, or of the rank that owns it. */
static PetscErrorCode number(const SbField *f, SbRun run, const SbStep *step, PetscReal *values)
{
  const PetscBool body = (PetscBool)!strcmp(f->name, "body");

  PetscFunctionBeginUser;
  (void)step;
  for (PetscInt c = 0; c < run->model->mesh->ncell_owned; c++)
    values[c] =
      (PetscReal)(body ? run->model->mesh->cell_body[c] : ((SbOutput)run->monitors.output)->rank);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An axis of the law of a cell, at rest. */
static PetscErrorCode axis(const SbField *f, SbRun run, const SbStep *step, PetscReal *values)
{
  PetscFunctionBeginUser;
  (void)step;
  SbSpaceCellAxis(run->model->space, strcmp(f->name, "fibre") ? 1 : 0, values);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The volume of a cell without stress over that at rest. */
static PetscErrorCode growth(const SbField *f, SbRun run, const SbStep *step, PetscReal *values)
{
  PetscFunctionBeginUser;
  (void)f;
  (void)step;
  SbSpaceCellGrowth(run->model->space, values);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode tension(const SbField *f, SbRun run, const SbStep *step, PetscReal *values)
{
  const SbSpace s = run->model->space;
  const PetscReal *u;

  PetscFunctionBeginUser;
  (void)f;
  PetscCall(SbSpaceGetLocalRead(s, step->U, &u));
  SbSpaceActiveTension(s, u, values);
  PetscCall(SbSpaceRestoreLocalRead(s, step->U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode softening(const SbField *f, SbRun run, const SbStep *step, PetscReal *values)
{
  const SbSpace s = run->model->space;
  const PetscReal *u;

  PetscFunctionBeginUser;
  (void)f;
  PetscCall(SbSpaceGetLocalRead(s, step->U, &u));
  SbSpaceMullinsFactor(s, u, values);
  PetscCall(SbSpaceRestoreLocalRead(s, step->U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define CELL .cell = PETSC_TRUE
#define STEP(member) .from = offsetof(SbStep, member)
#define STATE(member) .from = offsetof(struct _p_SbOutput, member)

static const SbField table[] = {
  {"displacement", "m", 3, .compute = vector, STEP(U), .help = "displacement from the rest state"},
  {"position", "m", 3, .compute = position, STEP(U),
   .help = "where the vertices are; fields.vtkhdf shows the bodies there"},
  {"velocity", "m/s", 3, .compute = vector, STEP(V), .dynamic = PETSC_TRUE, .help = "velocity"},
  {"acceleration", "m/s^2", 3, .compute = vector, STEP(A), .dynamic = PETSC_TRUE,
   .help = "acceleration, state of the integrator"},
  {"reaction", "N", 3, .compute = reaction, .help = "force of a support on the body"},
  {"contact_force", "N", 3, .compute = contact, .help = "force of contact on the body"},
  {"contact_pressure", "Pa", 1, .compute = contact_pressure,
   .help = "normal force of contact per area of the surface around a vertex"},
  {"contact_gap", "m", 3, .compute = contact,
   .help = "from the nearest point of what it may touch, along the normal there; 0: nothing near"},
  {"nodal_stress", "Pa", 6, .compute = nodal, .of_stress = stress,
   .help = "Cauchy stress at vertices, and p2's nodes, recovered from the cells around"},
  {"nodal_von_mises", "Pa", 1, .compute = nodal, .of_stress = von_mises,
   .help = "von Mises stress of nodal_stress"},
  {"stress", "Pa", 6, CELL, .compute = of_state, STATE(sigma), .of_stress = stress,
   .help = "Cauchy stress"},
  {"von_mises", "Pa", 1, CELL, .compute = of_state, STATE(sigma), .of_stress = von_mises,
   .help = "von Mises stress"},
  {"pressure", "Pa", 1, CELL, .compute = of_state, STATE(pressure),
   .help = "pressure of the law, -lambda times its change of volume"},
  {"mean_pressure", "Pa", 1, CELL, .compute = of_state, STATE(sigma), .of_stress = mean_pressure,
   .help = "minus a third of the trace of the Cauchy stress"},
  {"J", "1", 1, CELL, .compute = of_state, STATE(J), .help = "volume ratio det F"},
  {"energy_density", "J/m^3", 1, CELL, .compute = of_state, STATE(psi),
   .help = "strain energy per rest volume"},
  {"space_error", "J/m^3", 1, CELL, .compute = space_error,
   .help = "energy of the estimated error of the mesh per rest volume; needs -ledger"},
  {"fibre", "1", 3, CELL, .compute = axis,
   .help = "direction of the fibres at rest, of laws that have them; else 0"},
  {"sheet", "1", 3, CELL, .compute = axis, .help = "second axis of these laws, at rest"},
  {"active_tension", "Pa", 1, CELL, .compute = tension,
   .help = "tension of fibres that contract, with its factors by length and velocity; else 0"},
  {"mullins_factor", "1", 1, CELL, .compute = softening,
   .help = "factor of softening on the stress that changes the shape; without it 1"},
  {"growth", "1", 1, CELL, .compute = growth,
   .help = "volume without stress over that at rest, of bodies that grow or expand; else 1"},
  {"body", "1", 1, CELL, .compute = number, .constant = PETSC_TRUE,
   .help = "number of the body, always written"},
  {"rank", "1", 1, CELL, .compute = number, .constant = PETSC_TRUE,
   .help = "MPI rank that owns the cell"},
  {"sets", "1", 1, CELL, .compute = NULL, .constant = PETSC_TRUE,
   .help = "sets and groups that the scenario names: arrays set_NAME of points, tets_NAME of "
           "cells, 1 inside"},
};

const SbField *SbFieldGetAll(PetscInt *n)
{
  *n = (PetscInt)PETSC_STATIC_ARRAY_LENGTH(table);
  return table;
}

PetscErrorCode SbFieldFind(const char *option, const char *name, const SbField **field)
{
  const PetscInt n = (PetscInt)PETSC_STATIC_ARRAY_LENGTH(table);
  const char *names[PETSC_STATIC_ARRAY_LENGTH(table)];
  char all[512];

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < n; i++) {
    names[i] = table[i].name;
    if (strcmp(table[i].name, name))
      continue;
    *field = &table[i];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  SbSuggestName(name, n, names, sizeof(all), all);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "%s: there is no field '%s'; fields are none, %s",
          option, name, all);
}

PetscBool SbFieldIsProbed(const SbField *f)
{
  return (PetscBool)(f->compute == vector || f->compute == position || f->compute == of_state);
}

PetscErrorCode SbFieldAddCells(const SbField *f, SbRun run, const SbStep *step, const SbSum *cells,
                               PetscReal value[])
{
  const PetscReal *state = NULL;

  PetscFunctionBeginUser;
  PetscCall(cell_state(f, run, step, &state));
  for (PetscInt i = 0; i < cells->n; i++) {
    PetscReal here[6] = {0.};

    in_cell(f, state, cells->item[i].number, here);
    for (PetscInt k = 0; k < f->ncomp; k++)
      value[k] += cells->item[i].weight * here[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool SbFieldIsRecovered(const SbField *f)
{
  return (PetscBool)(f->of_stress != NULL);
}

PetscErrorCode SbFieldAddNodal(const SbField *f, SbRun run, const SbStep *step, const SbSum *nodes,
                               PetscReal value[])
{
  const SbOutput out = (SbOutput)run->monitors.output;

  PetscFunctionBeginUser;
  PetscCall(nodal_stress(out, step));
  for (PetscInt i = 0; i < nodes->n; i++) {
    const PetscInt number = nodes->item[i].number;
    PetscReal sigma[6], here[6];

    SbNodalStressAt(out->nodal, number / SB_CELL_NODES, (int)(number % SB_CELL_NODES), sigma);
    (*f->of_stress)(sigma, here);
    for (PetscInt k = 0; k < f->ncomp; k++)
      value[k] += nodes->item[i].weight * here[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFieldPrepare(SbRun run, SbOutput out, const SbField *f)
{
  const PetscInt n = run->model->mesh->ncell_owned;
  const PetscBool forces = (PetscBool)(f->compute == reaction || f->compute == contact_pressure ||
                                       !strcmp(f->name, "contact_force"));

  PetscFunctionBeginUser;
  PetscCheck(f->compute != space_error || run->monitors.cell_error, PETSC_COMM_WORLD,
             PETSC_ERR_USER_INPUT,
             "-output_fields space_error needs its estimate: give -ledger yes, too");

  /* the array of the cells' state that this field needs */
  if (f->compute == of_state) {
    PetscReal **state = (PetscReal **)((char *)out + f->from);

    if (!*state)
      PetscCall(PetscMalloc1(f->of_stress ? 6 * n : n, state));
  }

  /* weights of nodes at vertices; forces also need the residual of each step */
  if (forces)
    run->monitors.want_residual = PETSC_TRUE;
  if (f->compute == nodal && !out->nodal)
    PetscCall(SbNodalStressCreate(run->model->space, &out->nodal));
  if (!f->cell)
    PetscCall(SbPointsPrepare(
      run, out, (PetscBool)(forces && (!run->model->space->vertices || out->discontinuous))));
  PetscFunctionReturn(PETSC_SUCCESS);
}
