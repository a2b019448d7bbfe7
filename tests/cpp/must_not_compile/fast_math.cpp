// error: palpate needs IEEE arithmetic
#define __FAST_MATH__ 1
#include <palpate/estimator/rls.hpp>

int main() { return palpate::Rls<float>().update(1.0f, 1.0f).accepted; }
