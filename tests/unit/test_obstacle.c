// @ranks 1
/*
  Rigid obstacles: known signed distances, normals against finite differences of the distance,
  closest points on the surface; poses; errors of the description.
*/
#include "effect_fixture.h"
#include "../../src/contact/obstacle.h"

static const char *const texts[] = {"plane:0,3,4,5",
                                    "sphere:0.3,0.2,-0.1,0.7",
                                    "box:-0.5,-0.4,-0.3,0.6,0.5,0.7",
                                    "capsule:-0.4,0.1,0,0.5,0.3,0.2,0.35",
                                    "cylinder:-0.4,0.1,0,0.5,0.3,0.2,0.35",
                                    "bowl:0.1,0,0.2,1.3"};

/* Whether the normal is continuous around x; at a kink of the distance finite differences are
   meaningless. */
static PetscBool smooth(SbObstacle o, const PetscReal x[3], PetscReal h)
{
  PetscReal n[3], other[3];

  (void)SbObstacleDistance(o, x, n);
  for (int k = 0; k < 6; k++) {
    PetscReal y[3] = {x[0], x[1], x[2]};

    y[k / 2] += k % 2 ? h : -h;
    (void)SbObstacleDistance(o, y, other);
    if (SbDot3(n, other) < 0.999)
      return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

static PetscErrorCode check_shape(const char *text)
{
  const PetscReal h = 1e-5;
  SbObstacle o;
  PetscInt seen[2] = {0, 0};
  unsigned state = 7;

  PetscFunctionBeginUser;
  PetscCall(SbObstacleCreate("-o", text, &o));
  for (int i = 0; i < 1000; i++) {
    PetscReal x[3], n[3], foot[3], m[3], d;

    for (int k = 0; k < 3; k++)
      x[k] = 0.9 * test_random(&state);
    d = SbObstacleDistance(o, x, n);
    SB_CHECK_NEAR(SbDot3(n, n), 1, 1e-14, text);
    if (!smooth(o, x, h))
      continue;
    seen[d < 0]++;
    for (int k = 0; k < 3; k++) {
      PetscReal y[3] = {x[0], x[1], x[2]};
      PetscReal more, less;

      foot[k] = x[k] - d * n[k];
      y[k] = x[k] + h;
      more = SbObstacleDistance(o, y, m);
      y[k] = x[k] - h;
      less = SbObstacleDistance(o, y, m);

      /* third derivatives are at most 1/r^2 at distances r from the core of 0.03 and more:
         h^2/6/r^2 is below 2e-8 */
      SB_CHECK_NEAR((more - less) / (2 * h), n[k], 1e-6, text);
    }
    SB_CHECK_NEAR(SbObstacleDistance(o, foot, m), 0, 1e-12, text);
  }
  SB_CHECK(seen[0] > 20 && seen[1] > 20, "%s: %d points outside, %d inside", text, (int)seen[0],
           (int)seen[1]);
  PetscCall(SbObstacleDestroy(&o));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_points(void)
{
  const PetscReal h = PETSC_SQRT2 / 2;
  const struct {
    const char *text;
    PetscReal x[3], distance, normal[3];
  } points[] = {
    {"plane:0,0,2,1", {4, 5, 0.25}, -0.25, {0, 0, 1}},
    {"sphere:1,2,3,0.5", {3, 2, 3}, 1.5, {1, 0, 0}},
    {"sphere:1,2,3,0.5", {1, 2, 3}, -0.5, {0, 0, 1}},
    {"bowl:0,0,0,2", {0, 0, 1.5}, 0.5, {0, 0, -1}},
    {"bowl:0,0,0,2", {3, 0, 0}, -1, {-1, 0, 0}},
    {"box:0,0,0,1,2,3", {2, 3, 1}, PETSC_SQRT2, {h, h, 0}},
    {"box:0,0,0,1,2,3", {0.5, 1, 2.75}, -0.25, {0, 0, 1}},
    {"capsule:0,0,0,0,0,2,0.5", {1, 0, 1}, 0.5, {1, 0, 0}},
    {"capsule:0,0,0,0,0,2,0.5", {0, 0, -1}, 0.5, {0, 0, -1}},
    {"cylinder:0,0,0,0,0,2,0.5", {0.25, 0, -1}, 1, {0, 0, -1}},
    {"cylinder:0,0,0,0,0,2,0.5", {0.25, 0, 1}, -0.25, {1, 0, 0}},
  };

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(points); i++) {
    PetscReal n[3];
    SbObstacle o;

    PetscCall(SbObstacleCreate("-o", points[i].text, &o));
    SB_CHECK_NEAR(SbObstacleDistance(o, points[i].x, n), points[i].distance, 1e-14, points[i].text);
    for (int k = 0; k < 3; k++)
      SB_CHECK_NEAR(n[k], points[i].normal[k], 1e-14, points[i].text);
    PetscCall(SbObstacleDestroy(&o));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void check_poses(void)
{
  const PetscReal axis[3] = {2. / 3, 1. / 3, -2. / 3};
  const PetscReal c[3] = {0.1, 0.2, 0.3};
  const PetscReal d[3] = {1, -2, 0.5};
  const PetscReal z[3] = {0, 0, 1};
  const PetscReal none[3] = {0, 0, 0};
  const PetscReal e[3] = {1, 0, 0};
  PetscReal x[3], X[3];
  const PetscReal moved[3] = {1 + 3e-6, -2, 0.5};
  unsigned state = 3;
  SbPose pose, next;

  SbPoseSet(z, PETSC_PI / 2, none, d, &pose);
  SbPoseApply(&pose, e, x);
  SB_CHECK_NEAR(x[0], 1, 1e-15, "a right-handed quarter turn, then the shift");
  SB_CHECK_NEAR(x[1], -1, 1e-15, "a right-handed quarter turn, then the shift");
  SbPoseSet(axis, 1.1, c, d, &pose);
  SbPoseSet(axis, 1.1 + 1e-6, c, moved, &next);
  SbPoseApply(&pose, c, x);
  for (int k = 0; k < 3; k++)
    SB_CHECK_NEAR(x[k], c[k] + d[k], 1e-15, "the centre is only shifted");
  for (int i = 0; i < 9; i++)
    SB_CHECK_NEAR(SbDot3(pose.R + 3 * (i / 3), pose.R + 3 * (i % 3)), i % 4 == 0, 1e-15, "R R^T");
  for (int i = 0; i < 20; i++) {
    PetscReal p[3], way[3];

    for (int k = 0; k < 3; k++)
      p[k] = test_random(&state);
    SbPoseApply(&pose, p, x);
    SbPoseInvert(&pose, x, X);
    for (int k = 0; k < 3; k++)
      SB_CHECK_NEAR(X[k], p[k], 1e-15, "there and back");
    SbPoseWay(&pose, &next, &pose, x, way);
    SbPoseApply(&next, p, X);
    for (int k = 0; k < 3; k++)
      SB_CHECK_NEAR(way[k], X[k] - x[k], 1e-11, "a short arc is its chord");
    SbPoseWay(&pose, &next, &next, X, way);
    for (int k = 0; k < 3; k++)
      SB_CHECK_NEAR(way[k], X[k] - x[k], 1e-11, "from its other end, too");
  }
}

static PetscErrorCode check_errors(void)
{
  static const char *const refused[][2] = {
    {"cone:1,2,3", "-floor cone:1,2,3"},
    {"plane", "-floor plane|mesh:FILE"},
    {"plane:0,0,1", "plane:nx,ny,nz,d"},
    {"plane:0,0,0,1", "-floor plane:0,0,0,1"},
    {"sphere:0,0,0,-1", "-floor sphere:0,0,0,-1"},
    {"sphere:0,0,0,1,5", "sphere:x,y,z,r"},
    {"sphere:0,0,nan,1", "sphere:x,y,z,r"},
    {"box:0,0,0,1,-1,1", "-floor box:0,0,0,1,-1,1"},
    {"capsule:1,1,1,1,1,1,1", "-floor capsule:1,1,1,1,1,1,1"},
    {"cylinder:1,1,1,1,1,2,0", "-floor cylinder:1,1,1,1,1,2,0"},
  };

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(refused); k++) {
    SbObstacle o = NULL;

    SB_CHECK_ERROR(SbObstacleCreate("-floor", refused[k][0], &o), PETSC_ERR_USER_INPUT,
                   refused[k][1]);
    PetscCall(SbObstacleDestroy(&o));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(texts); k++)
    PetscCall(check_shape(texts[k]));
  PetscCall(check_points());
  check_poses();
  PetscCall(check_errors());
  SB_TEST_END();
}
