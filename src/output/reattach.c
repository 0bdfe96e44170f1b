/*
  The output of a run whose bodies were re-meshed: the folder, its files and their counts stay, and what belongs to the mesh is rebuilt.

  The row and the frame of the step are there already, on the old mesh; the next ones are on the new one.
*/
#include "output_impl.h"

PetscErrorCode SbOutputForgetMesh(SbOutput out)
{
  PetscFunctionBeginUser;
  if (out->ordered) {
    PetscCall(SbOrderDestroy(&out->vertex));
    PetscCall(SbOrderDestroy(&out->cell));
    PetscCall(SbOrderDestroy(&out->node));
    PetscCall(SbOrderDestroy(&out->point));
  }
  out->ordered = PETSC_FALSE;
  PetscCall(PetscFree(out->sigma));
  PetscCall(PetscFree(out->J));
  PetscCall(PetscFree(out->psi));
  PetscCall(PetscFree(out->pressure));
  PetscCall(PetscFree(out->body_nodes));
  PetscCall(SbPointsDestroy(out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt SbOutputMeshStep(SbRun run)
{
  PetscInt step = 0;

  for (PetscInt b = 0; b < run->model->nbody; b++) {
    const SbMemoryMesh *in_memory = run->model->body[b].in_memory;

    if (in_memory) step = PetscMax(step, in_memory->step);
  }
  return step;
}

PetscErrorCode SbOutputReattach(SbRun from, SbRun to)
{
  SbOutput out = (SbOutput)from->output;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_OUTPUT], 0, 0, 0, 0));
  to->output = out;
  to->output_destroy = from->output_destroy;
  from->output = NULL;
  from->output_destroy = NULL;
  PetscCall(SbOutputForgetMesh(out));
  PetscCall(SbOutputCountNodes(to->model->space, out));
  PetscCall(SbOutputOrder(to, out));
  PetscCall(SbFramesReattach(to, out));
  PetscCall(SbHistoryReattach(to, out));
  PetscCall(SbCheckpointAttach(to, out));
  PetscCall(SbProgressReattach(to, out));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_OUTPUT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbReportRemeshed(SbRun run, const SbRemeshed *told)
{
  SbOutput out = (SbOutput)run->output;
  const PetscReal change = told->energy[1] - told->energy[0];

  PetscFunctionBeginUser;
  if (!out) PetscFunctionReturn(PETSC_SUCCESS);
  if (out->nremeshed == out->remeshed_size) {
    out->remeshed_size = PetscMax(8, 2 * out->remeshed_size);
    PetscCall(PetscRealloc((size_t)out->remeshed_size * sizeof(*told), &out->remeshed));
  }
  out->remeshed[out->nremeshed++] = *told;
  if (out->quiet) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbProgressEnd(out));
  PetscCall(
    PetscPrintf(out->comm,
                "body '%s' is re-meshed after step %" PetscInt_FMT ", t = %g%s: worst quality %.3g -> %.3g, "
                "%" PetscInt_FMT " -> %" PetscInt_FMT " tets, energy %+.3g J (%+.2g %%)\n",
                told->body, told->step, (double)told->t, run->model->dynamic ? " s" : "",
                (double)told->quality[0], (double)told->quality[1], told->tets[0], told->tets[1],
                (double)change, (double)(told->energy[0] > 0. ? 100. * change / told->energy[0] : 0.)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
