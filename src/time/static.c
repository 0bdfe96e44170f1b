/*
  Load steps of a static run: f_int(u) = lambda f_ext, u = lambda u_prescribed on supports, lambda
  from 0 to 1 in -static_steps equal steps, without mass, damping and TS. A step whose solve fails
  is halved and repeated from the last equilibrium; after each successful step the length doubles
  again.

  Bodies that overlap when the run begins are moved apart, rigidly and with their supports, without
  load; these go back in as many steps, and push the bodies together (SbStaticPush()), with bodies
  without supports that are between them, which must not slip out. Where only
  their surfaces could be moved apart, they come into equilibrium without load.

  With -static_adapt a step without contact that converges slowly is given up early and halved, at
  most EARLY times in a row: beyond a limit load the energy has to be searched.

  So is one in which supports or cells turn far (turn.c), where a motion has other ends than its
  displacements tell. The state after each step is examined for its stability (stability.c).

  Near a limit load lambda* displacements vary like sqrt(lambda* - lambda), and steps would be
  halved forever. Below -static_min_increment the run stops; the growth of displacements with the
  load, over its minimum of all steps, tells a limit load from other failures. A shortened step
  without an iteration (a change of load below rounding) does not double the length.
*/
#include "time_impl.h"

#define LIMIT \
  10. /* growth of displacements with the load, over its minimum, that indicates a limit load */
#define EARLY 4 /* halvings in a row of load steps that are given up early */
#define EASY \
  25 /* iterations of a load step, failed attempts included, after which its length doubles */
#define PUSH \
  1e-3 /* cosine of the angle between forces and a free motion above which forces drive it */
#define SHARE 0.01 /* of the volume, above which cells that turn far matter */
#define CUTS 6     /* halvings of a load step for their sake, then it is accepted with a warning */
#define PUSH_LEAST 1e-2 /* shortest step of pushing together, over a load step */
#define SLIPPED \
  4. /* mean displacement of a body without supports, over the way by which others push it */
#define EXCESS \
  0.5 /* tolerated strain energy beyond the work of the forces in a step, over that at its end */

/* Data of a load step. */
typedef struct {
  SbRun run;
  PetscReal factor, length; /* load factor at the end of the step, and its increment */
  Vec X;                    /* displacement at its end, m */
  PetscBool contact;        /* with contact of any response */
  Vec shift;                /* of bodies by which supports are away, m; NULL: they are not */
  PetscReal part;           /* this part of it at the end of the step */
} LoadStep;

