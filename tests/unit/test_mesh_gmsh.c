// Reader of gmsh files: the four variants of one mesh give the same result, each kind of damage has
// its message. @ranks 1
#include "../file.h"
#include "mesh_test.h"

#define DATA "tests/data/"

/* Groups of two_cubes, as gmsh writes them: number of items of each. */
static const struct {
  int dim;
  const char *group;
  PetscInt n;
} cubes[] = {{3, "left", 24}, {3, "all", 48},       {2, "wall", 4}, {2, "both ends", 8},
             {2, "inner", 4}, {2, "surface_77", 4}, {1, "edge", 1}, {0, "corner", 1}};

/* Two adjacent unit cubes: 24 tets each, 4 triangles on each side (two_cubes.geo). */
static PetscErrorCode test_variant(const char *path)
{
  SbImport im, reference;
  PetscReal difference = 0;

  PetscFunctionBeginUser;
  PetscCall(test_import(path, &im));
  PetscCall(test_import(DATA "two_cubes_41.msh", &reference));
  SB_CHECK(im.nvert == 23, "%s: %d vertices", path, (int)im.nvert);
  SB_CHECK(im.item[3].n == 48, "%s: %d tets", path, (int)im.item[3].n);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(cubes); k++) {
    const PetscInt n = test_count(&im, cubes[k].dim, cubes[k].group);

    SB_CHECK(n == cubes[k].n, "%s: %d of dimension %d in '%s'", path, (int)n, cubes[k].dim,
             cubes[k].group);
  }
  for (PetscInt i = 0; i < 3 * im.nvert && im.nvert == reference.nvert; i++)
    difference = PetscMax(difference, PetscAbsReal(im.x[i] - reference.x[i]));
  SB_CHECK(difference == 0, "%s: coordinates differ by %g", path, difference);
  SB_CHECK(im.item[3].n == reference.item[3].n &&
             !memcmp(im.item[3].vert, reference.item[3].vert, 4 * 48 * sizeof(PetscInt)),
           "%s: other tets", path);
  PetscCall(SbImportDestroy(&im));
  PetscCall(SbImportDestroy(&reference));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Binary file with the other byte order: the 4.1 file with every number of its sections
   reversed. */
