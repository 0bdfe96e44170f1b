/*
  finer.c - the scene of a static run once more, with P2, for the error of a quantity by the mesh.

  Estimates by duality take products of the errors of stresses. Those of P2, CR and DG are nearly
  orthogonal: the error of a displacement is the small difference of large terms, which recovered
  stresses do not tell (docs/reports/error_estimates.md). The quantity of a much better solution
  does. P2 on the same tets has a third of the error of P1 or less; CR and DG are as good as it in
  bending, so their tets are divided into eight, like those of P2 itself.

  The second run is set up from the same options, with its own choice of the solver, and solves the
  last load step once more from the displacements of the first run, interpolated: so it takes a few
  iterations, and finds the same of several equilibria. With contact, which depends on the path, it
  takes all steps, and near nu = 1/2, where the interpolated displacements change the volumes of the
  smaller tets: from there Newton's method took minutes at nu = 0.4999, and 3 iterations at 0.45.
  Sets that are shapes are evaluated on its mesh.
*/
#include "remesh_impl.h"
#include "sbscene.h"

#define STIFF 9.7 /* bulk over shear modulus, nu = 0.45, beyond which all load steps are taken */

/* Displacement of the first run at a rest position X in its tet c, value[3]. */
static void interpolate(SbModel m, const SbGathered *g, PetscInt c, const PetscReal X[3],
                        PetscReal value[3])
{
  const PetscReal *from = g->value + (size_t)c * (size_t)g->width * 3;
  PetscReal weight[4];
  PetscReal psi[SB_CELL_NODES] = {0.};
  PetscInt body = 0;

  while (c >= g->cell0[body + 1])
    body++;
  SbTetBarycentric(g->X, g->cell + 4 * c, X, weight);
  if (m->element[body]->nodes_per[1])
    SbQuadraticBasis(weight, psi);
  for (int i = 0; i < 16 && !m->element[body]->nodes_per[1]; i++)
    psi[i % 4] += weight[i / 4] * m->element[body]->ops.vertex[i / 4][i % 4];
  for (int k = 0; k < 3; k++)
    value[k] = 0.;
  for (int a = 0; a < SB_CELL_NODES; a++)
    for (int k = 0; k < 3 && psi[a] != 0.; k++)
      value[k] += psi[a] * from[3 * (a < 4 ? a : SB_EDGES + a - 4) + k];
}

/* The displacements of `run`, on the finer mesh, whose tets C come from tet C / children. */
static PetscErrorCode transfer(SbRun run, SbRun finer, PetscInt children)
{
  SbGathered from, to;

  PetscFunctionBeginUser;
  PetscCall(SbGather(run, &from));
  PetscCall(SbGather(finer, &to));
  for (PetscInt c = 0; to.value && c < to.ncell; c++) {
    const PetscInt *v = to.cell + 4 * c;

    for (int a = 0; a < SB_CELL_NODES; a++) {
      const PetscInt i = v[a < 4 ? a : SbTetEdge[a - 4][0]];
      const PetscInt j = v[a < 4 ? a : SbTetEdge[a - 4][1]];
      PetscReal X[3];

      for (int k = 0; k < 3; k++)
        X[k] = 0.5 * (to.X[3 * i + k] + to.X[3 * j + k]);
      interpolate(run->model, &from, c / children, X,
                  to.value +
                    3 * ((size_t)c * (size_t)to.width + (size_t)(a < 4 ? a : SB_EDGES + a - 4)));
    }
  }
  PetscCall(SbScatter(&to, finer));
  PetscCall(SbGatheredDestroy(&from));
  PetscCall(SbGatheredDestroy(&to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFinerRun(SbRun run, SbLedger ledger)
{
  PetscReal before[SB_PHASE_COUNT], seconds[SB_PHASE_COUNT];
  PetscInt refine;
  PetscBool wanted;
  SbModel m;
  SbRun finer;
  PetscBool whole; /* all load steps */

  PetscFunctionBeginUser;
  PetscCall(SbLedgerWantsFiner(ledger, &refine, &wanted));
  if (!wanted)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbLogSeconds(before));
  PetscCall(SbSceneCreate(run->model->comm, &m));
  PetscCall(SbRunCreate(m, &finer));
  PetscCall(PetscStrncpy(finer->solve.solver_choice, "auto", sizeof(finer->solve.solver_choice)));
  for (PetscInt b = 0; b < m->nbody; b++) {
    SbScope own;

    m->body[b].refine = refine;
    if (m->element[b]->nodes_per[1])
      continue;
    SbScopeSet(&own, "body", "", m->body[b].name);
    PetscCall(SbElementDestroy(&m->element[b]));
    PetscCall(SbElementCreate("p2", &own, &m->element[b]));
    PetscCall(PetscStrncpy(m->body[b].element, "p2", sizeof(m->body[b].element)));
  }
  whole = (PetscBool)(run->model->linear || run->model->contacts.n);
  for (PetscInt k = 0; k < m->nmaterial; k++)
    whole = (PetscBool)(whole || SbMaterialBulkModulus(m->material[k]) >
                                   STIFF * SbMaterialShearModulus(m->material[k]));
  if (!whole)
    finer->clock.t0 = 1. - 1. / (PetscReal)finer->clock.static_steps;
  finer->clock.stop.listens = run->clock.stop.listens;
  finer->clock.stop.grace = 0.; /* its step is nothing to wait for */
  PetscCall(SbModelSetUp(m));
  PetscCall(SbRunSetUp(finer));
  if (!whole)
    PetscCall(transfer(run, finer, refine ? 8 : 1));
  finer->monitors.want_energies = finer->monitors.want_residual = PETSC_TRUE;
  PetscCall(SbRunSolve(finer));
  PetscCall(SbLogSeconds(seconds));
  for (int i = 0; i < SB_PHASE_COUNT; i++)
    seconds[i] -= before[i];
  PetscCall(SbLedgerSetFiner(ledger, finer, seconds));
  PetscCall(SbRunDestroy(&finer));
  PetscCall(SbModelDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}
