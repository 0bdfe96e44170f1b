/*
  output_impl.h - shared by src/output: the state of a run's output, original order, HDF5 and file
  helpers.
*/
#pragma once
#include <hdf5.h>
#include <stdio.h>
#include "sboutput.h"

#define SB_FIELD_MAX 32

/* A named field. compute() fills this rank's owned entities (points or cells, in the mesh's local
   order). */
typedef struct SbField SbField;
struct SbField {
  const char *name; /* "von_mises" */
  const char *unit;
  PetscInt
    ncomp; /* 1 scalar, 3 vector, 6 symmetric tensor: xx xy xz yy yz zz, the Tensor6 order of XDMF */
  PetscBool cell; /* per cell, else per vertex, or corner of a cell with -output_discontinuous */
  PetscBool constant; /* integers, written once with the mesh */
  PetscBool dynamic;  /* does not exist in a static run */
  const char *help;
  PetscErrorCode (*compute)(const SbField *field, SbRun run, const SbStep *step,
                            PetscReal *values); /* NULL: `sets`, several arrays */
  /* parameters of compute(): */
  size_t from; /* where in the step or the output the quantity is */
  void (*of_stress)(const PetscReal sigma[6],
                    PetscReal value[]); /* value[ncomp] from xx yy zz xy yz xz */
};

#define SB_MESSAGE_MAX 1024
#define SB_FILE_MAX 64 /* longest name of a file inside the folder, with the terminating zero */

/* Original order of vertices, cells or nodes, cut into one contiguous slice per rank: how results
   are written, so that the files do not depend on the partition. */
typedef struct {
  PetscSF sf; /* leaves: the entities owned here; roots: this rank's slice; NULL: slices only */
  PetscInt N; /* entities of all ranks */
  PetscInt nowned; /* owned here */
  PetscInt start;  /* the slice is [start, start + n) */
  PetscInt n;
} SbOrder;

PetscErrorCode SbOrderCreate(MPI_Comm comm, PetscInt N, PetscInt nowned, const PetscInt original[],
                             SbOrder *order);
/* The same for numbers key[nowned] in [0, bound) with gaps, which are closed; N: their count.
   Collective. */
PetscErrorCode SbOrderCreateSparse(MPI_Comm comm, PetscInt bound, PetscInt nowned,
                                   const PetscInt key[], SbOrder *order);
PetscErrorCode SbOrderDestroy(SbOrder *order);

/* Which file is open; number 0: not known. Rank 0. */
typedef struct {
  dev_t device;
  ino_t number;
  PetscBool lost; /* and reported */
} SbFileIdentity;
void SbFileRemember(const char *path, SbFileIdentity *file);
/* Whether path no longer is that file; warns the first time. Rank 0. */
PetscBool SbFileLost(const char *path, SbFileIdentity *file);

/* HDF5 and files */
typedef struct {
  MPI_Comm comm;
  hid_t file;       /* negative when closed */
  PetscInt64 bytes; /* size of the data being written, for messages */
  PetscBool failed; /* a write failed, and all ranks know */
  char reason[160]; /* why a write failed on this rank; the next flush reports it to the others */
  char path[PETSC_MAX_PATH_LEN];
  SbFileIdentity on_disk; /* rank 0, of files that are written */
} SbH5;

/* The type in memory of numbers of this type in a file: that of PetscInt for H5T_STD_I64LE. */
hid_t SbH5TypeInMemory(hid_t type);
/* Files are opened collectively for MPI-IO; SbH5Create() replaces what has the
   name; SbH5Open() refuses files with links to others (SbH5IsOwn). */
PetscErrorCode SbH5Create(MPI_Comm comm, const char *path, SbH5 *h);
PetscErrorCode SbH5Open(MPI_Comm comm, const char *path, PetscBool writable, SbH5 *h,
                        PetscBool *ok); /* no error: see ok */
PetscErrorCode SbH5Close(SbH5 *h);
/* Flushes to disk on all ranks. A write that failed since the last flush ends the run here.
   Collective. */
PetscErrorCode SbH5Flush(SbH5 *h);
/* A dataset [order->N][ncomp] of this type below `where` out of slices, with its unit.
   Collective. */
PetscErrorCode SbH5WriteSlice(SbH5 *h, hid_t where, const char *name, const char *unit,
                              const SbOrder *order, PetscInt ncomp, hid_t type, const void *slice);
/* The slice of such a dataset as doubles; not ok: missing, of another shape or unreadable.
   Collective. */
