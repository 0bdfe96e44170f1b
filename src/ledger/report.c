/*
  Table at the end of a run: errors and seconds of each source, and advice.

  Cost of halving an error, as a factor on the time of the run. Mesh: edges of half the length
  (errors are proportional to it; P2: to its square, so edges shorter by 2^(1/2)), hence more tets,
  and more iterations where these grow with the mesh. Integrator of order p: steps shorter by
  2^(1/p). Solves: the iterations that halve the residual at the measured rate.
*/
#include "ledger_impl.h"

#define WASTE \
  1e3 /* a source with an error smaller than the largest one by this factor is too accurate */
#define WIDTH 79
#define LOCKED 49.7 /* bulk over shear modulus, nu = 0.49 */

/* relative differences from the finer run below and, with CR, DG and P2, above which that may err
   as much (docs/reports/error_estimates.md) */
#define SMALL 1e-3
#define LARGE 0.05

#define ROOM 2048 /* length of the advice text */

/* Seconds by source of error, and other seconds; on the slowest rank. */
typedef struct {
  PetscReal source[SB_ERROR_COUNT], setup, output, estimates, total;
} Seconds;

/* space: residuals and tangents; linear: linear solves; nonlinear: both of these in Newton's
   iterations after the first of a step; contact: search and active-set decisions; time: the rest of
   the loop. Estimates are counted separately, with their residuals and solves. */
static PetscErrorCode find_seconds(SbLedger l, Seconds *s)
{
  enum {
    ASSEMBLY,
    SOLVE,
    CONTACT,
    SEARCH,
    SETUP,
    OUTPUT,
    ESTIMATES,
    TOTAL,
    COUNT
  };
  const SbRun run = l->run;
  PetscReal phase[SB_PHASE_COUNT], t[COUNT], beyond;
  PetscReal finer = 0.; /* of the estimates, those of the finer run, after this one */

  PetscFunctionBeginUser;
  PetscCall(SbLogSeconds(phase));
  for (int i = 0; i < SB_PHASE_COUNT; i++) {
    phase[i] -= l->finer.phase[i];
    finer += l->finer.phase[i];
  }
  t[ASSEMBLY] = phase[SB_PHASE_RESIDUAL] + phase[SB_PHASE_TANGENT] - l->residuals;
  t[SOLVE] = phase[SB_PHASE_SOLVE] - l->solving;
  t[CONTACT] = phase[SB_PHASE_CONTACT];
  t[SEARCH] = phase[SB_PHASE_SEARCH];
  t[SETUP] = phase[SB_PHASE_MESH] + phase[SB_PHASE_SETUP];
  t[OUTPUT] = phase[SB_PHASE_OUTPUT];
  t[ESTIMATES] = l->seconds;
  t[TOTAL] = run->counters.seconds_solve + finer;
  for (int i = 0; i < COUNT; i++)
    t[i] = PetscMax(t[i], 0.);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, t, COUNT, MPIU_REAL, MPI_MAX, run->model->comm));
  beyond = run->counters.newton > run->counters.steps
             ? 1. - (PetscReal)PetscMax(run->counters.steps, 1) / (PetscReal)run->counters.newton
             : 0.;
  *s = (Seconds){.setup = t[SETUP],
                 .output = t[OUTPUT],
                 .estimates = t[ESTIMATES],
                 .total = t[SETUP] + t[OUTPUT] + t[ESTIMATES]};
  s->source[SB_ERROR_SPACE] = (1. - beyond) * t[ASSEMBLY];
  s->source[SB_ERROR_LINEAR] = (1. - beyond) * t[SOLVE];
  s->source[SB_ERROR_NONLINEAR] = beyond * (t[ASSEMBLY] + t[SOLVE]);
  s->source[SB_ERROR_CONTACT] = t[CONTACT] + t[SEARCH];
  s->source[SB_ERROR_TIME] = PetscMax(0., t[TOTAL] - t[ASSEMBLY] - t[SOLVE] - t[CONTACT] -
                                            t[SEARCH] - t[OUTPUT] - t[ESTIMATES]);
  for (int i = 0; i < SB_ERROR_COUNT; i++)
    s->total += s->source[i];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Root of the sum of squares: errors of different sources are independent. */
