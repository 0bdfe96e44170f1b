/*
  line.c - command line of supple-mesh: a command, one or two files, options in any order.

  Options are rows of a table as in supple itself; each row lists the commands that read it. An
  option that the command does not read is an error, as is a misspelt one.
*/
#include <strings.h>
#include "tool.h"

static const SbOption rows[] = {
  {"size", SB_OPTION_REAL, 1, "m", "", "(0, inf)",
   "edge length of the tets; default: the mean edge of the surface's triangles"},
  {"near", SB_OPTION_STRING, 1, "m", "", "",
   "places with finer tets, in the mesh that is written: sphere:x,y,z,r,size or "
   "box:x0,y0,z0,x1,y1,z1,size, several separated by semicolons; sizes grow away from them"},
  {"surface", SB_OPTION_CHOICE, 1, "", "auto", "auto|keep|remesh",
   "keep the triangles of the surface, or remesh it: auto keeps them when their mean edge is "
   "within a factor "
   "of 1.5 of the size"},
  {"angle", SB_OPTION_REAL, 1, "degrees", "40", "(0, 180)",
   "feature angle: edges where the normals of the surface differ by more are kept when it is "
   "remeshed"},
  {"tetrahedralizer", SB_OPTION_CHOICE, 1, "", "auto", "auto|gmsh|tetgen",
   "program that fills a surface with tets: auto tries gmsh, then tetgen"},
  {"seconds", SB_OPTION_REAL, 1, "s", "600", "(0, inf)", "time limit of gmsh, and then of tetgen"},
  {"untangle", SB_OPTION_REAL, 1, "m", "", "[0, inf)",
   "largest displacement of vertices that removes small self-intersections of a surface; default: "
   "half its "
   "mean edge"},
  {"merge_tolerance", SB_OPTION_REAL, 1, "m", "", "[0, inf)",
   "vertices closer than this are merged; 0: none; default: 1e-9 of the diagonal of the mesh (tet: "
   "1e-7)"},
  {"levels", SB_OPTION_INT, 1, "", "1", "[1, 8]",
   "number of refinements, each into 8 times as many tets"},
  {"format", SB_OPTION_CHOICE, 1, "", "auto", "auto|msh41|msh41_binary|msh22|msh22_binary|h5",
   "output format; auto: .msh is msh41 (text), .h5 is h5"},
  {"group", SB_OPTION_STRING, 1, "", "", "",
   "region, body or surface of FILE, by its name in info: its surface alone"},
  {"step", SB_OPTION_INT, 1, "", "0", "[-1, inf)",
   "when FILE is the output of a run (fields.h5): number of the frame whose positions are taken; "
   "0: "
   "reference configuration, -1: the last"},
  {"scale", SB_OPTION_REAL, 1, "", "1", "(0, inf)",
   "factor on the coordinates; 0.001 for a file in mm"},
  {"rotate", SB_OPTION_REALS, 4, "", "0,0,1,0", "(-inf, inf)",
   "axis x,y,z and angle in degrees, after scaling"},
  {"translate", SB_OPTION_REALS, 3, "m", "0,0,0", "(-inf, inf)", "translation, after rotation"},
  {"view", SB_OPTION_STRING, 1, "", "", "", "draw the mesh to this .png"},
  {"quiet", SB_OPTION_BOOL, 1, "", "false", "", "print nothing but errors"},
};
/* Commands that read each row; "" for all. */
static const char *const readers[] = {
  "tet",     "tet", "tet",        "tet",    "tet",
  "tet",     "tet", "tet repair", "refine", "convert tet repair refine",
  "surface", "",    "",           "",       "",
  "",        ""};
_Static_assert(PETSC_STATIC_ARRAY_LENGTH(rows) == SB_TOOL_OPTIONS &&
                 PETSC_STATIC_ARRAY_LENGTH(readers) == SB_TOOL_OPTIONS,
               "one entry for each option");

