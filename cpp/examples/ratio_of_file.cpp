// SPDX-License-Identifier: MIT
// The ratio of the two columns of a file, output and regressor, with its standard error: ratio_of_file FILE

#include <cstdio>
#include <fstream>
#include <palpate/estimator/adaptive_window.hpp>
#include <vector>

int main(int argc, char** argv) {
  std::ifstream file(argc == 2 ? argv[1] : "");
  std::vector<double> outputs, regressors;
  for (double output = 0, regressor = 0; file >> output >> regressor;) {
    outputs.push_back(output);
    regressors.push_back(regressor);
  }
  if (!file.eof()) {
    std::fprintf(stderr, "not a file of two columns of numbers: line %zu\n", outputs.size() + 1);
    return 2;
  }
  palpate::AdaptiveWindow<double> estimator;
  std::size_t accepted = 0;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    accepted += estimator.update(outputs[i], regressors[i]).accepted;
  }
  std::printf("ratio %.17g, standard error %.17g, from %zu of %zu samples\n", estimator.ratio(),
              estimator.standard_error(), accepted, outputs.size());
}