static PetscReal together(SbLedger l)
{
  PetscReal sum = 0.;

  for (int i = 0; i < SB_ERROR_COUNT; i++)
    sum += PetscSqr(SbLedgerError(l, i));
  return PetscSqrtReal(sum);
}

static int largest(SbLedger l)
{
  int most = 0;

  for (int i = 1; i < SB_ERROR_COUNT; i++)
    if (SbLedgerError(l, i) > SbLedgerError(l, most))
      most = i;
  return most;
}

/* The body with the largest error of the mesh. */
static PetscInt worst_body(SbLedger l)
{
  PetscInt worst = 0;

  for (PetscInt b = 1; b < l->run->model->nbody; b++)
    if (l->space_error[b] > l->space_error[worst])
      worst = b;
  return worst;
}

static PetscReal order_of_space(SbLedger l)
{
  return l->run->model->element[worst_body(l)]->nodes_per[1] ? 2. : 1.;
}

/* Factor on the seconds per tet when edges are halved: 8 (n^2) for factors, 2 if iterations grow,
   else 1. */
static PetscReal growth(SbRun run)
{
  const char *name = run->solve.solver;

  if (strstr(name, "cholmod") || strstr(name, "mumps") || strstr(name, "umfpack"))
    return 8.;
  return strstr(name, "gamg") || strstr(name, "pressure") || strstr(name, "two_level") ? 1. : 2.;
}

/* Seconds of the run without its estimates, but not 0. */
static PetscReal seconds_of_run(const Seconds *s)
{
  return PetscMax(s->total - s->estimates, 1e-9);
}

/* Cost of halving the error of a source, as a factor on the time of the run. */
static PetscReal cost(SbLedger l, const Seconds *s, int source)
{
  const SbRun run = l->run;
  const PetscReal total = seconds_of_run(s);
  const PetscReal solving = s->source[SB_ERROR_LINEAR] / total;
  const PetscReal digits = PetscLog2Real(1. / PetscMax(l->rtol > 0. ? l->rtol : 1e-5, 1e-14));

  switch (source) {
  case SB_ERROR_SPACE:
    /* explicit: twice as many steps, which the smallest tet bounds */
    return PetscPowReal(8. * (run->solve.J ? 1. + solving * (growth(run) - 1.) : 2.),
                        1. / order_of_space(l));
  case SB_ERROR_TIME:
    return 1. +
           (PetscPowReal(2., 1. / (PetscReal)PetscMax(l->order, 1)) - 1.) * (1. - s->setup / total);
  default:
    return 1. + (solving + s->source[SB_ERROR_NONLINEAR] / total) / digits;
  }
}

/* Whether P1 locks in the body b so far that the estimate is only a lower bound: above nu = 0.49 it
   was 0.14 to 0.32 of the true error (docs/reference/error_estimates.md). */
static PetscBool locked(SbLedger l, PetscInt b)
{
  const SbModel m = l->run->model;
  const SbMaterial law = m->material[b];

  return (PetscBool)(m->element[b]->nodes_per[0] && !m->element[b]->nodes_per[1] &&
                     SbMaterialBulkModulus(law) > LOCKED * SbMaterialShearModulus(law));
}

/* The first body that locks, -1: none. */
static PetscInt first_locked(SbLedger l)
{
  for (PetscInt b = 0; b < l->run->model->nbody; b++)
    if (locked(l, b))
      return b;
  return -1;
}

static void say_locked(SbLedger l, char w[ROOM])
{
  const SbModel m = l->run->model;
  const PetscInt b = first_locked(l);

  if (b < 0)
    return;
  SbAppend(ROOM, w,
           "P1 locks in %s at its Poisson's ratio: the estimate is INVALID, the error of the mesh "
           "may be many times as large; -body_%s_element %s does not lock. ",
           m->body[b].name, m->body[b].name,
           m->contacts.nactive_set || m->contacts.npotential ? "cr" : "p2 (or cr)");
}

