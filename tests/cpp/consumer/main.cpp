#include <cstdio>
#include <palpate/palpate.hpp>

int main() {
  palpate::AdaptiveRls<float> estimator;
  for (int i = 0; i < 250; ++i) {
    estimator.update(0.5f, 0.25f);
  }
  std::printf("palpate %s: ratio %.3f\n", PALPATE_VERSION, static_cast<double>(estimator.ratio()));
}