PetscErrorCode SbH5ReadSlice(SbH5 *h, const char *name, const SbOrder *order, PetscInt ncomp,
                             PetscReal slice[], PetscBool *ok);
/* A group that may be missing: negative then. Not collective. */
hid_t SbH5OpenGroup(hid_t where, const char *name);
/* Rows of a dataset [n] or [n][m], and bytes (or NULL) of its numbers; 0: there is none. Not
   collective. */
PetscInt64 SbH5Rows(hid_t where, const char *name, PetscInt *bytes);
/* A whole dataset [n][ncomp], or [n], in memory; false: it is missing, of another shape or
   unreadable. */
PetscBool SbH5Read(hid_t where, const char *name, hid_t type, PetscInt n, PetscInt ncomp,
                   void *values);
PetscErrorCode SbH5PutReal(SbH5 *h, hid_t where, const char *name, PetscReal value);
PetscErrorCode SbH5PutInt(SbH5 *h, hid_t where, const char *name, int64_t value);
PetscErrorCode SbH5PutText(SbH5 *h, hid_t where, const char *name, const char *text);
/* Whether an attribute has one value: into a variable no more may be read. */
PetscBool SbH5IsScalar(hid_t attribute);
/* ok turns false when the attribute is missing or of another kind. Not collective. */
void SbH5GetReal(hid_t where, const char *name, PetscReal *value, PetscBool *ok);
void SbH5GetInt(hid_t where, const char *name, int64_t *value, PetscBool *ok);
/* A text of any length as a dataset, the same on all ranks. Collective. Free what was read with
   PetscFree. */
PetscErrorCode SbH5WriteText(SbH5 *h, hid_t where, const char *name, const char *text);
PetscErrorCode SbH5ReadText(SbH5 *h, const char *name, char **text, PetscBool *ok);
/* A group without a name, whose links, with names of up to `letters` letters, lie in one block; see
   h5.c. */
PetscErrorCode SbH5GroupCreate(SbH5 *h, unsigned links, unsigned letters, hid_t *group);
/* Gives it a name; the file shows it from the next flush on. Collective. */
PetscErrorCode SbH5GroupLink(SbH5 *h, hid_t group, hid_t parent, const char *name);
#define SB_H5_NODE_LINKS 100 /* with 6 letters: a block of 4080 bytes */

/* Reserves `bytes` of disk space beyond the end of the file; later messages name them.
   Collective. */
PetscErrorCode SbH5Reserve(SbH5 *h, PetscInt64 bytes);
/* Ends the run on all ranks when a rank has a message; the lowest rank's is reported.
   Collective. */
#define SB_NO_ROOM "make room and go on with -restart auto, or give another -output_dir"
PetscErrorCode SbAgree(MPI_Comm comm, PetscErrorCode code, const char *message);
/* Writes path.tmp and renames it to path. Rank 0 only; message: the error, if any. */
void SbFileReplace(const char *path, const void *text, size_t size, char message[SB_MESSAGE_MAX]);
/* Renames NAME.END, from before a restart at this step, to NAME_before_STEP.END, with a number if
   that is taken. Rank 0 only; other: the new path; message: the error, if any. */
#define SB_OTHER_MAX (PETSC_MAX_PATH_LEN + 48)
void SbFileKeep(const char *path, PetscInt step, char other[SB_OTHER_MAX],
                char message[SB_MESSAGE_MAX]);

/* state */

/* A weighted sum over nodes or tets of this rank. */
typedef struct {
  PetscInt n, size;
  struct {
    PetscInt number;
    PetscReal weight;
  } * item; /* [n] */
} SbSum;
typedef enum {
  SB_PROBE_POINT,
  SB_PROBE_FACETS,
  SB_PROBE_TETS
} SbProbeKind;
typedef struct {
  char name[SB_NAME_MAX];
  PetscReal at[3]; /* requested position, m */
  PetscReal
    x[3]; /* what it follows, at rest, m: the nearest vertex, or node of P2, of the first mesh */
  PetscBool found;   /* x and body are known */
  PetscInt body;     /* body of x */
  PetscInt original; /* original number of that vertex or node, -1: removed by re-meshing */
  PetscInt local; /* owned local vertex at x, or -1: on the other ranks, and where there is none */
  SbProbeKind kind;
  char set[SB_NAME_MAX]; /* set of a mean over facets or tets */
  PetscInt nfield;
  const SbField *field[SB_FIELD_MAX];
  SbSum nodes, cells; /* this rank's nodes, if there is no vertex at x, and tets */
  SbSum stresses;     /* of a point: 10 cell + a, nodes of tets for SbNodalStressAt() */
} SbProbe;

