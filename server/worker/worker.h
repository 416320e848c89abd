/* SPDX-License-Identifier: MIT */
/* The worker role: one GL context, the scenes on it, and an encode pool. A render that is not
 * urgent is paused for those that are, as is a step of a trade-off: they get two thirds of the
 * time, it gets one. Thread: main of its own process is the GL thread. */
#ifndef VITRAIL_SERVER_WORKER_WORKER_H
#define VITRAIL_SERVER_WORKER_WORKER_H

/* Serves until the socket closes; returns the exit status. Messages, each with an "op":
 *
 * in:
 * - configure {device, gpu_budget_bytes, texture_budget_bytes, texture_upload_bytes,
 *   texture_upload_ms, texture_compression, cache_bytes, dump_shaders, program_folder,
 *   program_budget_bytes, auto, speed_file, texture_file, observations_file, budgets_file,
 * self_test, proof_file, passed_over, keeps, sharers}: first, once. `keeps`: it is the one that
 *   learns from frames and writes the files; others read them. `sharers`: workers on its device
 * - render {id, scene, urgent, format, reuse, coarse, parts, offer, forget}, descriptors: the
 * request as JSON (memfd), the scene's blob, those of `parts` in their order. `offer`
 *   (server/mapping/choice_offer.h) is there where something of the request is left open
 * - ask {id, scene, urgent, parts, question, offer, forget}, descriptors: the same and perhaps a
 *   reference: one step of a trade-off (server/worker/measure.h), a plan (server/worker/explain.h),
 *   a pick, a warm-up (server/worker/warm_up_step.h); or, without descriptors, that the speed be
 *   known
 * - cancel {id}: a render that is not wanted any more; it ends with an error, or is done
 * - forget {forget}: ids of scenes that were deleted, here and in render and ask
 * - lessons {"lessons", "times"}, each perhaps: what frames of others teach, from their totals;
 *   "lessons" go to the one that keeps, "times" to all
 * - learned {}: the one that keeps has written down what it learned of frames (`learned_kept` of
 *   its totals), which is read anew
 * - rest {}: nobody has asked for a while; memory of structures that the last frame did not use is
 *   given back
 *
 * out:
 * - trying {step, device}: before the device is opened, tested, measured
 *   (server/mapping/device_messages.h)
 * - measured {device: {...}}: again, once its speed is known that was pending
 * - hello {device: {...}, depth}: ready; at most `depth` urgent renders and `depth` others may be
 * on their way at once
 * - failed {error, devices}: no device, and why none of them; the worker ends
 * - begin {id}: the GL thread works on it
 * - paused {id}: urgent ones, on scenes that the worker has, go before the rest of it
 * - resumed {id}: it goes on
 * - progress {id, stage, share}: how far one is that takes long, at most four times a second
 * - submitted {id}: the device works on it, and the GL thread may go on with another
 * - rendered {id}: the encode pool works on it
 * - done {id, stats, drawn}, descriptor: the image (sealed memfd). `drawn` is the digest of the
 *   canonical request with what was chosen for a target; "" without one
 * - answer {id, result}, perhaps a descriptor: its image or text
 * - totals {programs_*, gpu_used_bytes, cache_*}: at the start and after each frame, question and
 *   rest
 * - error {id, error}: this request failed, the worker is fine
 * - lost {id, error}: the context is lost; the worker ends */
int worker_main(int socket);

#endif
