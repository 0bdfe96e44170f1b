/*
  surface_files.h - closed surfaces for tests, written in every supported file format.
*/
#pragma once
#include "../file.h"

typedef struct {
  PetscInt nvert, ntri;
  PetscReal (*x)[3];
  PetscInt (*tri)[3];
} TestSurface;

static inline void test_surface_free(TestSurface *s)
{
  free(s->x);
  free(s->tri);
}

/* Room for another `nvert` vertices and `ntri` triangles behind those that are there. */
static inline void test_surface_grow(TestSurface *s, PetscInt nvert, PetscInt ntri)
{
  s->x = (PetscReal(*)[3])realloc(s->x, (size_t)(s->nvert + nvert) * sizeof(*s->x));
  s->tri = (PetscInt(*)[3])realloc(s->tri, (size_t)(s->ntri + ntri) * sizeof(*s->tri));
}

/* Corners of the sides of a box, counter-clockwise seen from outside; bit k of a number: the high
   end along axis k. */
static const int test_box_side[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                        {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

/* The box between two corners, two triangles a side; inwards: seen from outside its triangles are
   clockwise. */
static inline void test_surface_box(const PetscReal lo[3], const PetscReal hi[3], PetscBool inwards,
                                    TestSurface *s)
{
  const PetscInt first = s->nvert;

  test_surface_grow(s, 8, 12);
  for (int v = 0; v < 8; v++) {
    for (int k = 0; k < 3; k++)
      s->x[s->nvert][k] = v >> k & 1 ? hi[k] : lo[k];
    s->nvert++;
  }
  for (int f = 0; f < 12; f++) {
    const int *q = test_box_side[f / 2];
    PetscInt *t = s->tri[s->ntri++];

    t[0] = first + q[0];
    t[inwards ? 2 : 1] = first + q[1 + f % 2];
    t[inwards ? 1 : 2] = first + q[2 + f % 2];
  }
}

/* A torus around z: R to the middle of the tube, r its radius, n[0] and n[1] corners around axis
   and tube. */
static inline void test_surface_torus(PetscReal R, PetscReal r, const PetscInt n[2], TestSurface *s)
{
  test_surface_grow(s, n[0] * n[1], 2 * n[0] * n[1]);
  for (PetscInt i = 0; i < n[0]; i++) {
    const PetscReal a = 2 * PETSC_PI * (PetscReal)i / (PetscReal)n[0];

    for (PetscInt j = 0; j < n[1]; j++) {
      const PetscReal b = 2 * PETSC_PI * (PetscReal)j / (PetscReal)n[1];
      const PetscReal rho = R + r * PetscCosReal(b);
      const PetscInt i1 = (i + 1) % n[0];
      const PetscInt j1 = (j + 1) % n[1];
      PetscReal *x = s->x[s->nvert++];
      PetscInt *t = s->tri[s->ntri++];
      PetscInt *u = s->tri[s->ntri++];

      x[0] = rho * PetscCosReal(a);
      x[1] = rho * PetscSinReal(a);
      x[2] = r * PetscSinReal(b);
      t[0] = i * n[1] + j;
      t[1] = i1 * n[1] + j;
      t[2] = i1 * n[1] + j1;
      u[0] = i * n[1] + j;
      u[1] = i1 * n[1] + j1;
      u[2] = i * n[1] + j1;
    }
  }
}

/* The middle of an arc of the unit sphere; one vertex for both triangles at an edge. */
static inline PetscInt test_middle(TestSurface *s, PetscInt a, PetscInt b)
{
  PetscReal m[3];
  PetscReal length = 0;

  for (int k = 0; k < 3; k++) {
    m[k] = s->x[a][k] + s->x[b][k];
    length += m[k] * m[k];
  }
  length = PetscSqrtReal(length);
  for (int k = 0; k < 3; k++)
    m[k] /= length;
  for (PetscInt v = 6; v < s->nvert; v++)
    if (PetscAbsReal(s->x[v][0] - m[0]) + PetscAbsReal(s->x[v][1] - m[1]) +
          PetscAbsReal(s->x[v][2] - m[2]) <
        1e-9)
      return v;
  for (int k = 0; k < 3; k++)
    s->x[s->nvert][k] = m[k];
  return s->nvert++;
}

/* The unit sphere: the faces of an octahedron split into four n times. */
static inline void test_surface_sphere(int n, TestSurface *s)
{
  const PetscInt most = 8 << 2 * n;
  PetscInt(*old)[3] = (PetscInt(*)[3])malloc((size_t)most * sizeof(*old));

  test_surface_grow(s, most, most);
  for (int v = 0; v < 6; v++)
    for (int k = 0; k < 3; k++)
      s->x[v][k] = k == v / 2 ? (v % 2 ? -1 : 1) : 0;
  s->nvert = 6;
  for (int f = 0; f < 8; f++) {
    const int turned = (f & 1) ^ (f >> 1 & 1) ^ (f >> 2 & 1);
    PetscInt *t = s->tri[s->ntri++];

    t[0] = f & 1;
    t[1 + turned] = 2 + (f >> 1 & 1);
    t[2 - turned] = 4 + (f >> 2 & 1);
  }
  for (int k = 0; k < n; k++) {
    const PetscInt m = s->ntri;

    memcpy(old, s->tri, (size_t)m * sizeof(*old));
    s->ntri = 0;
    for (PetscInt f = 0; f < m; f++) {
      PetscInt mid[3];

      for (int e = 0; e < 3; e++)
        mid[e] = test_middle(s, old[f][e], old[f][(e + 1) % 3]);
      for (int e = 0; e < 4; e++) {
        PetscInt *t = s->tri[s->ntri++];

        t[0] = e < 3 ? old[f][e] : mid[0];
        t[1] = e < 3 ? mid[e] : mid[1];
        t[2] = e < 3 ? mid[(e + 2) % 3] : mid[2];
      }
    }
  }
  free(old);
}

/* The surface so far once more, scaled about the origin and shifted along x. */
static inline void test_surface_shifted_copy(TestSurface *s, PetscReal scale, PetscReal shift)
{
  const PetscInt nvert = s->nvert;
  const PetscInt ntri = s->ntri;

  test_surface_grow(s, nvert, ntri);
  for (PetscInt v = 0; v < nvert; v++)
    for (int k = 0; k < 3; k++)
      s->x[nvert + v][k] = scale * s->x[v][k] + (k ? 0 : shift);
  for (PetscInt f = 0; f < ntri; f++)
    for (int k = 0; k < 3; k++)
      s->tri[ntri + f][k] = nvert + s->tri[f][k];
  s->nvert += nvert;
  s->ntri += ntri;
}

/* ------------------------------------------------------------------ files */

static inline void write_stl(FILE *f, const TestSurface *s)
{
  fprintf(f, "solid a b\n");
  for (PetscInt t = 0; t < s->ntri; t++) {
    fprintf(f, "facet normal 0 0 0\n outer loop\n");
    for (int k = 0; k < 3; k++) {
      const PetscReal *x = s->x[s->tri[t][k]];

      fprintf(f, "  vertex %.17g %.17g %.17g\n", x[0], x[1], x[2]);
    }
    fprintf(f, " endloop\nendfacet\n");
  }
  fprintf(f, "endsolid a b\n");
}

static inline void write_little(FILE *f, uint32_t v)
{
  for (int k = 0; k < 4; k++)
    fputc((int)(v >> 8 * k & 255), f);
}

/* Its header begins like that of a text. */
static inline void write_stl_binary(FILE *f, const TestSurface *s)
{
  char header[80] = "solid binary";

  fwrite(header, 1, 80, f);
  write_little(f, (uint32_t)s->ntri);
  for (PetscInt t = 0; t < s->ntri; t++) {
    for (int k = 0; k < 12; k++) {
      const float x = k < 3 ? 0 : (float)s->x[s->tri[t][k / 3 - 1]][k % 3];
      uint32_t bits;

      memcpy(&bits, &x, 4);
      write_little(f, bits);
    }
    fputc(0, f);
    fputc(0, f);
  }
}

static inline void write_obj(FILE *f, const TestSurface *s)
{
  fprintf(f, "# a comment\no thing\n");
  for (PetscInt v = 0; v < s->nvert; v++)
    fprintf(f, "v %.17g %.17g %.17g\n", s->x[v][0], s->x[v][1], s->x[v][2]);
  fprintf(f, "vn 0 0 1\n\n");
  for (PetscInt t = 0; t < s->ntri; t++) {
    const PetscInt *v = s->tri[t];

    if (t % 2)
      fprintf(f, "f %d//1 %d//1 %d//1\n", (int)v[0] + 1, (int)v[1] + 1, (int)v[2] + 1);
    else
      fprintf(f, "f %d %d/7 %d\n", (int)(v[0] - s->nvert), (int)v[1] + 1, (int)v[2] + 1);
  }
}

static inline void write_off(FILE *f, const TestSurface *s)
{
  fprintf(f, "OFF\n# a comment\n%d %d 0\n", (int)s->nvert, (int)s->ntri);
  for (PetscInt v = 0; v < s->nvert; v++)
    fprintf(f, "%.17g %.17g %.17g\n", s->x[v][0], s->x[v][1], s->x[v][2]);
  for (PetscInt t = 0; t < s->ntri; t++)
    fprintf(f, "3 %d %d %d 255 0 0\n", (int)s->tri[t][0], (int)s->tri[t][1], (int)s->tri[t][2]);
}

static inline void write_msh(FILE *f, const TestSurface *s)
{
  fprintf(f, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%d\n", (int)s->nvert);
  for (PetscInt v = 0; v < s->nvert; v++)
    fprintf(f, "%d %.17g %.17g %.17g\n", (int)v + 1, s->x[v][0], s->x[v][1], s->x[v][2]);
  fprintf(f, "$EndNodes\n$Elements\n%d\n", (int)s->ntri);
  for (PetscInt t = 0; t < s->ntri; t++)
    fprintf(f, "%d 2 0 %d %d %d\n", (int)t + 1, (int)s->tri[t][0] + 1, (int)s->tri[t][1] + 1,
            (int)s->tri[t][2] + 1);
  fprintf(f, "$EndElements\n");
}

/*
  A file of this kind with the surface (s), or with the text when s is NULL, in the folder for
  temporary files. Collective: rank 0 writes, the path is the same on all ranks.
*/
static inline PetscErrorCode test_file_write(const char *extension, PetscBool binary,
                                             const TestSurface *s, const char *text, char path[512])
{
  static const struct {
    const char *extension;
    void (*write)(FILE *, const TestSurface *);
  } kinds[] = {{".stl", write_stl}, {".obj", write_obj}, {".off", write_off}, {".msh", write_msh}};
  FILE *f;

  PetscFunctionBeginUser;
  PetscCall(test_file_open(extension, path, &f));
  if (f) {
    if (text)
      fprintf(f, "%s", text);
    if (s && binary)
      write_stl_binary(f, s);
    for (size_t k = 0; s && !binary && k < PETSC_STATIC_ARRAY_LENGTH(kinds); k++)
      if (!strcmp(extension, kinds[k].extension))
        (*kinds[k].write)(f, s);
  }
  PetscCall(test_file_close(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}