typedef struct _p_SbFrames *SbFrames;   /* frames.c */
typedef struct _p_SbHistory *SbHistory; /* history.c */
typedef struct _p_SbIndex *SbIndex;     /* index.c */

/* points.c: what values at points need beside the mesh; NULL where nothing does. */
typedef struct {
  PetscInt *start;    /* [nvert_owned + 1] into corner; NULL where nodes are vertices */
  PetscInt *corner;   /* 4 cell + a of the cells around an owned vertex, by original cell number */
  PetscReal *V;       /* [ncell] m^3 */
  PetscReal *valence; /* [nnode] cells that have the node; NULL when no field needs it */
} SbPoints;

/* contacts.c: the points of contact of a frame. */
typedef struct {
  SbContactPoints list;  /* of this rank */
  SbContactPoint *point; /* [share.n] of this rank's share, sorted */
  SbOrder share;         /* which rows are this rank's; it has no star forest */
} SbContacts;

/* progress.c: the line of progress. */
typedef struct {
  PetscBool on; /* this rank prints it */
  PetscBool terminal;
  PetscBool open; /* a line is being rewritten */
  PetscBool titled;
  PetscReal last; /* wall time of the last line, s since the time loop began */
  PetscReal t_start;
  PetscInt newton, linear, steps; /* since the last line */
  PetscReal within;               /* MPI_Wtime() of the last line within a step */
} SbProgress;

typedef struct _p_SbOutput *SbOutput;
struct _p_SbOutput {
  MPI_Comm comm;
  PetscMPIInt rank, size;
  PetscReal wall_start, cpu_start; /* s */

  /* options */
  char dir[PETSC_MAX_PATH_LEN];
  char scenario[PETSC_MAX_PATH_LEN]; /* option file that names the run; empty without one */
  char restart[PETSC_MAX_PATH_LEN];  /* empty: none */
  int
    ndamaged; /* newest checkpoints that cannot be read: -restart latest takes the one before them */
  PetscInt nfield;
  PetscLogEvent field_event[SB_FIELD_MAX]; /* SbField_<name> */
  const SbField *field[SB_FIELD_MAX];
  PetscReal every; /* s between frames; 0: every_steps counts */
  PetscInt every_steps;
  PetscBool precise;        /* double instead of float */
  PetscBool discontinuous;  /* each cell has four points of its own */
  PetscBool quadratic;      /* tets of P2 are not cut into linear ones */
  PetscBool contact_points; /* contact points in each frame */
  PetscBool history, history_bodies;
  PetscInt history_every;
  PetscReal checkpoint_every; /* s of simulated time; 0: off */
  PetscInt checkpoint_every_steps, checkpoint_keep;
  PetscBool progress, quiet;
  PetscBool overwrite; /* results of an earlier run may be replaced */
  int lock;            /* file descriptor of the folder's lock, -1: none */
  PetscInt nprobe;
  SbProbe *probe; /* [nprobe] */

  /* set by SbOutputAttach() */
  struct {
    PetscLogEvent fields, contacts, history, probes, checkpoint, progress;
  } event; /* SbOut_<name>, of those that the scenario asks for */
  SbOrder cell;
  SbOrder node; /* order of the unknowns: that of the vertices if no body has nodes at faces */
  SbOrder
    point; /* of vertex fields: vertices and then P2's nodes at edges, or each cell's own points */
  SbOrder tet;      /* of the tets that points are the corners of: slices only, see split */
  PetscBool *split; /* [cell.n] cells of the slice that are eight of these; NULL: none */
  PetscInt *
    edge_number; /* [nnode] point at a node at an edge, as if cells shared theirs; NULL without P2 */
  PetscInt
    *place; /* [point.nowned] 10 cell + a with -output_discontinuous, else node of P2; or NULL */
  PetscBool attached;   /* run.json exists */
  PetscInt *body_nodes; /* [nbody] nodes of each body, supports of faces among them */
  uint64_t mesh_hash;
  char *identity; /* options that determine the mechanics, one per line */
  /* cell quantities of the instant being written, computed once for all fields that need them */
  PetscBool state_valid;
  PetscReal *sigma, *J, *psi; /* [ncell_owned][6] Pa, [ncell_owned], the same in J/m^3; or NULL */
  PetscReal *pressure;        /* [ncell_owned] Pa; NULL likewise */
  SbNodalStress nodal;        /* stress at nodes; NULL when nothing shows it */
  PetscBool nodal_valid;      /* likewise of it */