static PetscErrorCode contact_residual(void *ctx, Vec X, Vec R)
{
  const SbRun run = ((LoadStep *)ctx)->run;

  PetscFunctionBeginUser;
  PetscCall(SbModelResidual(run->model, run->model->load, X, NULL, NULL, PETSC_FALSE, R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Initial guess: the last equilibrium with the prescribed values of the new load factor. */
static PetscErrorCode predict(void *ctx)
{
  const LoadStep *l = (LoadStep *)ctx;

  PetscFunctionBeginUser;
  l->run->model->load = l->factor;
  if (l->run->model->space->eigen) {
    PetscCall(SbModelActiveAt(l->run->model, l->factor - l->length));
    PetscCall(SbSpaceEigenKeep(l->run->model->space));
  }
  PetscCall(SbModelActiveAt(l->run->model, l->factor));
  PetscCall(VecCopy(l->run->state.U, l->X));
  PetscCall(SbModelPrescribe(l->run->model, l->factor, l->X));
  if (l->shift) {
    Vec away;

    PetscCall(VecDuplicate(l->shift, &away));
    PetscCall(VecCopy(l->shift, away));
    PetscCall(SbSpaceZeroPrescribed(l->run->model->space, PETSC_FALSE, away));
    PetscCall(VecAXPY(l->X, l->part, away));
    PetscCall(VecDestroy(&away));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a solution with contact is a distant equilibrium, off the load path: while the active set
   is wrong, a body may pass far through an obstacle. While forces grow along the path, strain
   energy grows by at most (f_0 + f_1) . du, f_0 and f_1 the internal forces at the ends of the
   step; linear: half of that. */
static PetscErrorCode jumped(const LoadStep *l, PetscBool *is)
{
  const SbModel m = l->run->model;
  PetscReal psi[2], work[2];
  Vec forces, way;
  PetscInt n;

  PetscFunctionBeginUser;
  *is = PETSC_FALSE;
  if (!m->contacts.nactive_set || m->linear)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(l->X, &forces));
  PetscCall(VecDuplicate(l->X, &way));
  PetscCall(VecWAXPY(way, -1., l->run->state.U, l->X));
  for (int k = 0; k < 2; k++) {
    PetscCall(SbModelStrainEnergy(m, k ? l->X : l->run->state.U, forces, &psi[k], &n));
    PetscCall(VecDot(forces, way, &work[k]));
  }
  PetscCall(PetscInfo(l->run->solve.snes,
                      "strain energy %g -> %g J, work of the forces at both ends %g J\n",
                      (double)psi[0], (double)psi[1], (double)(work[0] + work[1])));
  *is = (PetscBool)((1. - EXCESS) * psi[1] > psi[0] + PetscMax(0., work[0] + work[1]));
  PetscCall(VecDestroy(&way));
  PetscCall(VecDestroy(&forces));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Searches for an unsupported body, before a step is solved or after it was tried; *found:
   run->clock.stop_reason describes it. */
static PetscErrorCode find_free_body(const LoadStep *l, PetscBool tried, PetscBool solved,
                                     PetscBool *found)
{
  const SbRun run = l->run;
  PetscInt body = -1;
  char motion[256];
  const char *loads = "";

  PetscFunctionBeginUser;
  if (tried)
    PetscCall(SbRunFreeBody(run, &body, sizeof(motion), motion, NULL));
  run->solve.free_body = (PetscBool)(body >= 0 && !l->contact);

  /* stress and loads may resist a free rotation, but not at the start of the step. A stabilising
     load, as a hanging weight, makes shorter steps succeed; a load that drives the motion has no
     equilibrium nearby */
  if (body < 0 && !solved && !run->model->linear) {
    PetscReal work, force, way;
    Vec along, F;

    PetscCall(VecDuplicate(run->state.U, &along));
    PetscCall(VecDuplicate(run->state.U, &F));
    run->model->load = l->factor - l->length;
    PetscCall(SNESComputeJacobian(run->solve.snes, run->state.U, run->solve.system, run->solve.J));
    PetscCall(SbRunFreeBody(run, &body, sizeof(motion), motion, along));
    run->model->load = l->factor;
    if (body >= 0 && !l->contact) {
      PetscCall(contact_residual((void *)l, run->state.U, F));
      PetscCall(SbSpaceProjectAdmissible(run->model->space, F));
      PetscCall(VecDot(F, along, &work));
      PetscCall(VecNorm(F, NORM_2, &force));
      PetscCall(VecNorm(along, NORM_2, &way));
      run->solve.free_body = (PetscBool)(PetscAbsReal(work) > PUSH * force * way);
    }
    if (!run->solve.free_body)
      loads = " but its loads";
    PetscCall(VecDestroy(&along));
    PetscCall(VecDestroy(&F));
  }
  *found = (PetscBool)(body >= 0);
  if (*found)
    PetscCall(SbRunFail(
      run, "load factor %g: nothing%s holds the body %s against %s; hold it by a support%s",
      (double)l->factor, loads, run->model->body[body].name, motion,
      l->contact ? ", or let it come to rest in a dynamic run" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode complete(void *ctx, SNESConvergedReason reason, PetscBool *ok)
{
  const LoadStep *l = (LoadStep *)ctx;
  PetscBool far, factored;
  PetscBool other = PETSC_FALSE;
  PetscBool found = PETSC_FALSE;
  const char *unsettled = SbContactSetUnsettled(&l->run->model->contacts);
  const char *lost = NULL;
  PetscReal way;

  PetscFunctionBeginUser;
  PetscCall(SbRunTooFar(l->run, l->X, &far));
  if (reason > 0 && !far && l->contact)
    PetscCall(SbRunLostBody(l->run, l->X, &lost, &way));
  if (lost) {
    *ok = PETSC_FALSE;
    l->run->solve.free_body = PETSC_TRUE;
    PetscCall(SbRunFail(l->run,
                        "load factor %g: the body %s slips away, by %.3g m in this load step, as "
                        "nothing holds it; hold it by a support or by friction, or let it come to "
                        "rest in a dynamic run",
                        (double)l->factor, lost, (double)way));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (reason > 0 && !far)
    PetscCall(jumped(l, &other));
  *ok = (PetscBool)(reason > 0 && !far && !other && !unsettled[0]);
  if (other) /* a body that nothing holds may be anywhere */
    PetscCall(find_free_body(l, PETSC_TRUE, PETSC_FALSE, &found));
  if (other && !found)
    PetscCall(SbRunFail(l->run,
                        "load factor %g: contact was found at another equilibrium, with more "
                        "strain energy than the loads have done work; use more -static_steps",
                        (double)l->factor));

  /* find the cause of a failed solve */
  if (!*ok && !other && !l->run->clock.stopped) {
    char why[512] = "use more -static_steps";

    PetscCall(find_free_body(l, PETSC_TRUE, PETSC_FALSE, &found));
    if (found && unsettled[0])
      SbAppend(sizeof(l->run->clock.stop_reason), l->run->clock.stop_reason, "; %s", unsettled);
    if (!found) {
      char near[512], what[512];

      if (reason == SNES_DIVERGED_LINEAR_SOLVE)
        PetscCall(SbSolverListExplain(l->run, sizeof(why), why));
      PetscCall(SbContactSetNearest(&l->run->model->contacts, sizeof(near), near));
      SbRunSuspects(l->run, sizeof(near), near);
      PetscCall(SbRunDescribeDivergence(l->run, l->X, reason, sizeof(what), what));
      PetscCall(SbRunFail(l->run, "load factor %g: %s; %s%s%s", (double)l->factor,
                          unsettled[0] ? unsettled : what, why, near[0] ? "; " : "", near));
    }
  }

  /* with balanced loads a singular system has solutions, up to any rigid motion: one of a
     factorisation is far along it, also in contact */
  factored = SbConstraintsFactored(l->run->model->space);
  if (*ok && (factored || (!l->run->counters.steps && !l->contact)) &&
      l->run->counters.newton_step) {
    PetscCall(find_free_body(l, PETSC_TRUE, PETSC_TRUE, &found));
    *ok = (PetscBool)!found;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bodies without supports that others pushed together by `way`, m, from the displacements `from`
   have to be held by them: where nothing does, they slip out, or end where chance takes them. */
static PetscErrorCode check_held(SbRun run, SbContact c, Vec from, PetscReal way)
{
  const SbModel m = run->model;
  PetscReal *moved;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(m->nbody, &moved));
  PetscCall(SbRunFreeWays(run, from, run->state.U, moved, NULL));
  for (PetscInt b = 0; b < m->nbody; b++)
    PetscCheck(
      moved[b] <= SLIPPED * way, m->comm, PETSC_ERR_USER_INPUT,
      "The effect %s: the body %s overlaps others when the run begins, and slips by %.2g m "
      "when they are pushed together by %.2g m, as nothing holds it; hold it by a support "
      "or by -effect_%s_friction, or let it come to rest in a dynamic run",
      c->effect->name, m->body[b].name, (double)moved[b], (double)way, c->effect->name);
  PetscCall(PetscFree(moved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbStaticPush(SbRun run, Vec S, SbContact c, PetscReal strain)
{
  const SbModel m = run->model;
  const PetscReal nominal = 1. / (PetscReal)run->clock.static_steps;
  const PetscReal least = PUSH_LEAST * nominal;
  PetscReal part = 1.;
  PetscReal length = 1.; /* what only touches comes back in one step */
  PetscReal work = 0.;   /* of all contacts */
  PetscReal way = 0.;
  SbEnergies after = {0};
  Vec X, from;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(run->state.U, &X));
  PetscCall(VecDuplicate(run->state.U, &from));
  PetscCall(VecCopy(run->state.U, from));
  m->load = run->clock.t0;
  if (S) {
    PetscCall(VecNorm(S, NORM_INFINITY, &way));
    PetscCall(VecAXPY(from, -1., S));
  }
  if (way > 2. * c->width)
    length = nominal;
  while (part > 0.) {
    const PetscReal next = part - length < 1e-9 ? 0. : part - length;
    LoadStep load = {.run = run, .X = X, .contact = PETSC_TRUE, .shift = S, .part = next};
    const SbSolvedStep end = {0., 0., run->state.U, .U = X, .solved = PETSC_TRUE};
    const SbAttempt attempt = {end, predict, contact_residual, complete, &load};
    SbStage stage = {.shift_k = 1.};
    PetscBool ok;

    PetscCall(SbRunAttempt(run, &attempt, &ok));
    if (!ok) {
      char why[sizeof(run->clock.stop_reason)];

      length *= 0.5;
      run->solve.tangent_known = PETSC_FALSE;
      if (run->clock.stopped || !S)
        break;
      if (length >= least)
        continue;
      PetscCall(PetscStrncpy(why, run->clock.stop_reason, sizeof(why)));
      SETERRQ(
        m->comm, PETSC_ERR_USER_INPUT,
        "The effect %s: bodies that overlap when the run begins were moved apart, and could be "
        "pushed together by their supports up to %.2g of the way: %s. Move them apart in the "
        "meshes, or by -body_NAME_translate",
        c->effect->name, 1. - (double)part, why);
    }
    run->clock.stop_reason[0] = 0;
    PetscCall(VecCopy(X, run->state.U));
    PetscCall(SbSpaceGetLocalRead(m->space, run->state.U, &stage.u));
    for (PetscInt e = 0; e < m->naccept; e++)
      SbEffectCall(m->accept[e], accept, m->space, &stage);
    PetscCall(SbSpaceRestoreLocalRead(m->space, run->state.U, &stage.u));
    for (PetscInt i = 0; i < m->contacts.npotential; i++)
      work += m->contacts.potential[i]->work;
    part = next;
    length = PetscMin(2. * length, nominal);
  }
  PetscCall(VecDestroy(&X));
  run->solve.tangent_known = PETSC_FALSE; /* that of the last push, not of its end */
  if (way > 2. * c->width && part == 0.)
    PetscCall(check_held(run, c, from, way));
  PetscCall(VecDestroy(&from));
  if (part > 0.) { /* stopped, or nothing was away and it takes loads to hold the bodies */
    if (!run->clock.stopped)
      run->clock.stop_reason[0] = 0;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &work, 1, MPIU_REAL, MPI_SUM, m->comm));
  PetscCall(SbModelEnergies(m, run->state.U, NULL, &after));
  for (PetscInt i = 0; i < m->contacts.npotential; i++)
    SbContactGive(m->contacts.potential[i], m->space, 0., 0.);
  SbContactGive(c, m->space, after.strain - strain, work);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No equilibrium was found at the shortest increment `length`: says which load was reached, and the
   likely cause. */
static PetscErrorCode report_shortest(SbRun run, PetscReal factor, PetscReal length,
                                      PetscBool contact)
{
  char why[sizeof(run->clock.stop_reason)], suspects[512];
  PetscBool unstable;

  PetscFunctionBeginUser;
  PetscCall(PetscStrncpy(why, run->clock.stop_reason, sizeof(why)));
  suspects[0] = 0;
  SbRunSuspects(run, sizeof(suspects), suspects);
  PetscCall(SbNewtonUnstable(run->solve.snes, &unstable));
  if (run->solve.softening > LIMIT)
    PetscCall(SbRunFail(run,
                        "the load factor reached %.7g of 1, and no equilibrium was found %.1e "
                        "further on: a limit load is likely, as displacements grow %.0f times as "
                        "fast with the load as before; -static_control arc_length goes past it%s%s",
                        (double)factor, (double)length, (double)run->solve.softening,
                        suspects[0] ? "; " : "", suspects));
  else if (factor > 0. && unstable && !contact)
    PetscCall(SbRunFail(run,
                        "the load factor reached %.7g of 1, and no equilibrium was found %.1e "
                        "further on, where the tangent is not positive definite: a limit load is "
                        "likely, or a bifurcation; -static_control arc_length goes past it%s%s%s%s",
                        (double)factor, (double)length, run->solve.rejected_inverted ? "; " : "",
                        run->solve.rejected_inverted ? why : "", suspects[0] ? "; " : "",
                        suspects));
  else if (factor > 0.)
    PetscCall(SbRunFail(run, "the load factor reached %.7g of 1; %s", (double)factor, why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a step to X at the load factor `to` has to be repeated with half its length, as cells
   turned far in it; after CUTS of them they jump, with a warning. */
static PetscErrorCode turned_far(SbRun run, Vec X, PetscReal to, PetscInt cuts, PetscBool *far)
{
  PetscReal share;

  PetscFunctionBeginUser;
  PetscCall(SbRunTurned(run, run->state.U, X, &share));
  *far = (PetscBool)(share > SHARE && cuts < CUTS);
  if (*far) {
    run->counters.rejected++;
    run->counters.turned++;
    run->solve.tangent_known = PETSC_FALSE;
    PetscCall(PetscInfo(run->solve.snes, "load factor %g: %g of the volume turned far\n",
                        (double)to, (double)share));
  } else if (share > SHARE)
    PetscCall(SbWarning(run->model->comm,
                        "load factor %.6g: %.2g of the volume turned by more than %g degrees in a "
                        "load step, and in shorter ones, too: the bodies jump to another "
                        "equilibrium; a dynamic run with damping, or -static_control arc_length, "
                        "tells to which one",
                        (double)to, (double)share, (double)(SB_TURN_CELLS * 180. / PETSC_PI)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbStaticSolve(SbRun run)
{
  const PetscReal nominal = 1. / (PetscReal)run->clock.static_steps;
  const PetscReal least = run->clock.min_increment * nominal;
  PetscReal factor = run->clock.t0;
  PetscReal length = nominal;
  PetscReal rate;
  PetscReal slowest = 0.;
  PetscInt step = run->clock.step0;
  PetscInt halvings = 0;
  PetscInt jumps = 0; /* how often the step was repeated as cells turned far */
  const PetscBool follow = (PetscBool)(run->clock.adapt && !run->model->linear);
  const PetscBool contact =
    (PetscBool)(run->model->contacts.nactive_set || run->model->contacts.npotential);
  Vec X;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(run->state.U, &X));
  run->model->load = factor;
  PetscCall(SbRunStepAccepted(run, step, factor, 0., PETSC_FALSE));
  if (follow)
    PetscCall(SbRunCutTurn(run, factor, least, &length));
  while (factor < 1.) {
    const PetscReal next = factor + length > 1. - 1e-9 ? 1. : factor + length;
    LoadStep load = {
      .run = run, .factor = next, .length = next - factor, .X = X, .contact = contact};
    const SbSolvedStep end = {factor, next - factor, run->state.U, .U = X, .solved = PETSC_TRUE};
    const SbAttempt attempt = {end, predict, contact_residual, complete, &load};
    PetscBool ok = PETSC_FALSE;
    PetscBool found, easy, unstable, may_cut, again;
    PetscBool far = PETSC_FALSE;

    /* checked early: follower loads stiffen a mechanism in later iterations, and a late failure
       takes long */
    if (run->solve.nonsymmetric.U && !run->counters.steps && !contact)
      PetscCall(find_free_body(&load, PETSC_FALSE, PETSC_FALSE, &found));
    run->clock.may_give_up = (PetscBool)(run->clock.adapt && !contact && halvings < EARLY);
    if (!run->solve.free_body)
      PetscCall(SbRunAttempt(run, &attempt, &ok));

    /* halve a step in which cells turned far: it may have found another equilibrium */
    if (ok && follow) {
      PetscCall(turned_far(run, X, next, jumps, &far));
      if (far) {
        jumps++;
        length *= 0.5;
        continue;
      }
    }

    /* halve a failed step, if that may help */
    if (!ok) {
      run->counters.rejected++;
      length *= 0.5;
      run->solve.tangent_known = PETSC_FALSE;
      if (run->clock.stopped)
        PetscCall(SbRunStepAccepted(run, step, factor, 0., PETSC_TRUE));
      if (run->solve.free_body || run->clock.stopped)
        break;

      /* halving does not help in a linear problem, unless contact is active */
      if (run->model->linear && !contact)
        halvings = run->clock.max_halvings;
      if (++halvings <= run->clock.max_halvings && length >= least && !SbRunTooShort(run, length))
        continue;

      PetscCall(report_shortest(run, factor, 2. * length, contact));
      break;
    }
    run->clock.stop_reason[0] = 0;

    /* the new equilibrium, X is the old one; with contact, halve a step that ends in an unstable
       one: a long step may find it far from the stable one that the loads lead to */
    PetscCall(VecSwap(X, run->state.U));
    may_cut =
      (PetscBool)(follow && contact && 0.5 * length >= PetscMax(least, nominal / (1 << CUTS)));
    PetscCall(SbRunCheckStable(run, next, (PetscBool)(next >= 1.), may_cut, &again, &unstable));
    if (again) {
      PetscCall(VecSwap(X, run->state.U));
      run->counters.rejected++;
      run->counters.turned++;
      length *= 0.5;
      continue;
    }

    /* its growth of displacement with the load, relative to the slowest step */
    PetscCall(VecAXPY(X, -1., run->state.U));
    PetscCall(VecNorm(X, NORM_2, &rate));
    rate /= next - factor;
    if (slowest == 0. || (rate < slowest && run->counters.newton_step))
      slowest = rate;
    if (slowest > 0. && run->counters.newton_step)
      run->solve.softening = rate / slowest;

    /* re-meshing, effects and monitors */
    run->monitors.post_step.dt = next - factor;
    if (run->monitors.post_step.fn && next < 1.)
      PetscCall((*run->monitors.post_step.fn)(run, step + 1, next, next - factor,
                                              run->monitors.post_step.ctx, &run->clock.paused));
    if (next < 1.)
      PetscCall(SbRunStopAsked(run, step + 1, next, PETSC_FALSE));
    if (run->counters.newton_step)
      halvings = 0;
    easy = (PetscBool)(run->counters.newton_step <= EASY);
    PetscCall(
      SbRunStepAccepted(run, ++step, next, next - factor, (PetscBool)(next >= 1. || unstable)));
    if (unstable)
      PetscCall(SbRunFail(run, "%s", run->stability.text));
    if (run->clock.paused || run->clock.stopped || unstable)
      break;

    /* lengthen the next step */
    factor = next;
    jumps = 0;
    if (!run->clock.adapt || easy)
      length = PetscMin(2. * length, nominal);
    if (follow && factor < 1.)
      PetscCall(SbRunCutTurn(run, factor, least, &length));
  }
  PetscCall(VecDestroy(&X));
  PetscFunctionReturn(PETSC_SUCCESS);
}
