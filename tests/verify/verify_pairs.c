// @ranks 1 2
/*
  Contact forces by pairs of bodies: history columns of each pair, and contact points.

    heap    three bodies collide above a floor, with and without friction: in every step the columns
    of a body's
            pairs sum to the net contact force on it, contact points sum to the columns, and their
            number is the reported one
    fold    a hairpin is compressed: its self-contact pair has all contacts and the complete normal
    force
    search  the heap by the hash and by trees: the same motion, to the last bit
    errors  refused: more pairs than the history supports; body names that give two columns the
    same name

  Sums are compared with the contact forces in the equations of motion, which are computed without
  pairs.
*/
#include "contact.h"

#define BODIES 3
#define LAW(name)                                                           \
  " -body_" name "_material corotated -body_" name "_young 3e4 -body_" name \
  "_poisson 0.3 -body_" name "_density 1000 "
#define HEAP                                                                                       \
  "-bodies low,left,top -body_low_mesh box:0.08,0.08,0.04:2 -body_left_mesh box:0.04,0.07,0.04:2 " \
  "-body_left_rotate 1,1,0,8 -body_left_translate 0.01,0.01,0.046 -body_top_mesh "                 \
  "box:0.06,0.05,0.03:2 "                                                                          \
  "-body_top_rotate 0,1,0.3,12 -body_top_translate 0.02,0.02,0.1 -body_low_velocity 0,0,1.5 "      \
  "-body_top_velocity 0,0,-1.5 -body_left_velocity 0.2,0,0" LAW("low") LAW("left") LAW(            \
    "top") "-effects meet,floor -effect_floor_type contact "                                       \
           "-effect_floor_obstacle plane:0,0,1,-0.01 -effect_floor_on low -effect_floor_friction " \
           "0.3 "                                                                                  \
           "-effect_meet_type contact -effect_meet_pairs yes "                                     \
           "-time euler_implicit -ts_dt 0.002 -ts_max_time 0.02 -snes_rtol 1e-9 -ksp_rtol 1e-8 "

typedef struct {
  PetscReal
    worst[4]; /* errors of columns, of contact points, of obstacles (N), and of contact counts */
  PetscReal largest; /* net force, N */
  PetscInt places, edges, steps;
  PetscBool met[BODIES * BODIES];
} Watch;

/* Sums over the contact points of all ranks: force[e][a][b][3] of body b on body a by effect e, b =
   nbody for an obstacle; n[e] points with a force. */