/* First words of PETSc's options. */
static const char *const petsc = "log_ malloc options_ info on_error_ error_ memory fp_trap "
                                 "no_signal_handler start_in_debugger skip_petscrc citations";

PetscErrorCode SbToolHelp(void)
{
  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "supple-mesh %s - examines, converts and repairs meshes for supple\n\n",
                        SB_VERSION));
  for (const SbToolCommand *c = SbToolCommands; c->name; c++)
    PetscCall(
      PetscPrintf(PETSC_COMM_WORLD, "  supple-mesh %-8s%-12s %s\n", c->name, c->files, c->help));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "\nFILE: whatever -body_<name>_mesh takes, also box:lx,ly,lz:n. OUT: .msh "
                        "(gmsh), or .h5 (supple's own, with an .xmf for ParaView); of surface "
                        ".stl, .obj or .ply.\n\nOptions\n"));
  for (int i = 0; i < SB_TOOL_OPTIONS; i++) {
    const SbOption *r = &rows[i];

    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  -%s%s%s%s%s%s%s%s%s\n      %s\n", r->key,
                          r->range[0] ? ": in " : "", r->range, r->unit[0] ? " " : "", r->unit,
                          r->preset[0] ? ", default " : "", r->preset,
                          readers[i][0] ? "; for " : "", readers[i], r->help));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbOption *find_row(const char *key)
{
  for (int i = 0; i < SB_TOOL_OPTIONS; i++)
    if (!strcasecmp(rows[i].key, key))
      return &rows[i];
  return NULL;
}

static PetscBool is_truth(const char *word)
{
  static const char *const words[] = {"true", "false", "yes", "no", "on", "off", "0", "1"};

  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(words); i++)
    if (!strcasecmp(word, words[i]))
      return PETSC_TRUE;
  return PETSC_FALSE;
}

