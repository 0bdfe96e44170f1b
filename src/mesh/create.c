/* create.c - the mesh of a scenario, from the mesh files to the numbered local meshes of all
   ranks. */
#include <petscdmplex.h>
#include "mesh_impl.h"
#include "sbsurface.h"

const SbOption SbMeshRows[] = {
  {"petscpartitioner_type", SB_OPTION_STRING, 1, "", "", "",
   "how the mesh is cut into parts, one for each rank: metis (small interfaces; computed on rank "
   "0), bisection (recursive coordinate bisection, in parallel), or a type of PETSc: ptscotch, "
   "parmetis, simple, ...; empty: metis up to 50,000 tets, else bisection"},
  {"mesh_reading", SB_OPTION_CHOICE, 1, "", "auto", "auto|rank0|slabs",
   "how several ranks read an .h5 mesh of supple-mesh: rank0, rank 0 reads it whole; slabs, every "
   "rank reads "
   "a contiguous part of the arrays, so that memory per rank falls with the number of ranks; auto: "
   "slabs "
   "from 50,000 tets on. Other meshes are read by rank 0"},
  {"mesh_report", SB_OPTION_BOOL, 1, "", "false", "",
   "print one line per body with the size, shape and groups of its mesh"},
  {0},
};

PetscErrorCode SbMeshCreate(MPI_Comm comm, PetscInt nbody, SbBody body[], PetscInt nset,
                            SbSet set[], SbMesh *mesh)
{
  SbMesh m;
  SbMergedMesh merged;
  SbLocalMesh local;
  SbReading reading;
  PetscPartitioner partitioner;
  PetscBool full;
  PetscBool all = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCheck(nset <= SB_SET_MAX, comm, PETSC_ERR_USER_INPUT,
             "%" PetscInt_FMT " sets; a scenario may have up to %d", nset, SB_SET_MAX);
  PetscCall(SbOptionChoice(&SbRunScope, "mesh_reading", &reading));
  PetscCall(SbOptionBool(&SbRunScope, "mesh_report", &full));
  PetscCall(SbPartitionerPrepare(comm));
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_MESH_READ], 0, 0, 0, 0));
  PetscCall(SbMergedMeshCreate(comm, reading, nbody, body, nset, set, &merged));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_MESH_READ], 0, 0, 0, 0));

  // repairs and warnings are always reported, once for copies of the same mesh; the statistics on
  // request
  for (PetscInt b = 0; b < nbody; b++) {
    const SbBody *p = &body[b];
    const PetscBool again =
      (PetscBool)(b && p->copy_of[0] && !strcmp(p[-1].copy_of, p->copy_of) &&
                  !strcmp(p[-1].mesh, p->mesh) && !strcmp(p[-1].note, p->note));

    if (full)
      PetscCall(PetscPrintf(
        comm,
        "body '%s': %" PetscInt_FMT " tets, %" PetscInt_FMT " vertices, %" PetscInt_FMT
        " boundary facets, volume %.6g m^3, from (%.4g, %.4g, %.4g) to (%.4g, %.4g, "
        "%.4g) m, smallest dihedral angle %.3g degrees, largest radius ratio %.3g%s%s\n",
        p->name, p->ncell, p->nvert, p->nfacet, (double)p->volume, (double)p->bbox[0],
        (double)p->bbox[1], (double)p->bbox[2], (double)p->bbox[3], (double)p->bbox[4],
        (double)p->bbox[5], (double)p->min_dihedral, (double)p->max_radius_ratio,
        p->note[0] ? "; " : "", p->note));
    else if (p->note[0] && !p->in_memory && !again)
      PetscCall(PetscPrintf(comm, "body '%s': %s: %s\n", p->name, p->mesh, p->note));
  }
  PetscCall(PetscNew(&m));
  *m = (struct _p_SbMesh){.comm = comm, .nbody = nbody, .body = body, .nset = nset, .set = set};
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_MESH_DISTRIBUTE], 0, 0, 0, 0));
  for (PetscInt b = 0; b < nbody; b++)
    all = (PetscBool)(all || body[b].other_nodes);
  PetscCall(PetscPartitionerCreate(comm, &partitioner));
  PetscCall(SbDistribute(partitioner, all, &merged, &local));
  PetscCall(SbMeshNumber(m, &local));
  PetscCall(SbPlexCreate(m, all));
  PetscCall(DMPlexSetPartitioner(m->dm, partitioner));
  PetscCall(PetscPartitionerDestroy(&partitioner));
  PetscCall(SbMeshCurve(m, merged.ncurved, merged.curved, merged.edge_off));
  PetscCall(SbMergedMeshDestroy(&merged));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_MESH_DISTRIBUTE], 0, 0, 0, 0));
  PetscCall(DMViewFromOptions(m->dm, NULL, "-dm_view"));
  *mesh = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeshDestroy(SbMesh *mesh)
{
  SbMesh m = *mesh;

  PetscFunctionBeginUser;
  if (!m)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DMDestroy(&m->dm));
  PetscCall(PetscFree(m->face_point));
  PetscCall(PetscFree(m->edge_point));
  PetscCall(PetscFree(m->neighbour));
  PetscCall(PetscSFDestroy(&m->cell_sf));
  PetscCall(PetscSFDestroy(&m->vert_sf));
  PetscCall(PetscFree5(m->gvert, m->vert_orig, m->vert_body, m->vert_set, m->x));
  PetscCall(
    PetscFree6(m->cell, m->cell_orig, m->cell_body, m->cell_material, m->cell_set, m->face_set));
  PetscCall(PetscFree(m->edge_off));
  PetscCall(PetscFree(m->direction));
  PetscCall(PetscFree(m->temperature));
  PetscCall(PetscFree(*mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}