/* The quantity here and by the finer run, or how far its error by duality may be off. */
static void say_quantity(SbLedger l, char w[ROOM])
{
  static const char *const units[] = {"", "m", "N", "m^3"};
  const SbModel m = l->run->model;
  const SbQuantity *q = &l->quantity;
  const PetscReal size = PetscAbsReal(q->value);
  PetscBool other = PETSC_FALSE; /* some body is not P1 */

  if (!q->kind || m->dynamic)
    return;
  if (l->finer.ncell) {
    SbAppend(ROOM, w,
             "The %s is %.6g %s here, and %.6g %s by p2 with %" PetscInt_FMT
             " tets: the difference is its error by the mesh, mostly within a factor of two",
             q->kind == SB_QUANTITY_DISPLACEMENT ? "displacement"
             : q->kind == SB_QUANTITY_REACTION   ? "reaction"
                                                 : "volume",
             (double)q->value, units[q->kind], (double)l->finer.value, units[q->kind],
             l->finer.ncell);
    if (q->error[SB_ERROR_SPACE] < SMALL * size)
      SbAppend(ROOM, w, ", but it is so small that p2 may be no better");
    else if (q->error[SB_ERROR_SPACE] > LARGE * size && l->finer.ncell > m->mesh->Ncell)
      SbAppend(ROOM, w,
               ", but it is so large that stresses may be infinite somewhere, as at the edge of a "
               "support, where p2 is no better: it is a bound only");
    SbAppend(ROOM, w, ". ");
    return;
  }
  for (PetscInt b = 0; b < m->nbody; b++)
    other = (PetscBool)(other || !m->element[b]->nodes_per[0] || m->element[b]->nodes_per[1]);
  if (l->finer.why[0])
    SbAppend(ROOM, w, "There is no finer run for the error of the quantity by the mesh: %s. ",
             l->finer.why);
  if (q->kind == SB_QUANTITY_VOLUME)
    SbAppend(ROOM, w, "It is an order of magnitude only. ");
  else if (other)
    SbAppend(
      ROOM, w,
      "The error of the quantity by duality is UNRELIABLE with p2, cr and dg: up to 30 times "
      "the true one. ");
}

/* Whether P2 halves the error of the mesh at a lower cost than edges of half the length. On the
   same tets its relative error is about half the square of the relative error r of a first-order
   element, for small r (bar of docs/reports/quadratic_tets.md: 0.4 to 0.7 of it). So edges may be
   longer by r^(-1/2), and the run takes c r^(3/2) times as long, c the ratio of matrix bytes per
   tet. */
static void say_quadratic(SbLedger l, PetscReal cost_of_half, char w[ROOM])
{
  const SbModel m = l->run->model;
  const PetscInt body = worst_body(l);
  const PetscInt *nodes = m->element[body]->nodes_per;
  const SbMaterial law = m->material[body];
  const PetscReal r = l->error[SB_ERROR_SPACE] / PetscSqrtReal(l->stored);
  PetscReal c = 0.45; /* bytes of P2 over those of DG */
  PetscReal times;

  /* not for P2 itself, nor for explicit runs, whose steps the smallest distance of nodes bounds */
  if (nodes[1] || !l->run->solve.J)
    return;

  // the time that P2 takes, over that of now
  if (nodes[0])
    c = 14.;
  else if (nodes[2])
    c = 0.9;
  times = c * r * PetscSqrtReal(r);

  /* nu > 0.45: P1 locks, its errors do not decrease with the mesh size */
  if (locked(l, body))
    return; /* said already */
  if (nodes[0] && SbMaterialBulkModulus(law) > 9.7 * SbMaterialShearModulus(law)) {
    SbAppend(
      ROOM, w,
      "At this Poisson's ratio P1 locks, finer meshes help little: -body_%s_element %s does not. ",
      m->body[body].name, m->contacts.nactive_set || m->contacts.npotential ? "cr" : "p2 (or cr)");
    return;
  }

  /* solutions are not smooth at the boundary of a contact area */
  if (m->contacts.nactive_set || m->contacts.npotential || times >= cost_of_half)
    return;
  SbAppend(ROOM, w,
           "Where the solution is smooth and tets are well shaped, -body_%s_element p2 does it "
           "with edges of %.2g "
           "times the length and %.2g times the time; not for shocks and sharp contact. ",
           m->body[body].name, (double)(1. / PetscSqrtReal(r)), (double)times);
}

