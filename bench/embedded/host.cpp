// SPDX-License-Identifier: MIT
// The results on this machine.

#include <cstdio>

#include "results.hpp"

void put(const char* text) { std::fputs(text, stdout); }

int main() { print_results(); }
