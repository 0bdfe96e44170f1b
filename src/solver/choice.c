/*
  The choice of a linear solver, and of the next one after a failure, as two tables: condition,
  solver, reason. The first row whose condition holds decides. Conditions are functions of the facts
  of a run (choice.h), which are found once.

  Measurements: docs/reports/solver_choice.md and, for several ranks,
  docs/reports/realtime_ranks.md.
*/
#include "choice.h"
#include "sbfactor.h"
#include "solver_impl.h"

/* Largest number of unknowns for ... */
#define ROTATED 60000          /* the rotated factorisation */
#define ROTATED_SLIVERS 120000 /* the same, with slivers and nu up to NU_SLIVERS */
#define DIRECT_P1 80000 /* a factorisation for P1, from nu = NU_LOCKED on: faster than iterations */
#define P_MULTIGRID 5000 /* a factorisation for P2, up to nu = NU_SLIVERS: as fast as p-multigrid */
#define DIRECT_NEXT \
  200000 /* a factorisation with slivers from NU_PRESSURE on, or as first fallback */
#define SADDLE_STATIC 30000 /* a factorisation with multipliers; not measured beside others */
#define SADDLE_DYNAMIC 1000

/* Poisson's ratio ... */
#define NU_PRESSURE 0.45 /* from which on dynamic CR, too, has the pressures as unknowns */
#define NU_SLIVERS 0.49
#define NU_LOCKED 0.4995
#define NU_ROTATED 0.4999 /* up to which the rotated factorisation is used for CR and DG */

#define SLIVERS 0.001 /* fraction of the tets from which on slivers matter */

PetscErrorCode SbSolverFindFacts(SbSpace s, SbSolverFacts *f)
{
  PetscReal most[4] = {-1., -1., 0., 0.};
  PetscInt nsliver = 0;
  PetscInt ncell = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(f, sizeof(*f)));

  /* of the regions of all ranks: Poisson's ratios, is one DG, may a tangent be indefinite */
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbElement element = s->region[r].element;
    const SbMaterial m = s->region[r].material;

    most[0] = PetscMax(most[0], SbMaterialPoisson(m));
    if (SbElementHasFaces(element))
      most[1] = PetscMax(most[1], SbMaterialPoisson(m));
    if (element->nodes_per[3])
      most[2] = 1.;
    if (!m->linear && !m->adaptive && m->tangent == SB_TANGENT_EXACT)
      most[3] = 1.;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 4, MPIU_REAL, MPI_MAX, s->comm));
  f->nu = most[0];
  f->face_nu = most[1];
  f->dg = (PetscBool)(most[2] > 0.);
  f->indefinite = (PetscBool)(most[3] > 0.);

  for (PetscInt b = 0; b < s->mesh->nbody; b++) {
    nsliver += s->mesh->body[b].nsliver;
    ncell += s->mesh->body[b].ncell;
  }
  f->sliver_part = (PetscReal)nsliver / (PetscReal)PetscMax(1, ncell);
  f->slivers = (PetscBool)(f->sliver_part >= SLIVERS);

  f->unknowns = 3 * s->Nnode;
  f->ranks = s->size;
  f->faces = s->faces;
  f->rigid = s->rigid;
  f->p2 = (PetscBool)(s->edge_node && !s->faces && !s->rigid);
  f->cr_dg = (PetscBool)(s->faces && !s->edge_node && !s->rigid);
  f->constraints = (PetscBool)(s->constraints != NULL);
  f->coupled = s->coupled;
  PetscCall(SbDirectPackage(s->comm, f->unknowns, (PetscBool)!f->indefinite, &f->package));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- the conditions of the first choice, in the order of its table */

static PetscBool is(const SbSolverFacts *f, const char *choice)
{
  return (PetscBool)!strcmp(f->problem.choice, choice);
}

static PetscBool interface_too_large(const SbSolverFacts *f)
{
  return (PetscBool)(f->interface > f->interface_most);
}

static PetscBool runs_explicitly(const SbSolverFacts *f)
{
  return f->problem.explicit_run;
}

static PetscBool given_by_petsc_option(const SbSolverFacts *f)
{
  return (PetscBool)(f->given != NULL);
}

static PetscBool asked_for_factorisation(const SbSolverFacts *f)
{
  return is(f, "direct");
}