  SbPoints points;

  SbFrames frames;
  SbContacts contacts;
  SbIndex
    contact_index; /* of them, on rank 0; NULL when there are none to write and none to keep */
  SbHistory hist;
  PetscReal *resumed; /* [columns of effects] the row of the step of the checkpoint; or NULL */
  SbProgress line;
  char started[32]; /* date and time */
  PetscInt nremeshed, remeshed_size;
  SbRemeshed *remeshed; /* [nremeshed] for run.json */
};

/* folder.c: creates the folder with its parents and tests writing; message: the error, if any. Rank
   0. */
void SbFolderMake(SbOutput out, char message[SB_MESSAGE_MAX]);
/* Releases the lock of SbOutputLock(), if there is one. */
void SbFolderUnlock(SbOutput out);
/* Moves or removes an earlier run's results; after a restart only checkpoints of later steps. Rank
   0. */
PetscErrorCode SbFolderClear(SbOutput out, PetscInt step0);
/* Path of a file of the run's folder. */
void SbOutputPath(SbOutput out, const char *name, char path[PETSC_MAX_PATH_LEN]);
/* Whether a multiple of `every` lies in (t - dt, t]. */
PetscBool SbOutputDue(PetscReal every, PetscReal t, PetscReal dt);
/* The step after which a body was re-meshed last, 0: none was. Not collective. */
PetscInt SbOutputMeshStep(SbRun run);
/* The group in fields.h5 of the mesh since this step, "mesh" or "mesh_000123"; returns name. */
#define SB_MESH_NAME 32
const char *SbOutputMeshName(PetscInt step, char name[SB_MESH_NAME]);
/* Original orders and the mesh's hash; made once. Collective. */
PetscErrorCode SbOutputOrder(SbRun run, SbOutput out);
/* Frees what belongs to the mesh: orders, points, cell quantities, counts. */
PetscErrorCode SbOutputForgetMesh(SbOutput out);
PetscErrorCode SbOutputCountNodes(SbSpace space, SbOutput out); /* collective */

/* Every field that there is. Not collective. */
const SbField *SbFieldGetAll(PetscInt *n);
/* option: for messages */
PetscErrorCode SbFieldFind(const char *option, const char *name, const SbField **field);
PetscErrorCode
SbFieldPrepare(SbRun run, SbOutput out,
               const SbField *field); /* storage for the quantities of cells that it needs */
/* value[ncomp] += the sum of a field made of the cells' state. Collective where state_valid is
   false. */
PetscErrorCode SbFieldAddCells(const SbField *field, SbRun run, const SbStep *step,
                               const SbSum *cells, PetscReal value[]);
/* The same at the nodes 10 cell + a of tets, of the recovered stress. Collective where nodal_valid
   is false. */
PetscErrorCode SbFieldAddNodal(const SbField *field, SbRun run, const SbStep *step,
                               const SbSum *nodes, PetscReal value[]);
/* Whether a probe at a point shows it of the recovered stress. */
PetscBool SbFieldIsRecovered(const SbField *field);
/* Whether probes can show it: a vector of the step, or a quantity of the cells' state. */
PetscBool SbFieldIsProbed(const SbField *field);

/* points.c: vectors at points of vertex fields. This one first; forces: for SbPointsForces().
   Collective. */
PetscErrorCode SbPointsPrepare(SbRun run, SbOutput out, PetscBool forces);
/* sigma[point.nowned][6], Pa, of out->nodal; where materials meet the mean of the tets, by volume.
   Not collective. */
PetscErrorCode SbPointsStress(SbRun run, SbOutput out, PetscReal sigma[]);
/* Where an owned point is: at a vertex, or at an edge of P2 (vertex -1), where there is a node; of
   a cell (4 cell + a of the vertex), if it is that cell's alone. */
typedef struct {
  PetscInt vertex, node, corner;
} SbPlace;
SbPlace SbPointsPlace(SbRun run, SbOutput out, PetscInt point);
/* Position at rest, m. */
const PetscReal *SbPointsRest(SbRun run, SbOutput out, PetscInt point);
/* values[out->point.nowned][3] of a vector of the space: nodal values of P1 and P2, means of the
   cells around, or each cell's own. Collective. */
PetscErrorCode SbPointsValues(SbRun run, SbOutput out, Vec x, PetscReal values[]);
/* The same for forces at nodes, or prescribed unknowns only; keeps resultant and moment.
   Collective. */
