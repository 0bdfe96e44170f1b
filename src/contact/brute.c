/*
  brute.c - contact detection that examines every pair of boxes: the reference for the other kinds, quick for a handful of facets.
*/
#include "detect.h"

static PetscErrorCode search_brute(SbDetector d, const SbDetectScene *s)
{
  PetscInt64 n = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < s->npoint; i++) {
    d->start[i] = (PetscInt)n;
    PetscCall(SbCandidatesReserve(d, n + s->nfacet));
    for (PetscInt f = 0; f < s->nfacet; f++) {
      if (SbBoxesOverlap(d->point_box + 6 * i, d->facet_box + 6 * f) && SbDetectPairWanted(s, i, f))
        d->candidate[n++] = f;
    }
  }
  d->start[s->npoint] = (PetscInt)n;
  d->stats.memory = 0;
  PetscCall(PetscSNPrintf(d->stats.text, sizeof(d->stats.text),
                          "brute force, %" PetscInt_FMT " x %" PetscInt_FMT " boxes", s->npoint, s->nfacet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDetectorCreate_Brute(SbDetector d)
{
  PetscFunctionBeginUser;
  d->ops = (SbDetectorOps){.name = "brute", .search = search_brute};
  PetscFunctionReturn(PETSC_SUCCESS);
}