static void say_largest(SbLedger l, const Seconds *s, char w[ROOM])
{
  static const char *const what[SB_ERROR_COUNT] = {
    "the mesh is the largest source of error: halving it takes edges of %.3g times the length",
    "the time step is the largest source: halving it takes steps of %.3g s",
    "Newton's method stops too early: halving its error takes a smaller -snes_rtol",
    "the linear solver is the largest source of error: halving it takes a smaller -ksp_rtol",
    "contact is the largest source of error: a smaller -effect_..._barrier_width, or response "
    "projected",
    "rounding is the largest source of error: only other units or a smaller range of stiffnesses "
    "helps"};
  const int most = largest(l);
  const SbRun run = l->run;
  PetscReal half; /* length of edges over the present one, or of steps, s, for half the error */

  if (!(SbLedgerError(l, most) > 0.)) {
    SbAppend(ROOM, w, "No error was found that could be distinguished from zero. ");
    return;
  }
  SbAppend(ROOM, w, "Of an error of %.2g %%, ",
           (double)(100. * together(l) / PetscSqrtReal(l->stored)));
  half = PetscPowReal(0.5, 1. / (most == SB_ERROR_TIME ? (PetscReal)l->order : order_of_space(l)));
  if (most == SB_ERROR_TIME)
    half *= run->clock.t_end / PetscMax(1, run->counters.steps);
  SbAppend(ROOM, w, what[most], (double)half);
  if (most != SB_ERROR_CONTACT && most != SB_ERROR_ROUNDING)
    SbAppend(ROOM, w, ", and %.2g times the time", (double)cost(l, s, most));
  SbAppend(ROOM, w, ". ");
  if (most == SB_ERROR_SPACE)
    say_quadratic(l, cost(l, s, most), w);
}

/* Settings that are more accurate than needed, and cost time. */
static void say_wasted(SbLedger l, const Seconds *s, char w[ROOM])
{
  static const struct {
    int source;
    const char *what;
  } of[] = {{SB_ERROR_LINEAR, "-ksp_rtol (with Newton's method -snes_rtol)"},
            {SB_ERROR_NONLINEAR, "-snes_rtol"},
            {SB_ERROR_TIME, "-ts_dt"}};
  const PetscReal most = SbLedgerError(l, largest(l));

  if (l->may_tune)
    return; /* the adaptive tolerance sets them */
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(of); i++) {
    const PetscReal e = SbLedgerError(l, of[i].source);
    const PetscBool cheap = (PetscBool)(s->source[of[i].source] < 0.1 * seconds_of_run(s));
    const PetscBool factorised =
      (PetscBool)(l->run->counters.linear <= l->run->counters.newton); /* no tolerance */

    if (!(e > 0.) || e * WASTE > most)
      continue;
    if (of[i].source == SB_ERROR_TIME ? !l->run->model->dynamic : cheap || factorised)
      continue;
    SbAppend(ROOM, w,
             "%s is wasted: its error is %.1g times the largest one, and could be %.1g times as "
             "large unnoticed. ",
             of[i].what, (double)(e / most), (double)(0.1 * most / e));
  }
}