PetscErrorCode SbPointsForces(SbRun run, SbOutput out, PetscBool prescribed, Vec R,
                              PetscReal values[]);
/* The value at an owned vertex of a local array x[nnode][3] with ghosts, as vertex fields have
   it. */
void SbPointsVertex(SbRun run, SbOutput out, PetscInt vertex, const PetscReal x[],
                    PetscReal value[3]);

/* Before the folder is touched: refuses to go on with frames that have other points. Collective. */
PetscErrorCode SbFramesCheck(SbRun run, SbOutput out);
/* Begins the output, or continues it with the run of a new mesh; so do all ..Attach below.
   Collective. */
PetscErrorCode SbFramesAttach(SbRun run, SbOutput out);
PetscErrorCode SbFramesClose(SbOutput out);
PetscErrorCode SbFramesDestroy(SbOutput out);
/* contacts.c: points of contact after a step, on the ranks that write them; bytes in the file.
   Collective. */
PetscErrorCode SbContactsFind(SbRun run, SbOutput out, const SbStep *step, PetscInt64 *bytes);
/* Writes these points as a group of the frame. Collective. */
PetscErrorCode SbContactsWrite(SbOutput out, SbH5 *h, hid_t frame);
/* Adds a frame of the file to the index, if there is one; path: of its group. All ranks. */
PetscErrorCode SbContactsList(SbOutput out, hid_t frame, PetscReal time, const char *path);
PetscErrorCode SbHistoryAttach(SbRun run, SbOutput out);
PetscErrorCode SbHistoryDestroy(SbOutput out);
/* Columns of effects in a checkpoint: forces of contact are those of the step before, which the
   state does not tell. Of this step's row, if there is one. Collective. */
PetscErrorCode SbHistoryWrite(SbRun run, SbOutput out, PetscInt step, SbH5 *h);
PetscErrorCode SbHistoryRead(SbRun run, SbOutput out, SbH5 *h);
PetscErrorCode SbProbesSetFromOptions(SbOutput out, PetscBool dynamic);
PetscErrorCode SbProbesFind(SbRun run, SbOutput out);
/* Writes the reference positions of probes into a checkpoint of a re-meshed run. Collective. */
PetscErrorCode SbProbesWrite(SbRun run, SbOutput out, SbH5 *h);
PetscErrorCode SbProbesRead(SbRun run, SbOutput out, SbH5 *h);
/* values[number of columns] += this rank's part of the columns of all probes. Collective. */
PetscErrorCode SbProbesAdd(SbRun run, SbOutput out, const SbStep *step, const SbStage *stage,
                           PetscReal values[]);
/* Hash of bytes, from a start value. */
uint64_t SbHashBytes(uint64_t start, size_t n, const char bytes[]);
/* Hash of a number at a position of an array. */
uint64_t SbMixReal(uint64_t position, PetscReal value);

/* In the identity of a run: what its files contain, behind its options. */
#define SB_CONTENT "content of "

/* checkpoint_mesh.c: writes meshes of re-meshed bodies; sum is raised by their checksum.
   Collective. */
PetscErrorCode SbCheckpointWriteMeshes(SbRun run, SbH5 *h, uint64_t *sum);
/* Raises sum by their checksums in an open file; ok turns false when one is missing. Not
   collective. */
void SbCheckpointSumMeshes(SbRun run, SbH5 *h, uint64_t *sum, PetscBool *ok);
/* Path of the checkpoint that -restart names; of `latest` the newest undamaged one, "": none.
   Collective. */
PetscErrorCode SbCheckpointFind(SbOutput out, char path[PETSC_MAX_PATH_LEN]);
#define SB_SKIPPED "%s is truncated or damaged: trying the checkpoint before it"
PetscErrorCode SbCheckpointAttach(SbRun run, SbOutput out);
/* Removes those of steps after `step`, and all but the newest `keep` of the others. Rank 0. */
void SbCheckpointPrune(SbOutput out, PetscInt step, PetscInt keep);
PetscErrorCode SbProgressAttach(SbRun run, SbOutput out);
void SbProgressEnd(SbOutput out); /* ends a line that is being rewritten */
PetscErrorCode SbRunJson(SbRun run, SbOutput out, const char *status,
                         const char *reason); /* collective */

