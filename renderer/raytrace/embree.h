/* SPDX-License-Identifier: MIT */
/* The only file that distinguishes Embree 3 from Embree 4, whose queries take the same arguments in
 * different forms. The build sets VITRAIL_EMBREE_MAJOR. Thread: any, with a context each. */
#ifndef VITRAIL_RENDERER_RAYTRACE_EMBREE_H
#define VITRAIL_RENDERER_RAYTRACE_EMBREE_H

#include <stdbool.h>
#include <stddef.h>

#if VITRAIL_EMBREE_MAJOR == 3
#include <embree3/rtcore.h>
#elif VITRAIL_EMBREE_MAJOR == 4
#include <embree4/rtcore.h>
#else
#error "Embree 3 and 4 are known"
#endif

/* What a query carries to its filters. Embree hands them `base`, so a caller that needs more begins
 * a struct of its own with this one. Zeroed by embree_context_init. */
struct embree_context {
#if VITRAIL_EMBREE_MAJOR == 3
    struct RTCIntersectContext base;
#else
    struct RTCRayQueryContext base;
#endif
    /* Sees the hits of all geometries, after the geometry's own; optional. */
    RTCFilterFunctionN filter;
    bool is_coherent; /* rays of a packet go nearly the same way */
};

static inline void embree_context_init(struct embree_context *context)
{
#if VITRAIL_EMBREE_MAJOR == 3
    rtcInitIntersectContext(&context->base);
#else
    rtcInitRayQueryContext(&context->base);
#endif
    context->filter = NULL;
    context->is_coherent = false;
}

/* The context whose `base` a filter was handed. */
static inline struct embree_context *
embree_context_of(const struct RTCFilterFunctionNArguments *args)
{
    return (struct embree_context *)args->context;
}

#if VITRAIL_EMBREE_MAJOR == 3

enum { EMBREE_SCENE_FILTERS = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION };

/* Embree 3 has filter and flags in the context that it is given. */
static inline struct RTCIntersectContext *embree_base(struct embree_context *context)
{
    context->base.filter = context->filter;
    context->base.flags = context->is_coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                               : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    return &context->base;
}

static inline void embree_intersect1(RTCScene scene, struct embree_context *context,
                                     struct RTCRayHit *query)
{
    rtcIntersect1(scene, embree_base(context), query);
}

static inline void embree_intersect8(const int *valid, RTCScene scene,
                                     struct embree_context *context, struct RTCRayHit8 *query)
{
    rtcIntersect8(valid, scene, embree_base(context), query);
}

static inline void embree_intersect16(const int *valid, RTCScene scene,
                                      struct embree_context *context, struct RTCRayHit16 *query)
{
    rtcIntersect16(valid, scene, embree_base(context), query);
}

static inline void embree_occluded1(RTCScene scene, struct embree_context *context,
                                    struct RTCRay *query)
{
    rtcOccluded1(scene, embree_base(context), query);
}

static inline void embree_occluded8(const int *valid, RTCScene scene,
                                    struct embree_context *context, struct RTCRay8 *query)
{
    rtcOccluded8(valid, scene, embree_base(context), query);
}

static inline void embree_occluded16(const int *valid, RTCScene scene,
                                     struct embree_context *context, struct RTCRay16 *query)
{
    rtcOccluded16(valid, scene, embree_base(context), query);
}

#else

enum { EMBREE_SCENE_FILTERS = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS };

/* Embree 4 asks for leave to show every geometry's hits to the filter of a query. */
static inline enum RTCRayQueryFlags embree_flags(const struct embree_context *context)
{
    unsigned flags =
        context->is_coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    if (context->filter)
        flags |= RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
    return (enum RTCRayQueryFlags)flags;
}

static inline struct RTCIntersectArguments
embree_intersect_arguments(struct embree_context *context)
{
    struct RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = embree_flags(context);
    arguments.context = &context->base;
    arguments.filter = context->filter;
    return arguments;
}

static inline struct RTCOccludedArguments embree_occluded_arguments(struct embree_context *context)
{
    struct RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.flags = embree_flags(context);
    arguments.context = &context->base;
    arguments.filter = context->filter;
    return arguments;
}

static inline void embree_intersect1(RTCScene scene, struct embree_context *context,
                                     struct RTCRayHit *query)
{
    struct RTCIntersectArguments arguments = embree_intersect_arguments(context);
    rtcIntersect1(scene, query, &arguments);
}

static inline void embree_intersect8(const int *valid, RTCScene scene,
                                     struct embree_context *context, struct RTCRayHit8 *query)
{
    struct RTCIntersectArguments arguments = embree_intersect_arguments(context);
    rtcIntersect8(valid, scene, query, &arguments);
}

static inline void embree_intersect16(const int *valid, RTCScene scene,
                                      struct embree_context *context, struct RTCRayHit16 *query)
{
    struct RTCIntersectArguments arguments = embree_intersect_arguments(context);
    rtcIntersect16(valid, scene, query, &arguments);
}

static inline void embree_occluded1(RTCScene scene, struct embree_context *context,
                                    struct RTCRay *query)
{
    struct RTCOccludedArguments arguments = embree_occluded_arguments(context);
    rtcOccluded1(scene, query, &arguments);
}

static inline void embree_occluded8(const int *valid, RTCScene scene,
                                    struct embree_context *context, struct RTCRay8 *query)
{
    struct RTCOccludedArguments arguments = embree_occluded_arguments(context);
    rtcOccluded8(valid, scene, query, &arguments);
}

static inline void embree_occluded16(const int *valid, RTCScene scene,
                                     struct embree_context *context, struct RTCRay16 *query)
{
    struct RTCOccludedArguments arguments = embree_occluded_arguments(context);
    rtcOccluded16(valid, scene, query, &arguments);
}

#endif

#endif
