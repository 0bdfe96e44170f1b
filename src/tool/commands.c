/*
  commands.c - commands of supple-mesh: one function per command, and their table.
*/
#include "tool.h"

static PetscErrorCode write_mesh(SbTool *tool, SbImport *mesh)
{
  char phase[PETSC_MAX_PATH_LEN + 16];
  static const char *const what[4] = {"points", "lines", "triangles", "tets"};
  char number[32];

  PetscFunctionBeginUser;
  (void)snprintf(phase, sizeof(phase), "writing %s", tool->out);
  SB_TOOL_PHASE(tool, phase, SbMeshFileWrite(mesh, tool->out, tool->format));

  /* message "out.h5: 1,234 vertices, 5,678 tets, 910 triangles" */
  if (!tool->quiet) {
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "%s: %s vertices", tool->out,
                          SbToolNumber(mesh->nvert, number)));
    for (int d = 3; d >= 0; d--)
      if (mesh->item[d].n || d == 3)
        PetscCall(
          PetscPrintf(PETSC_COMM_SELF, ", %s %s", SbToolNumber(mesh->item[d].n, number), what[d]));
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "\n"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode refine(SbTool *tool, SbImport *mesh)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < tool->levels; k++)
    SB_TOOL_PHASE(tool, "refining", SbMeshFileRefine(mesh));
  PetscCall(write_mesh(tool, mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode repair(SbTool *tool, SbImport *mesh)
{
  SbRepair r;
  char welded[96], folded[192], number[32];
  PetscBool any = PETSC_FALSE;
  const struct {
    const PetscInt *n;
    const char *what;
  } done[] = {
    {&r.nwelded, welded},
    {&r.ncollapsed, "tets that used a vertex twice, dropped"},
    {&r.nduplicate, "tets given again, dropped"},
    {&r.nflat, "flat tets dropped"},
    {&r.nslit, "  of these inside the body, each left a slit without width there"},
    {&r.nturned, "inverted tets turned"},
    {&r.nfolded, folded},
    {&r.nunused, "unused vertices dropped"},
    {&r.nitem, "triangles, lines and points of groups that are not of the tets, dropped"}};

  PetscFunctionBeginUser;
  SB_TOOL_PHASE(tool, "repairing", SbMeshFileRepair(mesh, tool->body.tet.merge_tolerance, &r));
  (void)snprintf(folded, sizeof(folded),
                 "tets that folded over themselves, with their edges made straight, the first "
                 "tetrahedron %lld at (%.4g, %.4g, %.4g) m",
                 (long long)r.folded, (double)r.folded_at[0], (double)r.folded_at[1],
                 (double)r.folded_at[2]);
  (void)snprintf(welded, sizeof(welded), "vertices welded to others at most %.3g m away",
                 (double)r.merge_tolerance);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(done) && !tool->quiet; i++) {
    if (!*done[i].n)
      continue;
    PetscCall(
      PetscPrintf(PETSC_COMM_SELF, "%s: %s\n", done[i].what, SbToolNumber(*done[i].n, number)));
    any = PETSC_TRUE;
  }
  if (!any && !tool->quiet)
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "nothing to repair\n"));
  PetscCall(write_mesh(tool, mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode surface(SbTool *tool, SbImport *mesh)
{
  SbSurfaceFacts facts;
  char phase[PETSC_MAX_PATH_LEN + 16];
  char note[256] = "";
  char number[2][32];

  PetscFunctionBeginUser;
  (void)snprintf(phase, sizeof(phase), "writing %s", tool->out);
  SB_TOOL_PHASE(tool, phase, SbMeshFileSurface(mesh, tool->group, tool->out, &facts));
  if (tool->quiet)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%s: %s vertices, %s triangles, %.6g m^2", tool->out,
                        SbToolNumber(facts.nvert, number[0]), SbToolNumber(facts.ntri, number[1]),
                        (double)facts.area));
  if (facts.closed)
    PetscCall(PetscPrintf(PETSC_COMM_SELF, ", around %.6g m^3", (double)facts.volume));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "\n"));
  if (facts.curved)
    SbAppend(sizeof(note), note, "curved edges: four flat triangles for each facet");
  SbNoteCount(sizeof(note), note, "inverted tets turned", mesh->nreoriented);
  SbNoteCount(sizeof(note), note, "triangles of groups that are no face of a tet, left out",
              mesh->nlost);
  SbNoteCount(sizeof(note), note, "edges with more than two triangles", mesh->npinched);
  if (note[0])
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "to know: %s\n", note));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbToolCommand SbToolCommands[] = {
  {"info", "FILE", "contents: size, groups, quality of the tets, memory that a run will take", 1,
   SbToolInfo},
  {"convert", "FILE OUT", "writes it in another format, groups and order kept", 2, write_mesh},
  {"tet", "SURFACE OUT",
   "fills a closed surface (.stl, .obj, .off, .ply, ...) with tets of edge length -size", 2,
   write_mesh},
  {"surface", "FILE OUT",
   "writes the surface of the tets, seen from outside, to .stl, .obj or .ply; of one region, "
   "body or surface by -group",
   2, surface},
  {"repair", "FILE OUT",
   "removes degenerate tets, corrects orientation, merges duplicate vertices; reports what it did",
   2, repair},
  {"refine", "FILE OUT", "divides every tet into eight; groups are kept", 2, refine},
  {NULL, NULL, NULL, 0, NULL},
};

PetscErrorCode SbToolRun(SbTool *tool)
{
  SbImport mesh = {.progress = SbToolProgress, .progress_ctx = tool};
  char phase[PETSC_MAX_PATH_LEN + 16];

  PetscFunctionBeginUser;
  PetscCheck(
    strcmp(tool->command->name, "tet") || SbMeshFileIsSurface(tool->in), PETSC_COMM_SELF,
    PETSC_ERR_USER,
    "%s: is no surface that tet can fill, by its name; give a closed surface of triangles (.stl, "
    ".obj, .off, .ply, ...); supple-mesh info says what a mesh of tets holds",
    tool->in);

  PetscCheck(strcmp(tool->command->name, "surface") || !SbMeshFileIsSurface(tool->in),
             PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: is a surface already, by its name; give a mesh of tets", tool->in);

  // read the mesh, with a progress message
  (void)snprintf(phase, sizeof(phase), "%s %s",
                 SbMeshFileIsSurface(tool->in) ? "making tets from" : "reading", tool->in);
  SB_TOOL_PHASE(tool, phase, SbImportRead(&tool->body, &mesh));
  if (tool->command->run != SbToolInfo && !tool->quiet && mesh.note[0])
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "%s: %s\n", tool->in, mesh.note));
  PetscCall(tool->command->run(tool, &mesh));
  if (tool->view[0])
    PetscCall(SbToolView(tool, &mesh));
  PetscCall(SbImportDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}