/* Whether -accuracy was reached, and if not, why. */
static void report_accuracy(SbLedger l, char w[ROOM])
{
  const PetscReal all = together(l) / PetscSqrtReal(PetscMax(l->stored, PETSC_MIN_REAL));
  const PetscReal mesh =
    l->error[SB_ERROR_SPACE] / PetscSqrtReal(PetscMax(l->stored, PETSC_MIN_REAL));
  const SbModel m = l->run->model;
  PetscReal volume = 0.;
  PetscReal n = 0.;
  PetscReal h;

  /* size of the mesh: edge of a regular tet of the mean volume, m */
  for (PetscInt b = 0; b < m->nbody; b++) {
    volume += m->body[b].volume;
    n += (PetscReal)m->body[b].ncell;
  }
  h = PetscPowReal(6. * PetscSqrtReal(2.) * volume / n, 1. / 3.);
  if (l->accuracy > 0.) {
    SbAppend(ROOM, w, "-accuracy %.3g was %s. ", (double)l->accuracy,
             all <= l->accuracy && first_locked(l) < 0 ? "met" : "NOT met");
    if (mesh > 0.7 * l->accuracy)
      SbAppend(ROOM, w,
               "The mesh is too coarse for it: tets of about %.2g m (now %.2g m) would do, where "
               "errors fall with "
               "%stheir size. ",
               (double)(h * PetscPowReal(0.7 * l->accuracy / mesh, 1. / order_of_space(l))),
               (double)h, order_of_space(l) > 1. ? "the square of " : "");
    if (l->narrowed)
      SbAppend(ROOM, w,
               "Widths of contact's barrier were made smaller for it %" PetscInt_FMT " times. ",
               l->narrowed);
    if (l->mesh_bounds)
      SbAppend(ROOM, w, "Contact was left at a tenth of the mesh's error, which hides less. ");
    if (l->width_bounds)
      SbAppend(ROOM, w,
               "Contact was left worse than its share: -effect_..._barrier_width is given, or "
               "rounding allows "
               "no smaller one. ");
  }
  if (l->budget > 0. && l->nstep) {
    SbAppend(ROOM, w,
             "-step_time_budget %.3g s: %" PetscInt_FMT " of %" PetscInt_FMT
             " steps kept it, mean %.3g s, longest %.3g s; solves to %.1e. ",
             (double)l->budget, l->nkept, l->nstep, (double)(l->total / (PetscReal)l->nstep),
             (double)l->longest, (double)l->rtol);
    if (l->total > l->budget * (PetscReal)l->nstep)
      SbAppend(ROOM, w,
               "It is too small for this mesh: tets of about %.2g m (now %.2g m) would fit. ",
               (double)(h * PetscPowReal(l->total / ((PetscReal)l->nstep * l->budget), 1. / 3.)),
               (double)h);
  }
}

