// @ranks 1 2
/*
  Every effect, element, material, field and other output (tests/parts.h lists them from the
  registries): if a scene names one, its log events occur; if not, none occur, nothing is allocated
  and the motion is bitwise the same.

    first    a process that has run only the base scene has no log event of anything else, and has
    allocated nothing in files of effects,
             contact and output
    named    compared with the base scene, exactly its own events are added, and for an element or a
    material that of the replaced one
             is missing; an effect is the only one of the model, and allocates; output leaves the
             motion bitwise the same
    after    the base scene run again has the same number and size of allocations as before, in
    set-up and in steps, its own events only
             and bitwise the same motion
    apart    two distant bodies in an explicit run, without solver tolerances: what is named for one
    does not change the
             motion of the other: bitwise for effects and materials, up to rounding for elements,
             which change the order of sums
    rows     an effect, element, material or output option without a row in tests/parts.h fails here
*/
#include "../parts.h"
#include "verify.h"

#define EVENTS 128 /* upper bound of the number of event names */

typedef struct {
  PetscBool bare; /* the space has no data of supports, contact and faces; the run has no monitor */
  PetscInt n;     /* unknowns: u[n], v[n] by original number */
  PetscReal *u, *v;
  PetscInt events[EVENTS]; /* number of times that each event began */
  PetscInt setup_n, step_n, neffect, n_effect, n_output;
  double setup_bytes, step_bytes, all_n, all_bytes,
    live; /* of our files; of all; in use before the run is destroyed */
} Trace;

static char event_name[EVENTS][2 * SB_NAME_MAX];
static PetscInt nevent;
static char folder[512];