PetscErrorCode SbToolCommandLine(int *argc, char *argv[], SbToolLine *line)
{
  int kept = 1;

  PetscFunctionBeginUser;
  memset(line, 0, sizeof(*line));
  for (int i = 1; i < *argc; i++) {
    PetscBool is_option;

    PetscCall(PetscOptionsValidKey(argv[i], &is_option));
    if (!strcasecmp(argv[i], "-help") || !strcasecmp(argv[i], "--help") || !strcmp(argv[i], "-h")) {
      line->help = PETSC_TRUE;
    } else if (!strcasecmp(argv[i], "-version") || !strcasecmp(argv[i], "--version")) {
      line->version = PETSC_TRUE;
    } else if (is_option) {
      const SbOption *row = find_row(argv[i] + 1);

      if (row)
        line->given[row - rows] = PETSC_TRUE;
      else if (!line->unknown && !SbHasPrefix(argv[i] + 1, petsc))
        line->unknown = argv[i] + 1;

      // the word after an option is its value, for a switch only if it is a truth value
      argv[kept++] = argv[i];
      if (!argv[i + 1])
        break;
      PetscCall(PetscOptionsValidKey(argv[i + 1], &is_option));
      if (!is_option && (!row || row->kind != SB_OPTION_BOOL || is_truth(argv[i + 1])))
        argv[kept++] = argv[++i];
    } else {
      if (line->nword < 4)
        line->word[line->nword] = argv[i];
      line->nword++;
    }
  }
  argv[kept] = NULL;
  *argc = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbToolSetFromOptions(const SbToolLine *line, SbTool *tool)
{
  const SbToolCommand *command;
  const char *list[SB_TOOL_OPTIONS];
  char all[256] = "";
  PetscInt n = 0;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCall(SbOptionsRegister("", "", SB_TOOL_OPTIONS, rows));
  PetscCall(PetscMemzero(tool, sizeof(*tool)));

  // one process, a command, and the number of files that it takes
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCheck(size == 1, PETSC_COMM_WORLD, PETSC_ERR_USER,
             "runs on one process, not on %d; leave out mpirun", (int)size);
  PetscCheck(
    line->nword, PETSC_COMM_SELF, PETSC_ERR_USER,
    "no command is given; supple-mesh -help lists them, supple-mesh info FILE describes a mesh");
  for (command = SbToolCommands; command->name && strcmp(command->name, line->word[0]); command++)
    list[n++] = command->name;
  if (!command->name)
    SbSuggestName(line->word[0], n, list, sizeof(all), all);
  PetscCheck(command->name, PETSC_COMM_SELF, PETSC_ERR_USER,
             "'%s' is no command; the commands are %s", line->word[0], all);
  PetscCheck(line->nword - 1 == command->nfile, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s takes %d file%s, not %d: supple-mesh %s %s", command->name, command->nfile,
             command->nfile > 1 ? "s" : "", line->nword - 1, command->name, command->files);

  // options: of this command, or of PETSc
  for (int i = 0; i < SB_TOOL_OPTIONS; i++)
    list[i] = rows[i].key;
  if (line->unknown)
    SbSuggestNames(line->unknown, SB_TOOL_OPTIONS, list, sizeof(all), all);
  PetscCheck(!line->unknown, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-%s is not an option of supple-mesh%s%s%s", line->unknown,
             all[0] ? "; did you mean -" : "; supple-mesh -help lists them", all,
             all[0] ? "?" : "");
  for (int i = 0; i < SB_TOOL_OPTIONS; i++)
    PetscCheck(!line->given[i] || !readers[i][0] || strstr(readers[i], command->name),
               PETSC_COMM_SELF, PETSC_ERR_USER, "-%s does nothing in supple-mesh %s; it is for %s",
               rows[i].key, command->name, readers[i]);
  tool->command = command;
  tool->in = line->word[1];
  tool->out = command->nfile > 1 ? line->word[2] : NULL;
  PetscCall(PetscStrncpy(tool->body.mesh, tool->in, sizeof(tool->body.mesh)));

  /* options of tetrahedralization */
  SbTetDefaults(&tool->body.tet);
  PetscCall(SbOptionReal(&SbRunScope, "size", &tool->body.tet.size));
  PetscCall(SbTetNearRead(&SbRunScope, "near", &tool->body.tet));
  PetscCall(SbOptionChoice(&SbRunScope, "surface", &tool->body.tet.surface));
  PetscCall(SbOptionReal(&SbRunScope, "angle", &tool->body.tet.angle));
  PetscCall(SbOptionChoice(&SbRunScope, "tetrahedralizer", &tool->body.tet.backend));
  PetscCall(SbOptionReal(&SbRunScope, "seconds", &tool->body.tet.seconds));
  PetscCall(SbOptionReal(&SbRunScope, "untangle", &tool->body.tet.untangle));
  PetscCall(SbOptionReal(&SbRunScope, "merge_tolerance", &tool->body.tet.merge_tolerance));
  PetscCall(SbOptionInt(&SbRunScope, "levels", &tool->levels));
  PetscCall(SbOptionChoice(&SbRunScope, "format", &tool->format));
  PetscCall(SbOptionString(&SbRunScope, "group", sizeof(tool->group), tool->group));
  PetscCall(SbOptionInt(&SbRunScope, "step", &tool->body.mesh_step));
  PetscCall(SbOptionReal(&SbRunScope, "scale", &tool->body.scale));
  PetscCall(SbOptionReals(&SbRunScope, "rotate", tool->body.rotate));
  PetscCall(SbOptionReals(&SbRunScope, "translate", tool->body.translate));
  PetscCall(SbOptionString(&SbRunScope, "view", sizeof(tool->view), tool->view));
  PetscCall(SbOptionBool(&SbRunScope, "quiet", &tool->quiet));
  PetscFunctionReturn(PETSC_SUCCESS);
}