/* A rotated factorisation whose interface is too large is replaced as with auto. */
static PetscBool named(const SbSolverFacts *f)
{
  return (PetscBool)(!is(f, "auto") && !interface_too_large(f));
}

/* MINRES does not converge with the factor's single precision. Ten steps of 1.3k to 2.3k unknowns,
   linear iterations of rotated and pressure, DG: 1150 and 1478 at nu 0.4999, 14521 and 1652 at
   0.49999, 634312 and 4348 at 0.499999. */
static PetscBool rotation_pays(const SbSolverFacts *f)
{
  const PetscBool hard_for_iterations = (PetscBool)(f->slivers && f->nu <= NU_SLIVERS);

  return (PetscBool)(f->problem.dynamic && !f->problem.linear && !f->minres &&
                     f->face_nu <= NU_ROTATED &&
                     f->unknowns <= (hard_for_iterations ? ROTATED_SLIVERS : ROTATED));
}

/* 51k unknowns of CR, 36k of DG, nu 0.4: ms per step of rotated and cg_two_level 22 and 89, 22 and
   94 on two ranks, 12 and 50, 16 and 76 on four. */
static PetscBool rotates(const SbSolverFacts *f)
{
  return (PetscBool)(rotation_pays(f) && !interface_too_large(f));
}

static PetscBool p2_compressible(const SbSolverFacts *f)
{
  const PetscBool hard = (PetscBool)(f->indefinite || f->slivers);

  return (PetscBool)(f->p2 && f->nu <= (f->slivers ? NU_PRESSURE : NU_SLIVERS) &&
                     f->unknowns > (hard ? SB_DIRECT_SMALL : P_MULTIGRID));
}

/* 28k unknowns of P1 on 16 ranks, dynamic, ms per step of mumps and cg_two_level: 300 to 450 and
   50. */
static PetscBool small_enough_to_factor(const SbSolverFacts *f)
{
  const PetscBool many_ranks = (PetscBool)(interface_too_large(f) && f->nu <= NU_PRESSURE);

  return (PetscBool)(f->package && f->unknowns <= SB_DIRECT_SMALL && !many_ranks);
}

static PetscBool slivers_nearly_incompressible(const SbSolverFacts *f)
{
  return (PetscBool)(f->package && !f->problem.dynamic && f->slivers && f->nu > NU_PRESSURE &&
                     f->unknowns <= DIRECT_NEXT);
}

static PetscBool static_p2_nearly_incompressible(const SbSolverFacts *f)
{
  return (PetscBool)(f->package && !f->problem.dynamic && f->p2 && f->nu > NU_SLIVERS &&
                     f->unknowns <= DIRECT_NEXT);
}

static PetscBool rigid_bodies(const SbSolverFacts *f)
{
  return (PetscBool)(f->package && f->rigid && f->unknowns <= DIRECT_NEXT);
}

static PetscBool p1_locked(const SbSolverFacts *f)
{
  return (PetscBool)(f->package && !f->problem.dynamic && !f->faces && f->nu > NU_LOCKED &&
                     f->unknowns <= DIRECT_P1);
}

static PetscBool p2_nearly_incompressible(const SbSolverFacts *f)
{
  return (PetscBool)(f->p2 && f->nu > NU_SLIVERS && !f->constraints && !f->coupled);
}

/* 24k tets of CR, dynamic, CPU s of pressure and cg_two_level at nu 0.3 12 and 7, at 0.45 15 and
   11, at 0.49 17 and 17. */
static PetscBool face_pressures_pay(const SbSolverFacts *f)
{
  const PetscBool nearly_incompressible = (PetscBool)(f->face_nu > NU_PRESSURE);
  const PetscBool jumps_or_static = (PetscBool)(!f->slivers && (f->dg || !f->problem.dynamic));

  return (PetscBool)(f->cr_dg && (nearly_incompressible || jumps_or_static) && !f->constraints &&
                     !f->coupled);
}

static PetscBool is_p2(const SbSolverFacts *f)
{
  return f->p2;
}

static PetscBool always(const SbSolverFacts *f)
{
  (void)f;
  return PETSC_TRUE;
}

/* ---- the table of the first choice */

/* In place of a solver's name: */
#define GIVEN "given"   /* the row that an option of PETSc asks for */
#define NAMED "named"   /* that of -solver */
#define FACTOR "direct" /* the package of the facts */

