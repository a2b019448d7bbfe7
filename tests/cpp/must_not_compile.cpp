// SPDX-License-Identifier: MIT
// Each case is an error, whose message stands beside it.

#if defined(__FAST_MATH__)  // palpate needs IEEE arithmetic
#include <palpate/estimator/rls.hpp>
#else
#include <palpate/bank.hpp>
#include <palpate/embedded.hpp>
#include <palpate/palpate.hpp>
#include <palpate/ring.hpp>
#endif

void use() {
  using namespace palpate;
#if CASE == 1  // lvalue required|not assignable
  Rls<float>().covariance() = 1.0f;
#elif CASE == 2  // palpate::Rls: Real must be float or double
  Rls<int>().update(1, 1);
#elif CASE == 3  // a Forgetting needs real_type, which is the estimator's Real
  Rls<float, SwitchedForgetting<double> >().update(1.0f, 1.0f);
#elif CASE == 4  // palpate::Align: Ticks must be an integer of 32 or 64 bits
  HandheldTracker<double, double> tracker;
#elif CASE == 5  // Capacity must be a power of two
  Ring<int, 100> ring;
#elif CASE == 6  // palpate::Bank: Streams must be 1 or more
  Bank<AdaptiveRls<float>, 0> bank;
#endif
}