/* A line of the printed table: error < 0, quantity NULL, seconds < 0: none. */
static PetscErrorCode print_line(SbLedger l, const Seconds *s, const char *name, PetscReal error,
                                 const PetscReal *quantity, PetscReal seconds, const char *note)
{
  const PetscReal relative = l->stored > 0. ? error / PetscSqrtReal(l->stored) : 0.;
  char text[96];

  PetscFunctionBeginUser;
  SbFormat(sizeof(text), text, "%-11s", name);
  if (error >= 0.)
    SbAppend(sizeof(text), text, " %10.2e %9.2e", (double)error, (double)relative);
  if (quantity)
    SbAppend(sizeof(text), text, " %9.2e", (double)*quantity);
  if (seconds >= 0.)
    SbAppend(sizeof(text), text, "%*s %9.3f %5.1f %%", 42 - (int)strlen(text), "", (double)seconds,
             (double)(100. * seconds / PetscMax(s->total, 1e-9)));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%-60s  %s\n", text, note));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLedgerReport(SbLedger l, const char *file, PetscBool quiet)
{
  static const char *const notes[SB_ERROR_COUNT] = {
    "residual, tangent", "steps",           "iterations after the first",
    "linear solves",     "contact, search", ""};
  static const char *const quantities[] = {"", "of u, m", "of F, N", "of V, m^3"};
  Seconds s;
  PetscMPIInt rank;
  char words[ROOM] = "";
  FILE *f;
  int column = 0;
  SbModel m;
  PetscReal scale;
  const PetscReal *q;

  PetscFunctionBeginUser;
  if (!l)
    PetscFunctionReturn(PETSC_SUCCESS);
  m = l->run->model;
  scale = l->stored > 0. ? 1. / PetscSqrtReal(l->stored) : 0.;
  PetscCall(find_seconds(l, &s));
  PetscCallMPI(MPI_Comm_rank(m->comm, &rank));
  if (rank)
    PetscFunctionReturn(PETSC_SUCCESS);
  f = SbFileCreate(file);
  PetscCheck(f, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "cannot open %s for writing", file);
  PetscCall(PetscFPrintf(PETSC_COMM_SELF, f,
                         "source,body,error,relative,quantity,seconds\n#,,J^(1/2),1,SI,s\n"));
  for (int i = 0; i < SB_ERROR_COUNT; i++)
    PetscCall(PetscFPrintf(PETSC_COMM_SELF, f, "%s,,%.17g,%.17g,%.17g,%.17g\n", SbErrorNames[i],
                           (double)SbLedgerError(l, i), (double)(scale * SbLedgerError(l, i)),
                           (double)l->quantity.error[i], (double)s.source[i]));
  for (PetscInt b = 0; b < m->nbody; b++)
    PetscCall(PetscFPrintf(PETSC_COMM_SELF, f, "space,%s,%.17g,%.17g,,\n", m->body[b].name,
                           (double)PetscSqrtReal(l->space_error[b]),
                           (double)(scale * PetscSqrtReal(l->space_error[b]))));
  PetscCall(PetscFPrintf(PETSC_COMM_SELF, f,
                         "together,,%.17g,%.17g,,%.17g\nset-up,,,,,%.17g\noutput,,,,,%.17g\n"
                         "estimates,,,,,%.17g\n",
                         (double)together(l), (double)(scale * together(l)), (double)s.total,
                         (double)s.setup, (double)s.output, (double)s.estimates));
  PetscCheck(!fclose(f), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "cannot write %s", file);
  if (quiet)
    PetscFunctionReturn(PETSC_SUCCESS);
  q = l->quantity.kind ? l->quantity.error : NULL;
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "\n%-11s %10s %9s %9s %9s %7s  of %.3g J stored\n",
                        "error", "J^(1/2)", "relative", quantities[l->quantity.kind], "seconds", "",
                        (double)l->stored));
  for (int i = 0; i < SB_ERROR_COUNT; i++) {
    PetscCall(
      print_line(l, &s, SbErrorNames[i], SbLedgerError(l, i), q ? &q[i] : NULL,
                 i == SB_ERROR_ROUNDING ? -1. : s.source[i],
                 i == SB_ERROR_SPACE && first_locked(l) >= 0 ? "locked: invalid" : notes[i]));
    for (PetscInt b = 0; i == SB_ERROR_SPACE && m->nbody > 1 && b < m->nbody; b++) {
      char name[16];

      PetscCall(PetscSNPrintf(name, sizeof(name), "  %.8s", m->body[b].name));
      PetscCall(print_line(l, &s, name, PetscSqrtReal(l->space_error[b]), NULL, -1.,
                           locked(l, b) ? "locked: invalid" : ""));
    }
  }
  PetscCall(print_line(l, &s, "set-up", -1., NULL, s.setup, ""));
  PetscCall(print_line(l, &s, "output", -1., NULL, s.output, ""));
  PetscCall(print_line(l, &s, "estimates", -1., NULL, s.estimates, "of this table"));
  PetscCall(print_line(l, &s, "together", together(l), NULL, s.total, ""));
  say_locked(l, words);
  say_quantity(l, words);
  say_largest(l, &s, words);
  say_wasted(l, &s, words);
  report_accuracy(l, words);
  for (char *word = strtok(words, " "); word; word = strtok(NULL, " ")) {
    const int n = (int)strlen(word);

    if (column && column + 1 + n > WIDTH) {
      PetscCall(PetscPrintf(PETSC_COMM_SELF, "\n"));
      column = 0;
    }
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "%s%s", column ? " " : "", word));
    column += n + (column > 0);
  }
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "\n"));
  (void)fflush(PETSC_STDOUT);
  PetscFunctionReturn(PETSC_SUCCESS);
}