/* Words in braces are replaced by write_reason(). */
static const struct {
  PetscBool (*holds)(const SbSolverFacts *f);
  const char *solver, *reason;
} choices[] = {
  {runs_explicitly, "cg", "explicit integrator: no linear system"},

  /* the user's choice */
  {given_by_petsc_option, GIVEN, "chosen by {option}"},
  {asked_for_factorisation, FACTOR, "the factorisation for {count} on {ranks}{indefinite}"},
  {named, NAMED, "chosen by -solver"},

  /* auto: fast whatever the conditioning */
  {rotates, "rotated", "{system}: one factorisation, rotated with the nodes, serves many steps"},
  {p2_compressible, "cg_p_multigrid",
   "{system} of p2, nu up to {nu}: with P1 on the vertices below it iterations do not grow "
   "with the mesh"},
  {small_enough_to_factor, FACTOR,
   "{count}: a factorisation is fast and works at any Poisson's ratio{indefinite}"},

  /* auto: systems that are hard for iterations */
  {slivers_nearly_incompressible, FACTOR,
   "{count}, nu up to {nu}, {slivers}: a factorisation, iterations hardly get there"},
  {static_p2_nearly_incompressible, FACTOR,
   "{count}, nu up to {nu}, {slivers}: a factorisation, iterations hardly get there"},
  {rigid_bodies, FACTOR,
   "{count} with rigid bodies, which are far stiffer than others: a factorisation{indefinite}"},
  {p1_locked, FACTOR,
   "{count}, nu up to {nu}, {slivers}: a factorisation, iterations hardly get there"},
  {p2_nearly_incompressible, "pressure",
   "{system} of p2, nu up to {nu}: with the pressures as unknowns iterations hardly grow towards "
   "1/2"},
  {face_pressures_pay, "pressure",
   "{system} of cr or dg, nu up to {face_nu}: with the pressures as unknowns iterations "
   "hardly grow towards 1/2"},

  /* auto: all others. 192k tets, CPU s of cg_two_level on one rank. Static: 0.36 (cg_gamg 1.7,
     cg_icc 1.4), at nu 0.45 0.7 (2.3), at 0.499 4.2 (18); dynamic, h = 0.01 s: 0.22 (1.7, 0.40) */
  {is_p2, "cg_p_multigrid",
   "{system}: motions of large parts are solved directly, the rest takes few iterations"},
  {always, "cg_two_level",
   "{system}: motions of large parts are solved directly, the rest takes few iterations"},
};

/* Writes the reason of a row with the facts in place of the words in braces. */
static void write_reason(const SbSolverFacts *f, const char *text, size_t size, char reason[])
{
  char count[48], system[64], ranks[32], nu[32], face_nu[32], slivers[80];
  const struct {
    const char *word, *value;
  } words[] = {
    {"{count}", count},
    {"{system}", system},
    {"{ranks}", ranks},
    {"{nu}", nu},
    {"{face_nu}", face_nu},
    {"{slivers}", slivers},
    {"{option}", f->given ? f->given_by : ""},
    {"{indefinite}", f->indefinite ? "; the exact tangent may be indefinite" : ""},
  };

  SbFormat(sizeof(count), count, "%" PetscInt_FMT " unknowns", f->unknowns);
  SbFormat(sizeof(system), system, "%s, %s", f->problem.dynamic ? "dynamic" : "static", count);
  SbFormat(sizeof(ranks), ranks, "%d rank%s", (int)f->ranks, f->ranks > 1 ? "s" : "");
  SbFormat(sizeof(nu), nu, "%g", (double)f->nu);
  SbFormat(sizeof(face_nu), face_nu, "%g", (double)f->face_nu);
  SbFormat(sizeof(slivers), slivers, "%.2g %% of the tets slivers (angles below %g degrees)",
           100. * (double)f->sliver_part, SB_SLIVER);

  /* piece by piece: plain text up to the next brace, or the value of a word */
  reason[0] = 0;
  while (text[0]) {
    size_t length = 1 + strcspn(text + 1, "{");
    const char *piece = text;
    size_t shown = length;

    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(words); k++) {
      if (strncmp(text, words[k].word, strlen(words[k].word)))
        continue;
      length = strlen(words[k].word);
      piece = words[k].value;
      shown = strlen(piece);
    }
    SbAppend(size, reason, "%.*s", (int)shown, piece);
    text += length;
  }
}

