/* SPDX-License-Identifier: MIT */
/* Proofs: those of a start before, and by the self-test. */
#include "renderer/frame/proofs.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct proofs {
    struct proofs_desc desc;
    char *path;
    struct proof proof;
    uint32_t wrong;       /* structures that failed */
    struct error problem; /* the last of them */
};

/* What other processes on this device have proven since is kept, too. */
static void join_stored(struct proofs *proofs)
{
    struct proof stored, *own = &proofs->proof;
    if (!proof_file_load(proofs->path, proofs->desc.key, (int64_t)time(NULL), &stored) ||
        stored.wide_floats.form != own->wide_floats.form)
        return;
    own->structures |= stored.structures;
    own->since_s = stored.since_s < own->since_s ? stored.since_s : own->since_s;
}

/* A file that cannot be written costs the next start its time. */
static void keep(struct proofs *proofs)
{
    struct error problem = {0};
    if (proofs->path)
        join_stored(proofs);
    if (proofs->path && !proof_file_save(proofs->path, proofs->desc.key, &proofs->proof, &problem))
        fprintf(stderr, "<4>self-test: %s\n", problem.message);
}

static bool test(struct proofs *proofs, uint32_t structures, bool *is_wrong, struct error *err)
{
    *is_wrong = false;
    if (!structures)
        return true;
    if (!proofs->desc.test(proofs->desc.context, structures, is_wrong, err))
        return false;
    if (!proofs->proof.structures)
        proofs->proof.since_s = (int64_t)time(NULL);
    proofs->proof.structures |= structures;
    keep(proofs);
    return true;
}

struct proofs *proofs_create(const struct proofs_desc *desc, struct error *err)
{
    struct proofs *proofs = calloc(1, sizeof *proofs);
    bool is_wrong, ok = proofs && (!desc->path || (proofs->path = strdup(desc->path)));
    if (!ok) {
        error_set(err, ERROR_NO_MEMORY, "self-test");
        goto fail;
    }
    proofs->desc = *desc;
    proofs->desc.path = NULL;
    proofs->proof = desc->proof;
    if (test(proofs, desc->at_start & ~proofs->proof.structures, &is_wrong, err))
        return proofs;
fail:
    proofs_destroy(proofs);
    return NULL;
}

void proofs_destroy(struct proofs *proofs)
{
    if (!proofs)
        return;
    free(proofs->path);
    free(proofs);
}

/* The first of the structures that fails is reported, and those that are right are kept. */
bool proofs_ensure(struct proofs *proofs, uint32_t structures, struct error *err)
{
    if (proofs->desc.policy == RENDERER_SELFTEST_START)
        return true;
    uint32_t untested = structures & ~proofs->proof.structures & ~proofs->wrong;
    for (uint32_t bit = 1; untested; untested &= ~bit, bit <<= 1) {
        struct error problem = {0};
        bool is_wrong;
        if (!(untested & bit) || test(proofs, bit, &is_wrong, &problem))
            continue;
        if (!is_wrong)
            return error_pass(err, &problem);
        proofs->wrong |= bit;
        proofs->problem = problem;
        fprintf(stderr, "<3>%s\n", problem.message);
    }
    if (structures & proofs->wrong)
        return error_set(err, ERROR_UNSUPPORTED,
                         "this device draws it wrong; ask for other shadows, light lists or "
                         "samples, or use another device: %s",
                         proofs->problem.message);
    return true;
}
