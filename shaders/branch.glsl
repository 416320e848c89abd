// SPDX-License-Identifier: MIT
// A branch that is really taken. llvmpipe runs both sides of an `if` under a mask, but leaves a
// loop as soon as no lane is active; GPUs compile this to the same jump as an `if`. Costs one
// iteration of the loop budget. No break inside.
#define BRANCH(condition) for (bool branch_ = (condition); branch_; branch_ = false)