const SbSolverPreset *SbSolverChooseByFacts(const SbSolverFacts *f, size_t size, char reason[])
{
  size_t k = 0;
  const char *name;

  while (!choices[k].holds(f))
    k++;
  write_reason(f, choices[k].reason, size, reason);
  if (interface_too_large(f))
    SbAppend(size, reason,
             "; %d ranks meet at %" PetscInt_FMT
             " nodes, and rotated and realtime take %" PetscInt_FMT,
             (int)f->ranks, f->interface, f->interface_most);

  name = choices[k].solver;
  if (!strcmp(name, GIVEN))
    return f->given;
  if (!strcmp(name, NAMED))
    name = f->problem.choice;
  if (!strcmp(name, FACTOR))
    name = f->package;
  return name ? SbSolverPresetFind(name) : NULL;
}

PetscErrorCode SbSolverChoose(SbSpace s, const SbSolverProblem *problem, size_t size, char reason[],
                              const SbSolverPreset **preset)
{
  char method[SB_NAME_MAX] = "";
  PetscBool has = PETSC_TRUE;
  PetscBool may_rotate;
  SbSolverFacts f;

  PetscFunctionBeginUser;
  PetscCall(SbSolverFindFacts(s, &f));
  f.problem = *problem;
  PetscCall(PetscOptionsGetString(NULL, NULL, "-ksp_type", method, sizeof(method), NULL));
  f.minres = (PetscBool)!strcmp(method, KSPMINRES);
  if (!problem->explicit_run)
    PetscCall(SbSolverPresetOfUser(problem->choice, &f.given, &f.given_by));

  /* the interface between ranks, where the rotated factorisation may be taken */
  may_rotate =
    (PetscBool)(is(&f, "rotated") || is(&f, "realtime") || (is(&f, "auto") && rotation_pays(&f)));
  if (may_rotate && !f.given && !problem->explicit_run && s->ghosted)
    PetscCall(SbSpaceInterfaceSize(s, &f.interface, &f.interface_most));
  if (interface_too_large(&f) && !is(&f, "auto"))
    PetscCall(SbWarning(s->comm,
                        "-solver %s is for parts of ranks that meet at %" PetscInt_FMT
                        " nodes at most (-pc_rotated_interface), and these meet at %" PetscInt_FMT
                        ": another solver is taken; fewer ranks may be faster",
                        problem->choice, f.interface_most, f.interface));

  *preset = SbSolverChooseByFacts(&f, size, reason);
  PetscCheck(!s->rigid || !*preset ||
               (strcmp((*preset)->name, "cg_p_multigrid") && strcmp((*preset)->name, "pressure")),
             s->comm, PETSC_ERR_USER, "-solver %s does not know rigid bodies: take direct, or auto",
             (*preset)->name);
  PetscCheck(
    *preset, s->comm, PETSC_ERR_USER,
    "-solver direct needs SuiteSparse or MUMPS, and this PETSc was built without both: choose "
    "another solver, or auto");
  if ((*preset)->package)
    PetscCall(SbHasPackage((*preset)->package, &has));
  PetscCheck(
    has, s->comm, PETSC_ERR_USER,
    "%s %s needs %s, which this PETSc was built without: choose another one, or -solver auto",
    f.given ? f.given_by : "-solver", (*preset)->name, (*preset)->package);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- after a failure */

typedef struct {
  SbSolverFacts f;
  PetscBool direct; /* a factorisation failed */
  PetscBool memory; /* for want of memory */
} Failure;

/* A factorisation fails rarely but costs most; one for definite matrices first, then one for
   indefinite ones, which stress or rounding may cause. */
static PetscBool factor_definite(const Failure *x)
{
  return (PetscBool)(!x->memory && !x->f.indefinite);
}

static PetscBool factor_indefinite(const Failure *x)
{
  return (PetscBool)!x->memory;
}

static PetscBool factor_small_definite(const Failure *x)
{
  return (PetscBool)(factor_definite(x) && x->f.unknowns <= DIRECT_NEXT);
}

static PetscBool factor_small_indefinite(const Failure *x)
{
  return (PetscBool)(factor_indefinite(x) && x->f.unknowns <= DIRECT_NEXT);
}

/* A matrix that is singular for a factorisation is singular for iterations. */
static PetscBool iterations_may_help(const Failure *x)
{
  return (PetscBool)(!x->direct || x->memory);
}

static PetscBool pressures_may_help(const Failure *x)
{
  return (PetscBool)(iterations_may_help(x) && (x->f.p2 || x->f.cr_dg) && !x->f.constraints);
}

/* Algebraic multigrid takes thousands of iterations on CR and DG near nu = 1/2. */
static PetscBool multigrid_may_help(const Failure *x)
{
  return (PetscBool)(iterations_may_help(x) && x->f.face_nu <= NU_PRESSURE);
}

/* In place of a solver's name: the package for ... */
#define DEFINITE "definite"
#define INDEFINITE "indefinite"

static const struct {
  PetscBool (*holds)(const Failure *x);
  const char *solver;
} fallbacks[] = {
  {factor_small_definite, DEFINITE}, {factor_small_indefinite, INDEFINITE},
  {pressures_may_help, "pressure"},  {multigrid_may_help, "cg_gamg"},
  {factor_definite, DEFINITE},       {factor_indefinite, INDEFINITE},
};

PetscErrorCode SbSolverNextFallback(SbSpace s, KSPConvergedReason reason, PetscBool memory,
                                    uint32_t *tried, const SbSolverPreset **preset)
{
  Failure x = {.direct = (*preset)->direct, .memory = memory};

  PetscFunctionBeginUser;
  *tried |= SbSolverPresetBit(*preset);
  *preset = NULL;
  PetscCall(SbSolverFindFacts(s, &x.f));

  /* where the tangent may be indefinite, Newton's method changes it, and no other solver is
     tried */
  if (x.f.indefinite && reason == KSP_DIVERGED_INDEFINITE_MAT)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* the first row that holds, of a solver that this PETSc has and that has not failed yet */
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(fallbacks) && !*preset; k++) {
    const char *name = fallbacks[k].solver;
    const PetscBool definite = (PetscBool)!strcmp(name, DEFINITE);

    if (!fallbacks[k].holds(&x))
      continue;
    if (definite || !strcmp(name, INDEFINITE))
      PetscCall(SbDirectPackage(s->comm, x.f.unknowns, definite, &name));
    if (name)
      *preset = SbSolverPresetFind(name);
    if (*preset && (*tried & SbSolverPresetBit(*preset)))
      *preset = NULL;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ---- systems that need a factorisation of their own */

PetscErrorCode SbSolverChooseIndefinite(MPI_Comm comm, size_t size, char choice[])
{
  const char *package;

  PetscFunctionBeginUser;
  if (strcmp(choice, "auto") && strcmp(choice, "direct"))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbDirectPackage(comm, PETSC_MAX_INT, PETSC_FALSE, &package));
  PetscCheck(package, comm, PETSC_ERR_USER,
             "-static_control arc_length factors indefinite matrices, which takes MUMPS or "
             "UMFPACK, and this PETSc has neither: choose another -solver");
  PetscCall(PetscStrncpy(choice, package, size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSaddleChoose(SbSpace s, PetscBool dynamic, PetscInt choice, SbSaddle *saddle,
                              char reason[], size_t size)
{
  const PetscInt unknowns = 3 * s->Nnode;
  const PetscBool small_enough =
    (PetscBool)(unknowns <= (dynamic ? SADDLE_DYNAMIC : SADDLE_STATIC));
  const char *package;
  PetscBool direct;

  PetscFunctionBeginUser;
  PetscCall(SbDirectPackage(s->comm, unknowns, PETSC_FALSE, &package));
  PetscCheck(
    choice != 1 || package, s->comm, PETSC_ERR_USER,
    "-saddle_solver direct needs MUMPS or SuiteSparse, and this PETSc was built without both: use "
    "-saddle_solver iterative");
  direct = (PetscBool)(choice == 1 || (choice == 0 && package && small_enough));
  *saddle = direct ? SB_SADDLE_DIRECT : SB_SADDLE_NONE;
  if (direct)
    PetscCall(PetscSNPrintf(reason, size, "multipliers of contact directly, by %s", package));
  else
    PetscCall(PetscSNPrintf(reason, size, "constraints of contact by their null space"));
  PetscFunctionReturn(PETSC_SUCCESS);
}