static PetscErrorCode name_events(void)
{
  static char names[PART_NAMES][SB_NAME_MAX];
  PetscInt n;

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(part_families); k++) {
    PetscCall(part_names(part_families[k].name, &n, names));
    for (PetscInt i = 0; i < n && part_families[k].kind; i++)
      PetscCall(PetscSNPrintf(event_name[nevent++], sizeof(event_name[0]), "Sb%s_%s",
                              part_families[k].kind, names[i]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode count_events(PetscInt count[])
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < nevent; i++) {
    PetscLogDouble seconds;

    PetscCall(part_event(event_name[i], &count[i], &seconds));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Runs a scene from set-up to destruction. */
static PetscErrorCode run(const char *options, Trace *trace)
{
  PetscInt first[EVENTS];
  PetscLogDouble before;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(trace, sizeof(*trace)));
  PetscCall(count_events(first));
  PetscCall(PetscMemzero(&part_allocated, sizeof(part_allocated)));
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(SbOptionsReset());
  PetscCall(PetscMallocGetCurrentUsage(&before));
  PetscCall(test_scene_open_in(folder, options, &t));
  trace->setup_n = part_allocated.n_ours;
  trace->setup_bytes = part_allocated.bytes_ours;
  PetscCall(verify_solve(&t, options));
  trace->step_n = part_allocated.n_ours - trace->setup_n;
  trace->step_bytes = part_allocated.bytes_ours - trace->setup_bytes;
  trace->all_n = (double)part_allocated.n;
  trace->all_bytes = part_allocated.bytes;
  trace->n_effect = part_allocated.n_effect;
  trace->n_output = part_allocated.n_output;
  PetscCall(PetscMallocGetCurrentUsage(&trace->live));
  trace->live -= before;
  trace->neffect = t.model->neffect;
  trace->bare = (PetscBool)(!t.model->space->constraints && !t.model->space->jump &&
                            !t.model->space->nfixed && !t.run->monitors.n);
  trace->n = 3 * verify_numbers(t.model);
  PetscCall(verify_gather(t.model, t.run->state.U, &trace->u));
  if (t.run->state.V)
    PetscCall(verify_gather(t.model, t.run->state.V, &trace->v));
  PetscCall(test_scene_close(&t));
  PetscCall(count_events(trace->events));
  for (PetscInt i = 0; i < nevent; i++)
    trace->events[i] -= first[i];

  /* only rank 0 prints progress */
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, trace->events, EVENTS, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy(Trace *trace)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(trace->u));
  PetscCall(PetscFree(trace->v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool same_motion(const Trace *a, const Trace *b, PetscInt n)
{
  return (PetscBool)(!memcmp(a->u, b->u, sizeof(PetscReal) * (size_t)n) &&
                     !memcmp(a->v, b->v, sizeof(PetscReal) * (size_t)n));
}

/* Whether a comma-separated list contains a name. */
static PetscBool among(const char *name, const char *list)
{
  const size_t length = strlen(name);

  for (const char *at = list; (at = strstr(at, name)); at++)
    if ((at == list || at[-1] == ',') && (!at[length] || at[length] == ','))
      return PETSC_TRUE;
  return PETSC_FALSE;
}

/* Every option of the output belongs to a part. */
static PetscErrorCode check_output_rows(void)
{
  PetscInt n, nrow;
  const SbOptionRow *rows = part_output_rows(&nrow);
  static char names[PART_NAMES][SB_NAME_MAX];

  PetscFunctionBeginUser;
  SB_CHECK(rows, "the option table has no -output_dir");
  PetscCall(part_names("output", &n, names));
  for (PetscInt i = 0; i < nrow; i++) {
    const char *key = rows[i].row->key;
    const char *part = NULL;
    PetscBool known = PETSC_FALSE;

    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(part_options); k++)
      if (!strcmp(part_options[k].key, key))
        part = part_options[k].part;
    SB_CHECK(
      part, "-%s has no row in part_options of tests/parts.h: say which output it names or changes",
      key);
    for (PetscInt k = 0; part && k < n; k++)
      known = (PetscBool)(known || !strcmp(names[k], part));
    SB_CHECK(!part || !part[0] || known, "-%s belongs to '%s', which has no row in tests/parts.h",
             key, part ? part : "");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The events of `with` are those of `without` and those of the part; an element or a material
   replaces one event. */
static void check_events(const Part *part, const Trace *without, const Trace *with)
{
  const PetscBool replaces =
    (PetscBool)(!strcmp(part->family, "element") || !strcmp(part->family, "material"));
  PetscInt gone = 0;

  for (PetscInt i = 0; i < nevent; i++) {
    const PetscBool own = among(event_name[i], part->events);

    SB_CHECK(!own || with->events[i] > 0, "%s %s is named and %s was never begun", part->family,
             part->name, event_name[i]);
    SB_CHECK(!own || !without->events[i], "%s %s is not named and %s was begun %d times",
             part->family, part->name, event_name[i], (int)without->events[i]);
    SB_CHECK(own || without->events[i] || !with->events[i], "with %s %s %s was begun %d times, too",
             part->family, part->name, event_name[i], (int)with->events[i]);
    gone += without->events[i] && !with->events[i];
  }
  SB_CHECK(gone == (replaces ? 1 : 0), "with %s %s %d events are gone", part->family, part->name,
           (int)gone);
}

/* Scene with a preconditioner that needs only the matrix. */
static PetscErrorCode scene_text(const char *mesh, const char *scene, const char *options,
                                 char text[PART_TEXT])
{
  char more[PART_TEXT];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(more, sizeof(more), "-solver cg_jacobi %s", scene));
  PetscCall(part_text(mesh, more, options, text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Compares a scene that names the part with the same scene without it; then repeats the base
   scene. */
static PetscErrorCode check_part(const Part *part, const char *base, const Trace *reference)
{
  const PetscBool output =
    (PetscBool)(!strcmp(part->family, "output") || !strcmp(part->family, "field") ||
                !strcmp(part->family, "estimator") || !strcmp(part->family, "remesh"));
  Trace without, with, after;
  char text[PART_TEXT];

  PetscFunctionBeginUser;
  if (part->scene[0]) {
    PetscCall(scene_text("box:0.4,0.1,0.1:2", part->scene, "", text));
    PetscCall(run(text, &without));
  }
  PetscCall(scene_text("box:0.4,0.1,0.1:2", part->scene, part->options, text));
  PetscCall(run(text, &with));
  check_events(part, part->scene[0] ? &without : reference, &with);
  if (!strcmp(part->family, "effect")) {
    SB_CHECK(with.neffect > 0 && with.n_effect > 0, "%s: %d effects, %d allocations of theirs",
             part->name, (int)with.neffect, (int)with.n_effect);
  }
  if (output) {
    SB_CHECK(same_motion(part->scene[0] ? &without : reference, &with, with.n),
             "%s %s changes the motion", part->family, part->name);
  }
  PetscCall(run(base, &after));
  SB_CHECK(after.setup_n == reference->setup_n && after.setup_bytes == reference->setup_bytes,
           "after %s %s the set-up allocates %d times, %.0f bytes, before %d times, %.0f bytes",
           part->family, part->name, (int)after.setup_n, after.setup_bytes, (int)reference->setup_n,
           reference->setup_bytes);
  SB_CHECK(after.step_n == reference->step_n && after.step_bytes == reference->step_bytes,
           "after %s %s steps allocate %d times, %.0f bytes, before %d times, %.0f bytes",
           part->family, part->name, (int)after.step_n, after.step_bytes, (int)reference->step_n,
           reference->step_bytes);
  SB_CHECK(after.live == reference->live,
           "after %s %s the base scene holds %.0f bytes, before %.0f", part->family, part->name,
           after.live, reference->live);
  SB_CHECK(!memcmp(after.events, reference->events, sizeof(after.events)),
           "after %s %s the base scene has other events", part->family, part->name);
  SB_CHECK(same_motion(reference, &after, after.n), "after %s %s the base scene moves otherwise",
           part->family, part->name);
  test_print("  %-8s %-16s: %8.0f bytes more at the end of the run\n", part->family, part->name,
             with.live - (part->scene[0] ? without.live : reference->live));
  if (part->scene[0])
    PetscCall(destroy(&without));
  PetscCall(destroy(&with));
  PetscCall(destroy(&after));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A part that is named for the bar does not change the motion of a distant body; that body is the
   first one, so that its numbers stay the same. */
static PetscErrorCode check_apart(const Part *part, PetscBool exact)
{
  static const char far[] =
    "-bodies still,bar -body_still_mesh box:0.1,0.1,0.1:2 -body_still_translate -9,0,0 "
    "-body_still_material corotated -body_still_young 5e4 -body_still_poisson 0.4 "
    "-body_still_angular_velocity 1,2,3 -time euler_symplectic -ts_dt 1e-4 -ts_max_time 8e-4";
  const PetscInt n = 3 * 27; /* unknowns of the first body */
  Trace without, with;
  char text[PART_TEXT];

  PetscFunctionBeginUser;
  PetscCall(scene_text("box:0.4,0.1,0.1:2", far, "", text));
  PetscCall(run(text, &without));
  PetscCall(scene_text("box:0.4,0.1,0.1:2", far, part->options, text));
  PetscCall(run(text, &with));
  SB_CHECK(exact ? same_motion(&without, &with, n)
                 : verify_difference(n, without.u, with.u) < 1e-12 &&
                     verify_difference(n, without.v, with.v) < 1e-12,
           "%s %s of one body changes the motion of the other, by %g and %g", part->family,
           part->name, verify_difference(n, without.u, with.u),
           verify_difference(n, without.v, with.v));
  PetscCall(destroy(&without));
  PetscCall(destroy(&with));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_family(const char *family, const char *base, const Trace *reference)
{
  static char names[PART_NAMES][SB_NAME_MAX];
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(part_names(family, &n, names));
  for (PetscInt i = 0; i < n; i++) {
    Part part;
    PetscBool found;

    PetscCall(part_find(family, names[i], &part, &found));
    SB_CHECK(found, "%s %s has no row in tests/parts.h: say how the scene there names it", family,
             names[i]);

    /* parts of the base scene are tested by their replacements; the number of the body is written
       with any field */
    if (!found || !part.options[0] || !strcmp(part.events, ""))
      continue;
    PetscCall(check_part(&part, base, reference));
    if (part.apart)
      PetscCall(check_apart(&part, (PetscBool)strcmp(family, "element")));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before any other scene is run: parts that the base scene does not name do not exist. */
static PetscErrorCode check_first(const Trace *trace)
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < nevent; i++) {
    const PetscBool named = among(event_name[i], "SbElem_p1,SbMat_corotated");
    PetscLogEvent event;

    PetscCall(PetscLogEventGetId(event_name[i], &event));
    SB_CHECK(named == (PetscBool)(event >= 0), "%s %s", event_name[i],
             event < 0 ? "does not exist" : "exists");
    SB_CHECK(named == (PetscBool)(trace->events[i] > 0), "%s was begun %d times", event_name[i],
             (int)trace->events[i]);
  }
  SB_CHECK(trace->bare, "the base scene holds what it does not name");
  SB_CHECK(!trace->neffect && !trace->n_effect, "%d allocations in files of effects and contact",
           (int)trace->n_effect);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Trace first, reference, last;
  char base[PART_TEXT];

  /* the count of bytes requires PETSc's own malloc */
  (void)setenv("PETSC_OPTIONS", "-malloc_dump", 1);
  SB_TEST_BEGIN(argc, argv);
  PetscCall(PetscLogDefaultBegin());
  PetscCall(test_file_folder(folder));
  part_watch();
  PetscCall(SbRegisterAll());
  PetscCall(name_events());
  PetscCall(check_output_rows());
  PetscCall(scene_text("box:0.4,0.1,0.1:2", "", "", base));
  PetscCall(run(base, &first));
  PetscCall(check_first(&first));
  PetscCall(run(base, &reference)); /* the first run that needs them sets up parts of PETSc */
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(part_families); k++)
    PetscCall(check_family(part_families[k].name, base, &reference));
  PetscCall(run(base, &last));
  SB_CHECK(last.all_n == reference.all_n && last.all_bytes == reference.all_bytes,
           "with PETSc's own: %.0f allocations, %.0f bytes, after all others %.0f and %.0f",
           reference.all_n, reference.all_bytes, last.all_n, last.all_bytes);
  SB_CHECK(last.n_output == first.n_output, "%d allocations of output, before any was named %d",
           (int)last.n_output, (int)first.n_output);
  test_print("  the base scene allocates %d times, %.0f bytes, in " PART_STEPS " steps %d times\n",
             (int)reference.setup_n, reference.setup_bytes, (int)reference.step_n);
  PetscCall(destroy(&first));
  PetscCall(destroy(&reference));
  PetscCall(destroy(&last));
  part_unwatch();
  SB_TEST_END();
}
