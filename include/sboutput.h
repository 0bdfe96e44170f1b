/*
  sboutput.h - layer 9: one folder per run. fields.h5 and its indices, history.csv, run.json,
  checkpoints.

  Everything here attaches to a run as a monitor; output that the scenario does not select is not
  attached. Order: SbRunCreate(), SbOutputSetFromOptions(), SbOptionsCheck(), SbModelSetUp(),
  SbRunSetUp(), SbOutputAttach(), SbReportHeader(), SbRunSolve(), SbReportSummary(), SbRunDestroy().

  Everything in the files is in original order: bodies as the scenario names them, vertices and
  cells as in their files. It does not depend on the number of ranks.

  Vertex fields of bodies with nodes at faces (cr, dg) hold at each vertex the mean of the cells
  around it, weighted with their volumes; forces at faces are distributed equally to their vertices.
  With -output_discontinuous each cell has points of its own and the values that it has there.
  Bodies of p2 have their nodes at edges, too. Probes show vertex fields. Checkpoints hold the
  unknowns themselves.

  fields.h5
    /mesh/x        [npoint][3] double, rest position, m; points are vertices, then nodes of p2 at
    edges; or
                   with -output_discontinuous the corners, of p2 the ten nodes, of one tet after the
                   other
    /mesh/cells    [ncell][4] int32, point numbers, positively oriented; a tet of p2 is eight, but
    for
                   -output_quadratic
    /mesh/cells10  [ntet][10] int32, where a body is of p2: of each tet of the scene corners, nodes
    at edges
                   01 12 02 03 13 23, -1 where its body is of another element
    /mesh/parent   [ncell] int32, its row there, or that of its tet; not with -output_quadratic
    /mesh/vertices [ncell][4] int32, vertex numbers, then nodes at edges; only with
    -output_discontinuous
    /mesh_000123   the mesh after a re-meshing behind step 123; its frames have the attribute
    `mesh`, 123 /mesh/body     [ncell] int32, number of the body; /mesh/rank likewise when asked for
    /mesh/set_NAME [npoint] int32, 1 at points of this set, and /mesh/tets_NAME [ncell]; with the
    field `sets`
    /step/0001/000123   a frame: group with the attributes `step` and `time` (s), one dataset per
    field. The
                   middle name counts hundreds of frames, the last one is the step.
  history.csv: names in the first line, units in the second one behind a '#', then one row per step.
*/
#pragma once
#include "sbtime.h"

extern const SbOption SbOutputRows[], SbProbeRows[];

/*
  SbOutputSetFromOptions - reads every option of the output and makes the folder of the run.
  Collective.

  Before the model is set up, so that nothing is computed for a run whose results have no place.
  Input:
    scenario - option file that names the run in reports, and its folder where -output_dir does not;
               "" without one

  Options read: -output_..., -checkpoint_..., -restart, -probes, -probe_<name>_at, -progress,
  -quiet. Errors: PETSC_ERR_USER for an unknown field; PETSC_ERR_FILE_OPEN when the folder cannot be
  made or written.
*/
PetscErrorCode SbOutputSetFromOptions(SbRun run, const char *scenario);

/*
  SbOutputAttach - attaches the monitors asked for and, with -restart, loads the checkpoint.
  Collective.

  After SbRunSetUp(). Moves the files that an earlier run left in the folder (only those named
  above) into its folder before_DATE, and says so; with -output_overwrite yes replaces them; or
  continues them after a restart; writes scenario.opts and run.json with the status "running".
*/
PetscErrorCode SbOutputAttach(SbRun run);

/*
  SbOutputLock - the folder is this run's until its output is destroyed or its process ends.
  Collective; after SbOutputSetFromOptions().
  Errors: PETSC_ERR_FILE_OPEN with process and host of the run that has it.
*/
PetscErrorCode SbOutputLock(SbRun run);

/*
  SbOutputLoadState - displacement and velocity of bodies with -body_<name>_state, from frames of
  other runs. Collective; after SbRunSetUp(), before SbOutputAttach().
  Errors: PETSC_ERR_FILE_OPEN, PETSC_ERR_FILE_UNEXPECTED for a run, step or body that is not there.
*/
PetscErrorCode SbOutputLoadState(SbRun run);

/*
  SbOutputRestoreMeshes - with -restart from a checkpoint of a run that was re-meshed: the bodies'
  meshes (SbBody.given). Collective; between SbOutputSetFromOptions() and SbModelSetUp(). Does
  nothing without -restart; a file that cannot be read is left to SbOutputAttach().
*/
PetscErrorCode SbOutputRestoreMeshes(SbRun run);

/*
  SbOutputReattach - continues the output with another run of the same scene, whose bodies were
  re-meshed, in the same files. Collective; instead of SbOutputSetFromOptions() and SbOutputAttach()
  for `to`.
*/
PetscErrorCode SbOutputReattach(SbRun from, SbRun to);

/* What happened to a body that was re-meshed. */
typedef struct {
  char body[SB_NAME_MAX];
  PetscInt step;
  PetscReal t;                   /* s */
  PetscInt tets[2], vertices[2]; /* before and after; so are the next ones */
  PetscReal quality[2];          /* of the worst tet now */
  PetscReal energy[2];           /* kinetic and strain energy of all bodies, J */
  PetscInt moved;                /* vertices that were moved to repair tets */
  PetscReal speed;               /* of the rigid motion that keeps the momenta, m/s */
  PetscReal shift;               /* of the centre of mass of all bodies, m */
} SbRemeshed;
/* Prints a line and keeps it for run.json; without output it does nothing. Collective. */
PetscErrorCode SbReportRemeshed(SbRun run, const SbRemeshed *event);

/* What people see before the run, and after it (rank 0, without -quiet), when run.json ends.
   Collective. */
PetscErrorCode SbReportHeader(SbRun run);
PetscErrorCode SbReportSummary(SbRun run);
/* The same at the end of -show: run.json gets the status "shown". */
PetscErrorCode SbReportShown(SbRun run);

/* Path of a file in the run's folder, and whether nothing is to be printed. Not collective. */
void SbOutputFile(SbRun run, const char *name, char path[PETSC_MAX_PATH_LEN], PetscBool *quiet);

/* Writes "status": "failed" and the reason into run.json. Any one rank, for the handler of a fatal
   error. */
PetscErrorCode SbReportFailure(SbRun run, const char *reason);