static PetscErrorCode sum_places(SbRun run, PetscReal t, Watch *w,
                                 PetscReal force[2][BODIES][BODIES + 1][3], PetscReal n[2])
{
  SbContactPoints list = {0};

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(force, sizeof(PetscReal) * 2 * BODIES * (BODIES + 1) * 3));
  n[0] = n[1] = 0;
  PetscCall(SbContactSetPoints(&run->model->contacts, t, run->state.U, &list));
  for (PetscInt i = 0; i < list.n; i++) {
    const SbContactPoint *p = &list.point[i];

    SB_CHECK_NEAR(SbDot3(p->normal, p->normal), 1, 1e-9, "length of a normal");
    n[p->effect] += SbDot3(p->force, p->force) > 0;
    w->places++;
    w->edges += p->effect == 0 && p->id[0];
    for (int k = 0; k < 3; k++)
      force[p->effect][p->body[0]][p->body[1] < 0 ? BODIES : p->body[1]][k] += p->force[k];
  }
  PetscCall(PetscFree(list.point));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, force, 2 * BODIES * (BODIES + 1) * 3, MPIU_REAL, MPI_SUM,
                             run->model->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, n, 2, MPIU_REAL, MPI_SUM, run->model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode pair_column(SbRun run, PetscReal t, int a, int b, const char *what,
                                  PetscReal *value)
{
  char name[3 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(name, sizeof(name), "%s_%s_%s", run->model->body[a].name,
                          run->model->body[b].name, what));
  PetscCall(contact_column(run, t, "meet", name, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode watch_heap(SbRun run, const SbStep *step, void *ctx)
{
  static const char *const along[] = {"force_x", "force_y", "force_z"};
  Watch *w = (Watch *)ctx;
  PetscReal force[2][BODIES][BODIES + 1][3], n[2], net[3 * BODIES], contacts;
  PetscReal all = 0;
  PetscReal value;

  PetscFunctionBeginUser;
  PetscCall(contact_body_forces(run, step->t, net));
  PetscCall(sum_places(run, step->t, w, force, n));
  for (int i = 0; i < 3 * BODIES; i++)
    w->largest = PetscMax(w->largest, PetscAbsReal(net[i]));
  for (int k = 0; k < 3; k++) {
    PetscCall(contact_column(run, step->t, "floor", along[k], &value));
    w->worst[2] = PetscMax(w->worst[2], PetscAbsReal(value - force[1][0][BODIES][k]));
    net[k] -= value;
  }
  for (int a = 0; a < BODIES; a++) {
    for (int b = a + 1; b < BODIES; b++) {
      PetscCall(pair_column(run, step->t, a, b, "contacts", &contacts));
      all += contacts;
      if (contacts > 0)
        w->met[BODIES * a + b] = PETSC_TRUE;
      for (int k = 0; k < 3; k++) {
        PetscCall(pair_column(run, step->t, a, b, along[k], &value));
        w->worst[1] =
          PetscMax(w->worst[1], PetscAbsReal(value - force[0][b][a][k] + force[0][a][b][k]));
        net[3 * b + k] -= value;
        net[3 * a + k] += value;
      }
    }
  }
  for (int i = 0; i < 3 * BODIES; i++)
    w->worst[0] = PetscMax(w->worst[0], PetscAbsReal(net[i]));
  PetscCall(contact_column(run, step->t, "meet", "contacts", &contacts));
  w->worst[3] =
    PetscMax(w->worst[3], PetscMax(PetscAbsReal(all - contacts), PetscMax(0, contacts - n[0])));
  w->steps++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_heap(const char *more)
{
  Watch w = {.largest = 0};
  PetscInt counts[2];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, HEAP "%s", more));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch_heap, &w));
  PetscCall(verify_solve(&t, more));
  counts[0] = w.places;
  counts[1] = w.edges;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, counts, 2, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  test_print("  heap%s: net force up to %g N; columns %.1e, places %.1e, obstacles %.1e of it; %d "
             "places in %d steps, %d of edges\n",
             more, w.largest, w.worst[0] / w.largest, w.worst[1] / w.largest,
             w.worst[2] / w.largest, (int)counts[0], (int)w.steps, (int)counts[1]);
  SB_CHECK(w.largest > 1 && counts[0] > 30, "%s: the bodies did not meet: %g N, %d places", more,
           w.largest, (int)counts[0]);
  SB_CHECK(w.met[1] && w.met[BODIES + 2], "%s: two neighbours have not met", more);
  for (int k = 0; k < 3; k++)
    SB_CHECK(w.worst[k] < 1e-10 * w.largest, "%s: sum %d differs by %g of %g N", more, k,
             w.worst[k], w.largest);
  SB_CHECK(w.worst[3] == 0, "%s: %g contacts are not told of", more, w.worst[3]);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ self-contact */

/* Strip of 8 mm that is straight, bends around a half circle, and returns. */
static void hairpin(const VerifyPlace *place, PetscReal x[3])
{
  const PetscReal leg = 0.08;
  const PetscReal radius = 0.02;
  const PetscReal way = 2 * leg + PETSC_PI * radius;
  const PetscReal s = x[0] * way;
  const PetscReal out = 0.008 * (x[2] - 0.5);
  const PetscReal y = 0.02 * x[1];
  const PetscReal angle = PetscMin(PetscMax((s - leg) / radius, 0), PETSC_PI);

  (void)place;
  x[0] = leg - PetscMax(0, leg - s) - PetscMax(0, s - leg - PETSC_PI * radius) +
         (radius - out) * PetscSinReal(angle);
  x[1] = y;
  x[2] = radius - (radius - out) * PetscCosReal(angle);
}

static PetscErrorCode watch_fold(SbRun run, const SbStep *step, void *ctx)
{
  PetscReal *most = (PetscReal *)ctx;
  PetscReal own[2], whole[2];

  PetscFunctionBeginUser;
  PetscCall(contact_column(run, step->t, "meet", "a_a_contacts", &own[0]));
  PetscCall(contact_column(run, step->t, "meet", "a_a_normal_force", &own[1]));
  PetscCall(contact_column(run, step->t, "meet", "contacts", &whole[0]));
  PetscCall(contact_column(run, step->t, "meet", "normal_force", &whole[1]));
  for (int k = 0; k < 2; k++) {
    most[k] = PetscMax(most[k], whole[k]);
    SB_CHECK_NEAR(own[k], whole[k], 1e-12 * whole[k], "the pair of the body with itself");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest displacement and its sum over the owned nodes, with `more` options. */
static PetscErrorCode end_of(const char *scene, const char *more, PetscReal end[2])
{
  const PetscScalar *u;
  PetscInt n;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, "%s %s", scene, more));
  PetscCall(verify_solve(&t, more));
  PetscCall(VecGetLocalSize(t.run->state.U, &n));
  PetscCall(VecGetArrayRead(t.run->state.U, &u));
  end[0] = end[1] = 0.;
  for (PetscInt i = 0; i < n; i++) {
    end[0] = PetscMax(end[0], PetscAbsReal(PetscRealPart(u[i])));
    end[1] += PetscRealPart(u[i]);
  }
  PetscCall(VecRestoreArrayRead(t.run->state.U, &u));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The search is the hash's or the trees': nothing else changes. */
static PetscErrorCode check_search(void)
{
  PetscReal end[2][2];

  PetscFunctionBeginUser;
  PetscCall(end_of(HEAP, "-effect_meet_search hash", end[0]));
  PetscCall(end_of(HEAP, "-effect_meet_search tree", end[1]));
  SB_CHECK(end[0][0] == end[1][0] && end[0][1] == end[1][1] && end[0][0] > 0.,
           "the heap moves by %.17g with the hash and %.17g with trees, in sum %.17g and %.17g",
           end[0][0], end[1][0], end[0][1], end[1][1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_fold(void)
{
  const PetscInt n[3] = {22, 2, 1};
  PetscReal most[2] = {0, 0};
  char path[512];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, hairpin, NULL, path));
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh %s" LAW(
      "a") "-sets low,high -set_low_at box:-1,-1,-1,0.03,1,0.01 -set_high_at "
           "box:-1,-1,0.043,0.002,1,1 -effects hold,press,meet -effect_hold_type fixed "
           "-effect_hold_on low -effect_press_type prescribed_displacement -effect_press_on high "
           "-effect_press_displacement 0;0;-0.4*t -effect_meet_type contact -effect_meet_self yes "
           "-effect_meet_pairs yes -time euler_implicit -ts_dt 0.005 -ts_max_time 0.085",
    path));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch_fold, most));
  PetscCall(verify_solve(&t, "fold"));
  test_print("  fold: up to %d contacts with %g N\n", (int)most[0], most[1]);
  SB_CHECK(most[0] > 1 && most[1] > 0.01, "the legs did not meet: %g contacts, %g N", most[0],
           most[1]);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ errors */