/* index.c: the index files of fields.h5 for viewers, NAME.xmf and NAME.vtkhdf, on rank 0. */
/* Rows of one dataset of fields.h5, in one frame or one mesh. */
typedef struct {
  PetscInt block; /* number of the frame; of the part for what does not change with time */
  int bytes;      /* per number */
  char path[96];  /* of the dataset */
} SbPiece;
/* Datasets [n] or [n][ncomp] of one name. */
typedef struct {
  const char *name;
  int ncomp, bytes;                /* most bytes of its pieces */
  PetscBool whole, cell, constant; /* whole numbers; per cell; one piece per part, else per frame */
  PetscInt npiece, size;
  SbPiece *piece; /* [npiece], blocks ascending */
} SbArray;
/* A mesh, or the contact points of one frame. */
typedef struct {
  PetscInt npoint, ncell;
  char group[64];
} SbPart;
struct _p_SbIndex {
  char xmf[PETSC_MAX_PATH_LEN], vtkhdf[PETSC_MAX_PATH_LEN]; /* the two files */
  PetscBool points;                                         /* contact points, else tets */
  PetscInt corners;     /* of a tet: 4, or 10 if quadratic; of a point: 1 */
  PetscReal nowhere[3]; /* where a frame without contact points shows one without force, m */
  PetscInt npart, part_size, nframe, frame_size, narray, array_size;
  SbPart *part;
  struct {
    PetscReal time; /* s */
    PetscInt part;
  } * frame;
  SbArray *array;
  FILE *file; /* of XDMF: head and grids so far, in memory: text[size] once it is flushed */
  char *text;
  size_t size;
  PetscInt nwritten; /* vtkhdf.c: frames that the file on disk has */
  double next;       /* when it is made again, in s of MPI_Wtime() */
};
/* Removes older files. nowhere[3]: of contact points, with the dummy point of frames without any,
   m; NULL: of tets. */
PetscErrorCode SbIndexCreate(SbOutput out, const char *name, const PetscReal *nowhere,
                             SbIndex *index);
PetscErrorCode SbIndexDestroy(SbIndex *index);
/* The mesh of SbIndexAdd() from now on: that of a step, in fields.h5, which is open. */
PetscErrorCode SbIndexSetMesh(SbIndex index, hid_t file, PetscInt step);
/* Adds a frame: its group in fields.h5, and its arrays. Contact points have positions `x` and a
   number. */
PetscErrorCode SbIndexAdd(SbIndex index, PetscReal time, const char *group, PetscInt npoint,
                          PetscInt n, const SbArray array[]);
/* Replaces the files, unless there is a message or no index; `message` becomes the error, if any.
   The last ones of a run are written in any case. */
void SbIndexWrite(SbIndex index, PetscBool last, char message[SB_MESSAGE_MAX]);
/* vtkhdf.c: replaces that file when enough frames have come since, or these are the last ones. */
void SbVtkhdfWrite(SbIndex index, PetscBool last, char message[SB_MESSAGE_MAX]);

/* run_json.c: times of the phases, from the log events. */
typedef struct {
  PetscReal seconds[SB_PHASE_COUNT]; /* mean of the ranks */
  PetscReal cpu; /* CPU time of the slowest rank, s; less than `total` where others use the cores */
  PetscReal memory_max, memory_sum; /* peak resident memory of a rank, of all, bytes */
  PetscReal total;                  /* s */
} SbPhases;
extern const char *const SbPhaseNames[SB_PHASE_COUNT];
/* CPU time of this process since it began, s. */
#define SB_CPU_SECONDS ((PetscReal)clock() / CLOCKS_PER_SEC)
PetscErrorCode SbPhasesGet(SbOutput out, SbPhases *phases); /* collective */
/* The files of the run that exist, with their sizes; PetscFree(). Rank 0. */
typedef struct {
  char name[SB_FILE_MAX];
  PetscInt64 bytes;
} SbOutputFileSize;
PetscErrorCode SbOutputFiles(SbOutput out, PetscInt *n, SbOutputFileSize **files);

/*
  SbCheckpointLoad - state of a run from the checkpoint that -restart names, or for `latest` the
  newest readable one of the folder (a warning names others), on any number of ranks. Collective.

  Fills run->state.U, V, A, step0, t0, dt, the running totals in run->state.energies and
  run->state.energy_start. Errors: PETSC_ERR_FILE_OPEN / _READ for a missing, truncated or foreign
  file; PETSC_ERR_USER_INPUT when its mesh, bodies or effects are not those of this run (the message
  names the first option that differs).
*/
PetscErrorCode SbCheckpointLoad(SbRun run);
