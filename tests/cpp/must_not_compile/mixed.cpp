// error: Forgetting, Detector and Bound must be of the same Real as the estimator
#include <palpate/estimator/rls.hpp>

int main() { return palpate::Rls<float, palpate::SwitchedForgetting<double>>().update(1.0f, 1.0f).accepted; }