static PetscErrorCode test_other_byte_order(void)
{
  static const unsigned char one[4] = {0, 0, 0, 1};
  char path[512];
  FILE *file;
  SbImport im;
  double x[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  uint32_t numbers[3 + 1 + 4] = {4, 1, 0, 1, 1, 2, 3, 4};

  PetscFunctionBeginUser;
  PetscCall(test_file_open(".msh", path, &file));
  fprintf(file, "$MeshFormat\n2.2 1 8\n");
  fwrite(one, 1, 4, file);
  fprintf(file, "\n$EndMeshFormat\n$Nodes\n4\n");
  for (uint32_t v = 0; v < 4; v++) {
    const uint32_t number = __builtin_bswap32(v + 1);

    fwrite(&number, 4, 1, file);
    for (int i = 0; i < 3; i++) {
      uint64_t bits;

      memcpy(&bits, &x[v][i], 8);
      bits = __builtin_bswap64(bits);
      fwrite(&bits, 8, 1, file);
    }
  }
  fprintf(file, "\n$EndNodes\n$Elements\n1\n");
  for (int i = 0; i < 8; i++) {
    numbers[i] = __builtin_bswap32(numbers[i]);
    fwrite(&numbers[i], 4, 1, file);
  }
  fprintf(file, "\n$EndElements\n");
  PetscCall(test_file_close(file));
  PetscCall(test_import(path, &im));
  SB_CHECK(im.nvert == 4 && im.item[3].n == 1, "%d vertices, %d tets", (int)im.nvert,
           (int)im.item[3].n);
  SB_CHECK(im.x[3] == 1 && im.x[11] == 1, "coordinates %g %g", im.x[3], im.x[11]);
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_damage(void)
{
  static const struct {
    const char *file, *words;
  } bad[] = {
    {"bad_empty.msh", "body 'b'|tests/data/bad_empty.msh|0 bytes"},
    {"bad_text.msh", "bad_text.msh|line 1|$MeshFormat"},
    {"bad_format1.msh", "bad_format1.msh"},
    {"bad_version.msh", "line 2|version '5.0'|4.1"},
    {"bad_truncated.msh", "line 15"},
    {"bad_truncated_nodes.msh", "line 5|5 nodes|3"},
    {"bad_truncated_end.msh", "line 15|$EndElements"},
    {"bad_truncated_bin.msh", "byte 1996"},
    {"bad_nan.msh", "line 9|node 4"},
    {"bad_number.msh", "line 9|1,5"},
    {"bad_count.msh", "line 5|900000000000 nodes"},
    {"bad_more.msh", "line 10|$EndNodes|'5'"},
    {"bad_block.msh", "line 6|7 nodes|4"},
    {"bad_order.msh", "line 4|$Elements"},
    {"bad_missing_node.msh", "line 13|element 1|node 9|$Nodes"},
    {"bad_node_twice.msh", "node 3"},
    {"bad_no_tets.msh", "body 'b'|tests/data/bad_no_tets.msh"},
    {"bad_surface.msh", "2 3-node"},
    {"bad_hexes.msh", "1 hexahedra"},
    {"bad_type.msh", "line 15|type 140|4-node tetrahedra"},
    {"bad_partitioned.msh", "line 4"},
  };
  char path[256];

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(bad); i++) {
    (void)snprintf(path, sizeof(path), DATA "%s", bad[i].file);
    SB_CHECK_ERROR(test_mesh_use(path), PETSC_ERR_FILE_UNEXPECTED, bad[i].words);
  }
  SB_CHECK_ERROR(test_mesh_use(DATA "none.msh"), PETSC_ERR_FILE_OPEN,
                 "body 'b'|tests/data/none.msh");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Any truncation of each variant gives an error, never a crash or a mesh. */
static PetscErrorCode test_cut(const char *whole_path, size_t step)
{
  char path[512], data[20000];
  FILE *file;
  size_t size;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(test_file_open(".msh", path, &file));
  PetscCall(test_file_close(file));
  file = fopen(whole_path, "rb");
  size = fread(data, 1, sizeof(data), file);
  fclose(file);
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  for (size_t n = 0; n < size - 1; n += step) { /* the last line end is dispensable */
    file = fopen(path, "wb");
    fwrite(data, 1, n, file);
    fclose(file);
    ierr = test_mesh_use(path);
    SB_CHECK(ierr, "%s cut to %zu of %zu bytes was accepted", whole_path, n, size);
  }
  PetscCall(PetscPopErrorHandler());
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SbImport im;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_variant(DATA "two_cubes_22.msh"));
  PetscCall(test_variant(DATA "two_cubes_22_bin.msh"));
  PetscCall(test_variant(DATA "two_cubes_41.msh"));
  PetscCall(test_variant(DATA "two_cubes_41_bin.msh"));
  PetscCall(test_other_byte_order());

  /* nodes with widely separated numbers, unused nodes, an irrelevant section */
  PetscCall(test_import(DATA "odd.msh", &im));
  SB_CHECK(im.nvert == 10 && im.item[3].n == 2, "%d vertices, %d tets", (int)im.nvert,
           (int)im.item[3].n);
  SB_CHECK(im.item[3].vert[1] == 2, "node 1000000000002 became vertex %d", (int)im.item[3].vert[1]);
  SB_CHECK(test_count(&im, 2, "skin") == 3 && test_count(&im, 3, "flesh") == 2,
           "groups of a file with names");
  PetscCall(SbImportDestroy(&im));
  PetscCall(test_damage());
  PetscCall(test_cut(DATA "two_cubes_22.msh", 7));
  PetscCall(test_cut(DATA "two_cubes_22_bin.msh", 7));
  PetscCall(test_cut(DATA "two_cubes_41.msh", 7));
  PetscCall(test_cut(DATA "two_cubes_41_bin.msh", 7));
  SB_TEST_END();
}
