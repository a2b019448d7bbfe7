// error: lvalue required|not assignable
#include <palpate/estimator/rls.hpp>

int main() { palpate::Rls<float>().covariance() = 1.0f; }