/* Bodies with these names, one above the other; names: text of the error, NULL: no error. */
static PetscErrorCode try_bodies(int n, const char *const name[], const char *more,
                                 const char *names)
{
  char text[32 * 256] = "-bodies ";
  char one[256];
  TestScene t;

  PetscFunctionBeginUser;
  for (int b = 0; b < n; b++) {
    PetscCall(PetscStrlcat(text, b ? "," : "", sizeof(text)));
    PetscCall(PetscStrlcat(text, name[b], sizeof(text)));
  }
  for (int b = 0; b < n; b++) {
    PetscCall(
      PetscSNPrintf(one, sizeof(one),
                    " -body_%s_mesh box:1,1,1:1 -body_%s_translate 0,0,%d -body_%s_material linear "
                    "-body_%s_young 1e4 -body_%s_poisson 0.3",
                    name[b], name[b], 2 * b, name[b], name[b], name[b]));
    PetscCall(PetscStrlcat(text, one, sizeof(text)));
  }
  PetscCall(PetscStrlcat(
    text, " -effects meet -effect_meet_type contact -ts_dt 0.01 -ts_max_time 0.02 ", sizeof(text)));
  PetscCall(PetscStrlcat(text, more, sizeof(text)));
  if (names)
    SB_CHECK_ERROR(test_scene_open(text, &t), PETSC_ERR_USER_INPUT, names);
  else
    SB_CHECK(!test_scene_open(text, &t), "'%s' is refused", more);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const many[] = {"a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k",
                                     "l", "m", "n", "o", "p", "q", "r", "s", "t", "u"};
  static const char *const alike[] = {"a", "b_c", "a_b", "c"};

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_heap(" -effect_meet_friction 0.3"));
  PetscCall(check_heap(""));
  PetscCall(check_heap(" -body_left_element cr"));
  PetscCall(check_fold());
  PetscCall(check_search());
  PetscCall(try_bodies(21, many, "", NULL));
  PetscCall(try_bodies(20, many, "-effect_meet_pairs yes", NULL));
  PetscCall(
    try_bodies(21, many, "-effect_meet_pairs yes", "21 bodies|-effect_meet_on|210 pairs|200"));
  PetscCall(try_bodies(20, many, "-effect_meet_pairs yes -effect_meet_self yes", "210 pairs"));
  PetscCall(try_bodies(4, alike, "-effect_meet_pairs yes", "meet_a_b_c_force_x"));
  SB_TEST_END();
}
