// SPDX-License-Identifier: MIT
// The scenes, estimators and stages of bench/embedded in one program, in float: a hash of each, and the touches.

#define SUBJECT Fixed  // one of them; all subjects are taken from the same template

#include "../../bench/embedded/results.cpp"  // NOLINT(bugprone-suspicious-include)
#include "../../bench/embedded/subject.cpp"  // NOLINT(bugprone-suspicious-include): one program, compiled at once
