// SPDX-License-Identifier: MIT
#pragma once

// All headers: #include <palpate/palpate.hpp>.

#include <palpate/elasticity.hpp>
#include <palpate/embedded.hpp>
#include <palpate/estimator/adaptive_window.hpp>
#include <palpate/estimator/vector_rls.hpp>
#include <palpate/ring.hpp>
#include <palpate/stage/stamps.hpp>
#include <palpate/version.hpp>

/// Estimators of the ratio of two capacitance changes, the stages around them, and the scenes, which are both together.
namespace palpate {}
